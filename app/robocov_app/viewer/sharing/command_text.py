"""A run as a command of robocov."""

import shlex
from collections.abc import Iterator
from pathlib import Path

from robocov.conditions import PARAMETERS, Conditions
from robocov.defaults import DEFAULT_DT_S
from robocov.errors import format_exactly
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import DEFAULT_PROPERTIES, SessionScenario
from robocov_app.viewer.sharing.shared_run import SharedRun
from robocov_app.viewer.sharing.values import format_gain_value, format_time

_PROPERTY_OPTIONS = (
    "radius",
    "max_speed",
    "max_acceleration",
    "viscosity",
    "sensing_range",
    "communication_range",
    "track_width",
    "turning_rate",
)
"""Properties of robots for which the commands have an option."""
_IDEAL = Conditions()


def can_be_command(run: SharedRun) -> bool:
    """Return whether the options of a command can describe a run.

    No option describes later edits, given starting positions, differing robots, a mass other than the
    default, or a separate seed for the disturbances. Runs with failing or joining robots are excluded too:
    the window simulates them differently from the command.

    Parameters
    ----------
    run : SharedRun

    Returns
    -------
    bool
    """
    scenario = run.scenario
    properties = scenario.properties
    has_own_seed = scenario.conditions is not None and scenario.conditions.seed != scenario.seed
    return not (
        run.later_edits
        or scenario.given_starts is not None
        or properties.values_by_robot
        or properties.mass != DEFAULT_PROPERTIES.mass
        or has_own_seed
        or run.has_team_changes
    )


def build_command(run: SharedRun) -> str:
    """Return the command that simulates a run.

    If a controller occurs more than once, there is one line per controller.

    Parameters
    ----------
    run : SharedRun
        A run that `can_be_command`.

    Returns
    -------
    str
        For example ``robocov run rooms --controller rapf --robots 6 --seed 0 --duration 12.4``.
    """
    controllers = run.scenario.controllers
    common = list(_list_common_options(run))
    if len(controllers) == 1:
        return _build_run_command(run.map_name, controllers[0], common)
    names = [controller.name for controller in controllers]
    if len(set(names)) < len(names):
        lines: list[str] = []
        for number, controller in enumerate(controllers, 1):
            out = f"{Path(run.map_name).stem}-{number}"
            lines.append(_build_run_command(run.map_name, controller, [*common, "--out", out]))
        return "\n".join(lines)
    gains: list[str] = []
    for controller in controllers:
        gains += [f"{controller.name}.{text}" for text in _list_gains(controller)]
    words = ["robocov", "compare", run.map_name, "--controllers", *names]
    if gains:
        words += ["--set", *gains]
    return shlex.join([*words, *common])


def build_session_command(path: Path, user_controllers: list[str]) -> str:
    """Return the command that simulates a saved session with all its edits.

    Parameters
    ----------
    path : Path
        The session file.
    user_controllers : list of str
        Controllers in files of the user that the session needs.

    Returns
    -------
    str
    """
    words = ["robocov", "run", str(path)]
    if user_controllers:
        words += ["--controller", ",".join(user_controllers)]
    return shlex.join(words)


def _build_run_command(map_name: str, controller: ControllerChoice, options: list[str]) -> str:
    words = ["robocov", "run", map_name, "--controller", controller.name]
    gains = _list_gains(controller)
    if gains:
        words += ["--set", *gains]
    return shlex.join([*words, *options])


def _list_gains(controller: ControllerChoice) -> list[str]:
    """Return the gains that differ from their defaults, as in ``--set``."""
    gains = controller.drop_defaults().gains
    return [f"{name}={format_gain_value(value, is_json=True)}" for name, value in gains.items()]


def _list_common_options(run: SharedRun) -> Iterator[str]:
    """Yield the options that do not depend on the controller."""
    scenario = run.scenario
    yield from ("--robots", str(scenario.robots))
    if scenario.start is not None:
        yield from ("--start", scenario.start)
    yield from ("--seed", str(scenario.seed))
    if run.duration is not None:
        yield from ("--duration", format_time(run.duration))
    if scenario.dt != DEFAULT_DT_S:
        yield from ("--dt", format_exactly(scenario.dt))
    yield from _list_property_options(scenario.properties)
    yield from _list_condition_options(scenario)


def _list_property_options(properties: RobotProperties) -> Iterator[str]:
    for name in _PROPERTY_OPTIONS:
        value = getattr(properties, name)
        if value != getattr(DEFAULT_PROPERTIES, name):
            yield from (_name_option(name), format_exactly(value))


def _list_condition_options(scenario: SessionScenario) -> Iterator[str]:
    conditions = scenario.conditions
    if conditions is None:
        return
    for name in PARAMETERS:
        value = getattr(conditions, name)
        if value != getattr(_IDEAL, name):
            yield from (_name_option(name), format_exactly(value))
    if conditions.hides_density:
        yield from ("--density", conditions.density)


def _name_option(name: str) -> str:
    return "--" + name.replace("_", "-")
