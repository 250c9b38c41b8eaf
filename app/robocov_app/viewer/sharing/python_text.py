"""A run as a few lines of Python."""

from collections.abc import Iterator
from typing import Any

from robocov.conditions import PARAMETERS, Conditions
from robocov.defaults import DEFAULT_DT_S
from robocov.team import UNITS, Team
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import DEFAULT_PROPERTIES, SessionScenario
from robocov_app.viewer.sharing.shared_run import SharedRun
from robocov_app.viewer.sharing.values import (
    format_gain_value,
    format_python_number,
    format_python_text,
    format_time,
)

_IDEAL = Conditions()


def build_python(run: SharedRun) -> str:
    """Return a Python script that simulates a run.

    Parameters
    ----------
    run : SharedRun

    Returns
    -------
    str
        The script assigns a `robocov.Record` to ``record`` and prints it; with several controllers, it
        assigns a `robocov.Comparison` to ``comparison`` and prints its table. Edits that it does not repeat
        are listed in comments.
    """
    lines = ["import robocov as rc", ""]
    if run.later_edits:
        lines.append("# Edits in the window that are not repeated here:")
        lines += [f"# {description}" for description in run.later_edits]
    if not run.is_exact:
        lines.append("# When all robots have failed, positions differ from those in the window.")
    scenario = run.scenario
    if scenario.properties.values_by_robot:
        lines += _list_team_lines(scenario)
    controllers = scenario.controllers
    if len(controllers) == 1:
        arguments = [format_python_text(run.map_name), format_python_text(controllers[0].name)]
        gains = controllers[0].drop_defaults().gains
        if gains:
            arguments.append(f"gains={_format_gains(controllers[0])}")
        lines += _format_call("record = rc.run", [*arguments, *_list_arguments(run)])
        lines.append("print(record)")
    else:
        names = ", ".join(_format_controller(controller) for controller in controllers)
        arguments = [format_python_text(run.map_name), f"[{names}]"]
        lines += _format_call("comparison = rc.compare", [*arguments, *_list_arguments(run)])
        lines.append("print(comparison)")
    return "\n".join(lines) + "\n"


def _format_call(function: str, arguments: list[str]) -> list[str]:
    """Return the lines of a call, with one argument on each."""
    return [f"{function}(", *(f"    {argument}," for argument in arguments), ")"]


def _format_controller(controller: ControllerChoice) -> str:
    """Return a controller as an argument of `robocov.compare`."""
    name = format_python_text(controller.name)
    if controller.drop_defaults().gains:
        return f"rc.make_controller({name}, {_format_gains(controller)})"
    return name


def _format_gains(controller: ControllerChoice) -> str:
    """Return the gains that differ from their defaults, as a dictionary."""
    items: list[str] = []
    for name, value in controller.drop_defaults().gains.items():
        text = format_gain_value(value, is_json=False)
        items.append(f"{format_python_text(name)}: {text}")
    return "{" + ", ".join(items) + "}"


def _list_arguments(run: SharedRun) -> Iterator[str]:
    """Yield the keyword arguments that do not depend on the controller."""
    scenario = run.scenario
    yield _format_team(scenario)
    if scenario.start is not None:
        yield f"start={format_python_text(scenario.start)}"
    yield f"seed={scenario.seed}"
    if scenario.given_starts is not None:
        yield f"starts={_format_rows(scenario.given_starts.tolist())}"
        if scenario.velocities is not None:
            yield f"velocities={_format_rows(scenario.velocities.tolist())}"
        if scenario.steering is not None:
            yield f"steering={_format_rows(scenario.steering.tolist())}"
    if run.duration is not None:
        yield f"duration={format_time(run.duration)}"
    if scenario.dt != DEFAULT_DT_S:
        yield f"dt={format_python_number(scenario.dt)}"
    if scenario.conditions is not None:
        yield f"conditions={_format_conditions(scenario.conditions)}"


def _format_team(scenario: SessionScenario) -> str:
    """Return the argument that describes the robots."""
    properties = scenario.properties
    if properties.values_by_robot:
        return "team=team"
    changes = [
        f"{name}={format_python_number(getattr(properties, name))}"
        for name in UNITS
        if getattr(properties, name) != getattr(DEFAULT_PROPERTIES, name)
    ]
    if not changes:
        return f"robots={scenario.robots}"
    arguments = ", ".join([str(scenario.robots), *changes])
    return f"team=rc.Team.homogeneous({arguments})"


def _list_team_lines(scenario: SessionScenario) -> list[str]:
    """Return the lines that build a team of robots that differ from each other."""
    team: Team = scenario.properties.build_team(range(1, scenario.robots + 1))
    columns = [f"{name}={_format_numbers(getattr(team, name).tolist())}" for name in UNITS]
    return [*_format_call("team = rc.Team", columns), ""]


def _format_conditions(conditions: Conditions) -> str:
    """Return the call that builds the conditions, with the arguments that differ from ideal conditions."""
    arguments: list[str] = []
    for name in PARAMETERS:
        value = getattr(conditions, name)
        if value != getattr(_IDEAL, name):
            arguments.append(f"{name}={format_python_number(value)}")
    for name in ("failures", "joins"):
        events = getattr(conditions, name)
        if events:
            arguments.append(f"{name}={_format_events(events)}")
    if conditions.hides_density:
        arguments.append(f"density={conditions.density!r}")
    arguments.append(f"seed={conditions.seed}")
    return f"rc.Conditions({', '.join(arguments)})"


def _format_events(events: tuple[Any, ...]) -> str:
    """Return failures or joins as a list of tuples."""
    return str([tuple(event) for event in events])


def _format_numbers(values: list[float]) -> str:
    return "[" + ", ".join(format_python_number(value) for value in values) + "]"


def _format_rows(rows: list[list[float]]) -> str:
    return "[" + ", ".join(_format_numbers(row) for row in rows) + "]"
