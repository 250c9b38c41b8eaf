"""Everything that the run in the window depends on, so that it can be simulated without the window."""

from dataclasses import dataclass, replace

import numpy as np

from robocov.errors import InputError, RobocovError
from robocov.mapfile import load_map, to_json
from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.editing.edits import (
    MapEdit,
    RemovePane,
    Restart,
    SessionEdit,
    SetController,
    SetRobotProperties,
)
from robocov_app.viewer.session.pane_group import keeps_a_robot
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.session.timeline import Timeline


@dataclass(frozen=True)
class SharedRun:
    """A run of the window, up to its present.

    Attributes
    ----------
    map_name : str
        Bundled name or path of the map.
    scenario : SessionScenario
        Initial conditions, including the edits at time 0.
    duration : float or None, s
        Duration of the run; None if it has not started.
    later_edits : tuple of str
        Descriptions of the edits that the initial conditions do not include.
    """

    map_name: str
    scenario: SessionScenario
    duration: float | None
    later_edits: tuple[str, ...]

    @property
    def has_team_changes(self) -> bool:
        """Whether the conditions let robots fail or join."""
        conditions = self.scenario.conditions
        return conditions is not None and conditions.has_team_changes

    @property
    def is_exact(self) -> bool:
        """Whether a simulation of the scenario gives the positions in the window.

        It does not if all robots fail: the window lets the last one work.
        """
        scenario = self.scenario
        if scenario.conditions is None or not self.has_team_changes:
            return True
        return keeps_a_robot(scenario.conditions, scenario.robots)

    @property
    def has_own_map(self) -> bool:
        """Whether the map differs from the one with its name, because it was edited."""
        try:
            saved = load_map(self.map_name)
        except RobocovError:
            return True
        return to_json(saved) != to_json(self.scenario.environment)


def describe_run(timeline: Timeline, map_name: str) -> SharedRun:
    """Describe the run of a timeline, up to its present.

    Parameters
    ----------
    timeline : Timeline
    map_name : str
        Bundled name or path of the map.

    Returns
    -------
    SharedRun

    Raises
    ------
    ParameterError
        If the session cannot be recomputed from its edits.
    """
    timeline.require_reproducible()
    node, step = timeline.destination
    root, *followers = timeline.document.get_path(node)
    draft = _ScenarioDraft(root.require_scenario())
    for follower in followers:
        draft.include(follower)
    scenario = draft.build()
    duration = step * scenario.dt if step else None
    return SharedRun(map_name, scenario, duration, tuple(draft.later_edits))


class _ScenarioDraft:
    """A scenario to which edits at time 0 are added.

    Parameters
    ----------
    scenario : SessionScenario
        Initial conditions of the run.

    Attributes
    ----------
    scenario : SessionScenario
        The scenario with the edits so far, except for its controllers.
    later_edits : list of str
        Descriptions of the nodes whose edits are not part of the initial conditions.
    """

    def __init__(self, scenario: SessionScenario) -> None:
        self.scenario = scenario
        self.later_edits: list[str] = []
        self._controllers = dict(enumerate(scenario.controllers))

    def include(self, node: Node) -> None:
        """Add the edits of a node; if one of them cannot be added, add none, and list the node instead."""
        scenario = self.scenario
        controllers = dict(self._controllers)
        try:
            for edit in node.edits:
                self._add(edit)
        except _LaterEditError:
            self.scenario = scenario
            self._controllers = controllers
            self.later_edits.append(f"{node.branch_step * scenario.dt:.1f} s: {node.description}")

    def build(self) -> SessionScenario:
        """Return the scenario with all edits."""
        controllers = tuple(self._controllers[pane] for pane in sorted(self._controllers))
        return replace(self.scenario, controllers=controllers)

    def _add(self, edit: SessionEdit) -> None:
        """Add an edit; raise an error if it is not part of the initial conditions."""
        if isinstance(edit, RemovePane):
            # The other panes do not depend on this one.
            self._controllers.pop(edit.pane, None)
            return
        if edit.step != 0 or isinstance(edit, Restart):
            raise _LaterEditError
        if isinstance(edit, SetController):
            self._set_controller(edit.pane, edit.controller)
        elif isinstance(edit, SetRobotProperties):
            self._set_properties(edit.properties)
        elif isinstance(edit, MapEdit):
            self._edit_map(edit)
        else:
            raise _LaterEditError

    def _set_controller(self, pane: int, controller: ControllerChoice) -> None:
        self._controllers[pane] = controller

    def _set_properties(self, properties: RobotProperties) -> None:
        self._replace_scenario(replace(self.scenario, properties=properties))

    def _edit_map(self, edit: MapEdit) -> None:
        environment = edit.build_environment(self.scenario.environment)
        self._replace_scenario(replace(self.scenario, environment=environment))

    def _replace_scenario(self, scenario: SessionScenario) -> None:
        """Replace the scenario; raise an error unless its robots start where those in the window did."""
        try:
            is_same = np.array_equal(scenario.starts, self.scenario.starts)
        except InputError:
            is_same = False
        if not is_same:
            raise _LaterEditError
        self.scenario = scenario


class _LaterEditError(Exception):
    """An edit is not part of the initial conditions."""
