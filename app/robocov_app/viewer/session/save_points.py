"""Save points, to which a session returns after an unexpected error."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from robocov.errors import RobocovError
from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.editing.edits import SessionEdit
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.past.states import RunState
from robocov_app.viewer.session.past.trails import build_trail, merge_sections
from robocov_app.viewer.session.present import Present
from robocov_app.viewer.session.timeline import Timeline


@dataclass(frozen=True)
class SavePoint:
    """State of a timeline, to which the timeline can return.

    Attributes
    ----------
    head : Node
        Head of the timeline.
    head_edits : tuple of SessionEdit
        Edits of the head.
    head_kind, head_description : str
        Kind and description of the head.
    node_count : int
        Number of nodes of the document.
    revision : int
        Revision of the document.
    run : PaneGroup
        The run.
    run_key : tuple
        Values of the run; each edit or step changes at least one of them.
    panes : tuple of Pane
        The panes.
    history : RunHistory
        The recorded past.
    last : RunState
        Newest state of the history.
    shown_index : int or None
        Index of the displayed state; None for the present.
    record_end_time : float or None, s
        End of the record from which the session started; None if there is none.
    """

    head: Node
    head_edits: tuple[SessionEdit, ...]
    head_kind: str
    head_description: str
    node_count: int
    revision: int
    run: PaneGroup
    run_key: tuple[object, ...]
    panes: tuple[Pane, ...]
    history: RunHistory
    last: RunState
    shown_index: int | None
    record_end_time: float | None


def build_save_point(timeline: Timeline) -> SavePoint:
    """Build a save point of the present state of a timeline."""
    return SavePoint(
        head=timeline.head,
        head_edits=tuple(timeline.head.edits),
        head_kind=timeline.head.kind,
        head_description=timeline.head.description,
        node_count=len(timeline.document.nodes),
        revision=timeline.document.revision,
        run=timeline.run,
        run_key=_build_run_key(timeline.run),
        panes=tuple(timeline.panes),
        history=timeline.history,
        last=timeline.history.last,
        shown_index=timeline.shown_index,
        record_end_time=timeline.record_end_time,
    )


def is_at_save_point(timeline: Timeline, point: SavePoint) -> bool:
    """Return whether a timeline is the same as at a save point, apart from the displayed state."""
    return (
        timeline.run is point.run
        and _build_run_key(timeline.run) == point.run_key
        and timeline.history is point.history
        and timeline.history.last is point.last
        and timeline.head is point.head
        and tuple(timeline.head.edits) == point.head_edits
        and len(timeline.document.nodes) == point.node_count
    )


def restore_save_point(timeline: Timeline, point: SavePoint) -> None:
    """Return a timeline to a save point.

    Parameters
    ----------
    timeline : Timeline
        The timeline, which an unexpected error may have left in an inconsistent state.
    point : SavePoint
        The state to return to.
    """
    _restore_document(timeline, point)
    point.history.rewind(point.last)
    run = point.run
    # If the controller of a record no longer exists, its run cannot be resumed, but has not changed either.
    with suppress(RobocovError):
        run = PaneGroup.resume(point.last)
    old_panes = {pane.number: pane for pane in point.panes}
    for pane in run.panes:
        if pane.number in old_panes:
            old_trail = old_panes[pane.number].trail
            pane.trail = build_trail(
                merge_sections(old_trail.extract(-np.inf, run.time), pane.trail.extract(-np.inf, np.inf))
            )
            pane.curves = old_panes[pane.number].curves
            pane.distance_curve = pane.curves["distance"]
            pane.sensed = old_panes[pane.number].sensed.copy()
            pane.sensed.remove_after(run.time)
    timeline.follow(None)
    timeline.is_advancing = False
    timeline.replace_present(Present(point.head, run, point.history))
    timeline.shown_index = point.shown_index
    timeline.record_end_time = point.record_end_time


def _restore_document(timeline: Timeline, point: SavePoint) -> None:
    nodes = timeline.document.nodes
    del nodes[point.node_count :]
    for node in nodes:
        if node.redo_child is not None and node.redo_child not in nodes:
            node.redo_child = None
    point.head.edits[:] = point.head_edits
    point.head.kind = point.head_kind
    point.head.description = point.head_description
    timeline.document.revision = point.revision


def _build_run_key(run: PaneGroup) -> tuple[object, ...]:
    """Return a key of the state of a run, which changes with each edit and each step."""
    panes = [(pane.number, id(pane.setup), id(pane.simulation)) for pane in run.panes]
    return run.step, run.drag, id(run.scenario), *panes
