"""The session of the window, with all edits that users can make."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from robocov.environment import Environment, Point
from robocov_app.viewer.session.displayed import DisplayedState
from robocov_app.viewer.session.document import Node, SessionDocument
from robocov_app.viewer.session.editing.edits import (
    AddRobot,
    DragRobot,
    FailRobot,
    PaintDensity,
    PlaceRobot,
    ReleaseRobot,
    RemovePane,
    RemoveRobot,
    Restart,
    ReviveRobot,
    RunEdit,
    SetController,
    SetRobotProperties,
    compare_obstacles,
)
from robocov_app.viewer.session.files.session_file import SavedSession
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.playback import Playback
from robocov_app.viewer.session.present import Present
from robocov_app.viewer.session.save_points import (
    SavePoint,
    build_save_point,
    is_at_save_point,
    restore_save_point,
)
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario, require_space_for_pane
from robocov_app.viewer.session.timeline import Timeline

MIN_PUSH_M = 5e-3
"""A robot counts as pushed if an obstacle moves it by more than this; contacts always move it a little."""
GESTURE_WINDOW_S = 1.0
"""Changes of the same value within this simulated time, for example by a slider, count as one edit."""
_DRAG_DECIMALS = 4
_FIELDS_OF_STARTS = {"environment", "robots", "start", "seed"}
"""Fields of a scenario that determine the starting positions, unless these are given."""


@dataclass(frozen=True)
class _Gesture:
    """Consecutive edits of the same robot, gain or stroke, which count as one.

    Attributes
    ----------
    key : object
        Identifies the robot, gain or stroke that is edited.
    time : float, s
        Time of the last edit.
    past_version : int
        Version of the past at the last edit.
    """

    key: object
    time: float
    past_version: int

    def continues(self, key: object, kind: str, timeline: Timeline) -> bool:
        """Return whether an edit with this key and of this kind continues the gesture."""
        if key != self.key or timeline.past_version != self.past_version:
            return False
        # A drag of a robot may last for any time.
        return kind == "hand" or timeline.end_time - self.time < GESTURE_WINDOW_S


class Session:
    """The session of the window: a document of edits, and its timeline.

    Edits are applied at the displayed step. If that is in the past, a new branch starts there. An edit that
    raises changes nothing.

    Parameters
    ----------
    scenario : SessionScenario or None
        Map, robots and controllers at time 0.
    timeline : Timeline or None
        Timeline of an existing session, instead of a scenario.

    Attributes
    ----------
    timeline : Timeline
        The present, the recorded past and the branches.
    displayed : DisplayedState
        The displayed state.
    playback : Playback
        Whether and how fast time passes.

    Raises
    ------
    StartError
        If there is no space for the team.
    ParameterError
        If a controller or the team does not accept a value.
    """

    def __init__(self, scenario: SessionScenario | None = None, timeline: Timeline | None = None) -> None:
        if timeline is None:
            assert scenario is not None
            timeline = Timeline(SessionDocument.start(scenario))
        self.timeline = timeline
        self.displayed = DisplayedState(timeline)
        self.playback = Playback(timeline)
        self._gesture: _Gesture | None = None

    @classmethod
    def open(cls, saved: SavedSession, seconds: float = np.inf) -> Self:
        """Open a session from the content of a file, recomputed up to its present. It is paused.

        Parameters
        ----------
        saved : SavedSession
            Content of the file.
        seconds : float, s
            Maximum time for the call. If it is not enough, the seek continues in the next frames.

        Returns
        -------
        Session
        """
        root = saved.document.get_path(saved.head)[0]
        session = cls(timeline=Timeline(saved.document, Present.start(root)))
        session.playback.is_playing = False
        session.timeline.seek(saved.head, saved.step, seconds=seconds)
        return session

    def apply(self, edit: RunEdit, kind: str, description: str, gesture: object = None) -> None:
        """Apply an edit at the displayed step.

        Parameters
        ----------
        edit : RunEdit
            The edit.
        kind : str
            Kind of the edit, as in `SessionEvent`.
        description : str
            Description of the edit.
        gesture : object
            Consecutive edits with the same gesture count as one; None for an edit of its own.

        Raises
        ------
        StartError, ParameterError, MapError
            If the edit is not possible. Then nothing has changed.
        """
        timeline = self.timeline
        timeline.finish_seek()
        timeline.follow(None)
        releases_robot = False
        if timeline.is_live:
            timeline.run.apply(edit)
        else:
            releases_robot = _apply_in_past(timeline, edit)
        if self._gesture is not None and self._gesture.continues(gesture, kind, timeline):
            node = timeline.head
            _extend_node(node, replace(edit, step=timeline.step), kind, description)
        else:
            node = timeline.document.build_node(timeline.head, timeline.step, kind, description, edit)
            # A replay must release the dragged robot as well, before the edit.
            if releases_robot:
                node.edits.insert(0, ReleaseRobot(step=timeline.step))
        self._gesture = None
        if gesture is not None:
            self._gesture = _Gesture(gesture, timeline.end_time, timeline.past_version)
        timeline.document.revision += 1
        timeline.note_edit(node)

    def restart(
        self,
        *,
        environment: Environment | None = None,
        controllers: tuple[ControllerChoice, ...] | None = None,
        robots: int | None = None,
        start: str | None = None,
        seed: int | None = None,
        dt: float | None = None,
    ) -> None:
        """Start again at time 0. Undo returns to the previous run.

        Parameters
        ----------
        environment : Environment or None
            Another map, with its first start unless `start` is given.
        controllers : tuple of ControllerChoice or None
            Other controllers, one for each pane.
        robots : int or None
            Another number of robots.
        start : str or None
            Name of another start of the map.
        seed : int or None
            Another seed of the starting positions.
        dt : float or None, s
            Another control period.

        Raises
        ------
        StartError
            If there is no space for the team.
        ParameterError
            If a value cannot be used.
        """
        requested = {
            "environment": environment,
            "controllers": controllers,
            "robots": robots,
            "start": start,
            "seed": seed,
            "dt": dt,
        }
        changes = {name: value for name, value in requested.items() if value is not None}
        timeline = self.timeline
        # The seek in progress may end in a run with another scenario.
        timeline.finish_seek()
        old = timeline.scenario
        new = _change_scenario(old, changes)
        node = timeline.document.build_node(
            timeline.head, timeline.step, "begin", _describe_restart(old, new), Restart(new)
        )
        timeline.seek(node, 0)
        timeline.record_end_time = None
        timeline.document.revision += 1

    def branch(self) -> bool:
        """Make the displayed state the present; return False if it already is.

        The later states are kept as another branch.
        """
        timeline = self.timeline
        if timeline.is_live:
            return False
        shown = timeline.history[timeline.displayed_index]
        timeline.seek(timeline.document.nodes[shown.node], shown.step)
        return True

    def seek(self, node: Node, step: int | None = None) -> None:
        """Go to a step of a node; see `Timeline.seek`. Long computations continue in the next frames."""
        self.timeline.seek(node, step, seconds=self.playback.seek_seconds)

    def undo(self) -> str | None:
        """Return to the state before the newest edit.

        Returns
        -------
        str or None
            Description of the edit; None if there is none.
        """
        node, _ = self.timeline.destination
        if node.parent is None:
            return None
        node.parent.redo_child = node
        self.seek(node.parent, node.branch_step)
        return node.description

    def redo(self) -> str | None:
        """Return to the end of the branch that the last undo left.

        Returns
        -------
        str or None
            Description of the edit; None if there is none.
        """
        node = self.timeline.destination[0].redo_child
        if node is None:
            return None
        self.seek(node)
        return node.description

    def show_time(self, time: float) -> None:
        """Release a dragged robot, and display the recorded state at a time, s."""
        self.release()
        self.timeline.show(self.timeline.history.find_index(time))

    def show_offset(self, offset: int) -> None:
        """Release a dragged robot, and display the state that is `offset` states later (or earlier)."""
        self.release()
        self.timeline.show(max(self.timeline.displayed_index + offset, 0))

    def build_save_point(self) -> SavePoint:
        """Return the present state as an argument for `restore`."""
        return build_save_point(self.timeline)

    def restore(self, point: SavePoint) -> None:
        """Return to a save point after an unexpected error, and pause; do nothing if nothing has changed."""
        # A comparison with the save point cannot detect that a step was interrupted.
        if is_at_save_point(self.timeline, point) and not self.timeline.is_advancing:
            return
        restore_save_point(self.timeline, point)
        self.playback.is_playing = False

    def set_controller(self, pane: Pane, controller: ControllerChoice) -> None:
        """Replace the controller of a pane, or its gains."""
        before = self.displayed.get_setup(pane).controller
        edit = SetController(pane.number, controller)
        if controller.name != before.name:
            self.apply(edit, "law", f"{controller.label} takes over")
        elif controller != before:
            changes = controller.describe_changes(before)
            changed_gain = changes.partition(" = ")[0]
            gesture = ("gain", pane.number, changed_gain)
            self.apply(edit, "law", f"{controller.label}: {changes}", gesture)

    def set_properties(self, properties: RobotProperties) -> None:
        """Replace the properties of all robots."""
        if properties != self.displayed.get_setup(self.timeline.panes[0]).properties:
            self.apply(SetRobotProperties(properties), "limits", "limits changed", "limits")

    def add_pane(self, controller: ControllerChoice) -> None:
        """Restart with an additional controller side by side with the others."""
        self.timeline.finish_seek()
        require_space_for_pane(len(self.timeline.panes))
        self.restart(controllers=(*self.timeline.scenario.controllers, controller))

    def remove_pane(self, pane: Pane) -> None:
        """Remove a pane."""
        self.apply(RemovePane(pane.number), "pane", f"{pane.controller.label} removed")

    def edit_map(self, environment: Environment, description: str) -> int:
        """Replace the obstacles of the map with those of another map.

        Parameters
        ----------
        environment : Environment
            The edited map.
        description : str
            Description of the edit.

        Returns
        -------
        int
            Number of robots that were pushed by obstacles, in the pane with the most of them.

        Raises
        ------
        StartError
            If there is no space for a robot.
        MapError
            If the map is invalid.
        """
        edit = compare_obstacles(self.displayed.environment, environment)
        before = {pane.number: self.displayed.get_positions(pane) for pane in self.timeline.panes}
        self.apply(edit, "obstacle", description)
        counts = [0]
        for pane in self.timeline.panes:
            # An edit in the past may bring back a pane that was removed later.
            if pane.number in before:
                displacements = pane.positions - before[pane.number]
                counts.append(int((np.hypot(*displacements.T) > MIN_PUSH_M).sum()))
        return max(counts)

    def paint(self, dabs: tuple[Point, ...], radius: float, *, lowers: bool, stroke: object) -> None:
        """Raise or lower the density with a brush.

        Parameters
        ----------
        dabs : tuple of tuple
            Points at which the brush is applied, (x, y) m each.
        radius : float, m
            Radius of the brush.
        lowers : bool
            Whether the density is lowered.
        stroke : object
            Identifies the brush stroke to which the dabs belong. A stroke counts as one edit.
        """
        description = "density lowered" if lowers else "density raised"
        self.apply(PaintDensity(dabs, radius, lowers), "density", description, ("stroke", stroke))

    def drag_robot(self, number: int, point: Point) -> None:
        """Pull a robot to a point by a spring; if it has failed or the session is paused, place it there."""
        if self.playback.is_playing and number in self.displayed.numbers:
            to = round(float(point[0]), _DRAG_DECIMALS), round(float(point[1]), _DRAG_DECIMALS)
            self.apply(DragRobot(number, to), "hand", f"robot {number} was dragged", ("hand", number))
        else:
            self.place_robot(number, point)

    def release(self) -> None:
        """Release the dragged robot, if there is one, and end the current gesture."""
        if self.timeline.run.drag is not None and self.timeline.is_live:
            number = self.timeline.run.drag.robot
            self.apply(ReleaseRobot(), "hand", f"robot {number} was dragged", ("hand", number))
        self._gesture = None

    def place_robot(self, number: int, point: Point) -> None:
        """Put a robot at the free point nearest to a given one; calls until `release` count as one edit."""
        at = float(point[0]), float(point[1])
        self.apply(PlaceRobot(number, at), "hand", f"robot {number} was moved", ("place", number))

    def add_robot(self, point: Point) -> int:
        """Add a robot at the free point nearest to a given one, and return its number."""
        number = self.displayed.get_setup(self.timeline.panes[0]).all_numbers[-1] + 1
        at = float(point[0]), float(point[1])
        self.apply(AddRobot(number, at), "robot", f"robot {number} joined")
        return number

    def remove_robot(self, number: int) -> None:
        """Remove a robot."""
        self.apply(RemoveRobot(number), "robot", f"robot {number} removed")

    def fail_robot(self, number: int) -> None:
        """Make a robot fail."""
        self.apply(FailRobot(number), "failure", f"robot {number} failed")

    def revive_robot(self, number: int) -> None:
        """Revive a failed robot."""
        self.apply(ReviveRobot(number), "robot", f"robot {number} works again")


def _apply_in_past(timeline: Timeline, edit: RunEdit) -> bool:
    """Make the displayed step of a timeline the present, and apply an edit there.

    Returns
    -------
    bool
        Whether a robot that was being dragged at that step has been released.
    """
    shown = timeline.history[timeline.displayed_index]
    releases_robot = shown.drag is not None and not isinstance(edit, DragRobot | ReleaseRobot)

    def apply_to(run: PaneGroup) -> None:
        if releases_robot:
            run.drag = None
        run.apply(edit)

    timeline.seek(timeline.document.nodes[shown.node], shown.step, edit=apply_to)
    return releases_robot


def toggle_failure(session: Session, number: int) -> str:
    """Make a robot fail, or revive it if it has failed; return the description of the edit."""
    if number in session.displayed.get_setup(session.timeline.panes[0]).failed:
        session.revive_robot(number)
    else:
        session.fail_robot(number)
    return session.timeline.head.description


def _extend_node(node: Node, edit: RunEdit, kind: str, description: str) -> None:
    """Add an edit to the node of the gesture that it continues."""
    last = node.edits[-1]
    is_same_drag = isinstance(edit, DragRobot) and isinstance(last, DragRobot) and last.step == edit.step
    # Of several drag points within a step, only the last one matters; other edits accumulate.
    if is_same_drag and len(node.edits) > 1:
        node.edits.pop()
    node.edits.append(edit)
    node.kind = kind
    node.description = description


def _change_scenario(old: SessionScenario, changes: Mapping[str, Any]) -> SessionScenario:
    """Return a scenario with changes; drop starting positions and a start that no longer fit it."""
    changed = dict(changes)
    if changed.keys() & _FIELDS_OF_STARTS:
        changed["given_starts"] = None
    # An edit may have covered the start with an obstacle, which removes it from the map.
    is_start_available = old.start in {None, "uniform", *old.environment.starts}
    if "environment" in changed or not is_start_available:
        changed.setdefault("start", None)
    return replace(old, **changed)


def _describe_restart(old: SessionScenario, new: SessionScenario) -> str:
    """Describe the changes from the scenario before a restart to the new one."""
    parts = [f"{controller.label} compared" for controller in new.controllers[len(old.controllers) :]]
    if new.environment is not old.environment:
        parts.append(f"map {new.environment.name}")
    elif new.start_name != old.start_name:
        parts.append(f"start {new.start_name}")
    if new.robots != old.robots:
        parts.append(f"{new.robots} robots")
    if new.seed != old.seed:
        parts.append(f"seed {new.seed}")
    return ", ".join(parts) or "restarted"
