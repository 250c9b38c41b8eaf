"""The timeline of a session: its present, its recorded past, and the branches of the document."""

from collections.abc import Callable

import numpy as np

from robocov.errors import ParameterError, RobocovError
from robocov_app.viewer.session.document import Node, SessionDocument
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.past.curves import GhostCurve, SessionEvent
from robocov_app.viewer.session.past.ghosts import build_ghost_curves
from robocov_app.viewer.session.past.history import RunHistory
from robocov_app.viewer.session.present import Present, build_present, cache_present
from robocov_app.viewer.session.seek import Seek
from robocov_app.viewer.session.setup.scenario import SessionScenario

STEPS_BETWEEN_SETTLED_CHECKS = 12
"""Number of steps from one check whether the team has settled to the next."""
_TIME_TOLERANCE_S = 1e-9


class Timeline:
    """The present of a session, the past that led to it, and moves to other branches.

    `advance` simulates one step. `seek` is the only way to any other state: it builds that state completely
    before it replaces the present, so that an error changes nothing. `show` only selects which recorded
    state is displayed.

    Parameters
    ----------
    document : SessionDocument
        The edits of the session.
    present : Present or None
        The present; by default time 0 of the first node.
    record_end_time : float or None, s
        End of the record from which the session started; None if it did not start from a record.
    is_record_reproducible : bool
        Whether replaying the document reproduces that record.

    Attributes
    ----------
    head : Node
        The node of the document whose time span contains the present.
    run : PaneGroup
        The panes at the present step.
    history : RunHistory
        The recorded states up to the present, which is the last one.
    shown_index : int or None
        Index of the displayed state in the history; None for the present.
    is_settled : bool
        Whether no robot has moved noticeably for some time.
    past_version : int
        Number that increases when the past is replaced.
    pending_seek : Seek or None
        The seek in progress.
    """

    head: Node
    run: PaneGroup
    history: RunHistory
    shown_index: int | None
    is_settled: bool
    _calls_at_shown_state: int
    _ghosts: list[GhostCurve] | None

    def __init__(
        self,
        document: SessionDocument,
        present: Present | None = None,
        record_end_time: float | None = None,
        *,
        is_record_reproducible: bool = True,
    ) -> None:
        """Start at a given present, or at time 0 of the first node."""
        self.document = document
        self.record_end_time = record_end_time
        self.is_record_reproducible = is_record_reproducible
        self.past_version = 0
        self.pending_seek: Seek | None = None
        # Whether a step was started, but not completed.
        self.is_advancing = False
        self._followed_path: list[Node] = []
        self.replace_present(present or Present.start(document.nodes[0]))

    @property
    def scenario(self) -> SessionScenario:
        """Current map, controllers and properties of the robots."""
        return self.run.scenario

    @property
    def panes(self) -> list[Pane]:
        """The panes at the present step."""
        return self.run.panes

    @property
    def step(self) -> int:
        """The present step."""
        return self.run.step

    @property
    def end_time(self) -> float:
        """The present time, s, at which the recorded past ends."""
        return self.run.time

    @property
    def is_live(self) -> bool:
        """Whether the present is displayed."""
        return self.shown_index is None

    @property
    def displayed_index(self) -> int:
        """Index of the displayed state in the history."""
        if self.shown_index is None:
            return len(self.history) - 1
        return self.shown_index

    @property
    def is_reproducible(self) -> bool:
        """Whether replaying the document reproduces the present."""
        return self.record_end_time is None or self.is_record_reproducible

    @property
    def is_at_record_end(self) -> bool:
        """Whether the present is the end of a record, and nothing was simulated after it."""
        return self.record_end_time is not None and self.end_time <= self.record_end_time + _TIME_TOLERANCE_S

    @property
    def is_seeking(self) -> bool:
        """Whether a seek is in progress."""
        return self.pending_seek is not None

    @property
    def destination(self) -> tuple[Node, int]:
        """Target of the seek in progress, as a node and a step; the present if there is no seek."""
        if self.pending_seek is None:
            return self.head, self.step
        return self.pending_seek.node, self.pending_seek.step

    @property
    def events(self) -> list[SessionEvent]:
        """The events up to the present."""
        return self.document.list_events(self.head, self.step, self.scenario.dt)

    @property
    def ghosts(self) -> list[GhostCurve]:
        """The curves of other branches."""
        if self._ghosts is None:
            self._ghosts = build_ghost_curves(self.document, self.head, self.step, self.scenario.dt)
        return self._ghosts

    def require_reproducible(self) -> None:
        """Raise a ParameterError unless the document reproduces the present, with controllers that exist."""
        if not self.is_reproducible:
            raise ParameterError("the session started from a record that cannot be recomputed")
        for pane in self.panes:
            pane.controller.build()

    def show(self, index: int) -> None:
        """Display the recorded state with an index; the last one is the present."""
        self.shown_index = index if index < len(self.history) - 1 else None
        self._calls_at_shown_state = 0

    def show_next(self) -> None:
        """Play one step of the past; display the next recorded state once its step is reached.

        If the past was thinned, this takes several calls, so that it plays at the same speed.
        """
        assert self.shown_index is not None
        displayed = self.history[self.shown_index]
        next_state = self.history[self.shown_index + 1]
        self._calls_at_shown_state += 1
        if self._calls_at_shown_state >= next_state.step - displayed.step:
            self.show(self.shown_index + 1)

    def advance(self) -> None:
        """Simulate one step. Controllers may raise any exception."""
        self.is_advancing = True
        try:
            self.head.automatic_events.update(self.run.advance())
        except RobocovError:
            # The error was expected, and nothing has to be restored.
            self.is_advancing = False
            raise
        # A branch may have started within a node whose edits lasted several steps, such as a drag.
        self.head.apply_edits(self.run)
        self.head.last_step = max(self.head.last_step, self.step)
        self.history.append(self.run.build_state(self.head.number))
        self._repeat_followed_edits()
        if self.step % STEPS_BETWEEN_SETTLED_CHECKS == 0:
            self.is_settled = Present(self.head, self.run, self.history).has_settled()
        self.is_advancing = False

    def follow(self, node: Node | None) -> None:
        """Repeat the edits on the path to a node when their step is reached; None to stop this.

        Edits at the present step are repeated at once.
        """
        self._followed_path = [] if node is None else self.document.get_path(node)
        self._repeat_followed_edits()

    def _repeat_followed_edits(self) -> None:
        """Enter the next nodes of the followed path if they start at the present step."""
        if self.head not in self._followed_path:
            self._followed_path = []
            return
        for node in self._followed_path[self._followed_path.index(self.head) + 1 :]:
            if node.branch_step != self.step:
                break
            node.apply_edits(self.run)
            self.note_edit(node)

    def note_edit(self, node: Node) -> None:
        """Record that the edits of a node were applied to the run at the present step.

        Parameters
        ----------
        node : Node
            The head, or one of its children. A new node is added to the document.
        """
        if node.number == len(self.document.nodes):
            self.document.nodes.append(node)
        self.head = node
        self.is_settled = False
        self._ghosts = None
        self.history.amend(self.run.build_state(node.number))

    def seek(
        self,
        node: Node,
        step: int | None = None,
        *,
        edit: Callable[[PaneGroup], None] | None = None,
        seconds: float = np.inf,
    ) -> None:
        """Make a step of a node the present; if an error is raised, nothing changes.

        A seek that is still in progress is abandoned.

        Parameters
        ----------
        node : Node
            A node of the document, or a new one that starts a run, which is then added to the document.
        step : int or None
            A step of the node; by default its last one.
        edit : callable or None
            Called with the run at that step, to change it before it becomes the present.
        seconds : float, s
            Maximum time for the call. If it is not enough, call `continue_seek` until the seek ends.

        Raises
        ------
        StartError, ParameterError, InputError
            If the state cannot be built. Controllers may raise any exception.
        """
        old = Present(self.head, self.run, self.history)
        if step is None:
            step = node.last_step
        self.pending_seek = Seek(build_present(self.document, old, node, step, edit), node, step)
        self.continue_seek(seconds)

    def finish_seek(self) -> None:
        """Complete the seek in progress, if there is one."""
        self.continue_seek(np.inf)

    def continue_seek(self, seconds: float) -> None:
        """Continue the seek in progress, if there is one, for about the given time, s."""
        pending = self.pending_seek
        if pending is None:
            return
        # If an exception is raised, the seek is no longer pending.
        self.pending_seek = None
        present = pending.advance(seconds)
        if present is None:
            self.pending_seek = pending
        else:
            self.replace_present(present)

    def replace_present(self, present: Present) -> None:
        """Replace the present, and display the new one; this is the last step of a seek."""
        if present.head.number == len(self.document.nodes):
            self.document.nodes.append(present.head)
        self.pending_seek = None
        self.head = present.head
        self.run = present.run
        self.history = present.history
        self.shown_index = None
        self.is_settled = False
        self.past_version += 1
        self._calls_at_shown_state = 0
        self._ghosts = None

    def cache_present(self) -> None:
        """Store the states, trails and curves of the present in the nodes of the document."""
        cache_present(self.document, Present(self.head, self.run, self.history))
