"""The document of a session: a tree of edits from which every state can be recomputed.

The simulation is deterministic, so a scenario and the edits with their steps determine the run. Nothing is
ever removed from the tree: undo returns to the parent of a node, and an edit in the past adds another child
to a node.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple, Self

from robocov.errors import InputError, ParameterError
from robocov_app.viewer.session.editing.edits import RemovePane, Restart, SessionEdit, SetController
from robocov_app.viewer.session.pane_group import AutomaticEvent, PaneGroup
from robocov_app.viewer.session.past.curves import Curve, SessionEvent
from robocov_app.viewer.session.past.states import RunState
from robocov_app.viewer.session.past.trails import TrailSection
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario

if TYPE_CHECKING:
    from robocov_app.viewer.session.files.models import LessonModel

MAX_CACHED_STATES = 160
"""Maximum number of states that a node keeps while another branch is displayed."""


@dataclass(eq=False)
class Node:
    """A node of the tree: an edit, or several that belong together, and the time span until the next node.

    Attributes
    ----------
    number : int
        Index in the document.
    parent : Node or None
        The node whose time span contains the edit.
    branch_step : int
        Step at which the edit was made, in the time span of the parent.
    kind : str
        Kind of the edit, as in `SessionEvent`.
    description : str
        Description of the edit.
    edits : list of SessionEdit
        The edits in the order in which they were made.
    last_step : int
        Last step of the time span that has been simulated.
    name : str
        Name of the branch that ends at this node; empty if it has none.
    redo_child : Node or None
        The child from which the last undo returned to this node.
    cached_states : list of RunState
        States in the time span of the node. They are not saved in files, because they can be recomputed.
    curves : dict
        Cost curve for each pair of pane number and quantity, in the time span of the node.
    trails : dict
        Trajectories in the time span of the node, by pane number; they are not saved in files either.
    automatic_events : set of AutomaticEvent
        Failures and joins of robots that the conditions cause, in the time span of the node.
    """

    number: int
    parent: "Node | None"
    branch_step: int
    kind: str
    description: str
    edits: list[SessionEdit]
    last_step: int
    name: str = ""
    redo_child: "Node | None" = field(default=None, repr=False)
    cached_states: list[RunState] = field(default_factory=list, repr=False)
    curves: dict[tuple[int, str], Curve] = field(default_factory=lambda: defaultdict(Curve), repr=False)
    trails: dict[int, list[TrailSection]] = field(default_factory=dict, repr=False)
    automatic_events: set[AutomaticEvent] = field(default_factory=set, repr=False)

    @property
    def scenario(self) -> SessionScenario | None:
        """The scenario, if the edit restarts the run; None if the run of the parent continues."""
        edit = self.edits[0]
        if isinstance(edit, Restart):
            return edit.scenario
        return None

    def require_scenario(self) -> SessionScenario:
        """Return the scenario of a node that is the root of a run."""
        assert self.scenario is not None
        return self.scenario

    @property
    def first_step(self) -> int:
        """The first step in the time span of the node."""
        if self.scenario is None:
            return self.branch_step
        return 0

    def apply_edits(self, run: PaneGroup) -> None:
        """Apply those edits of the node that were made at the current step of a run.

        Raises
        ------
        InputError
            If an edit is not possible; the message names the node.
        """
        for edit in self.edits:
            if edit.step == run.step and not isinstance(edit, Restart):
                try:
                    run.apply(edit)
                except InputError as error:
                    location = f"edits[{self.number}], “{self.description}”"
                    raise InputError(f"{location}: {error}") from None


class Branch(NamedTuple):
    """A path through the tree; nothing was edited after its last step.

    Attributes
    ----------
    node : Node
        The last node of the path.
    last_step : int
        The last step of the branch.
    description : str
        Name of the branch, or description of its last edit.
    controllers : mapping of int to ControllerChoice
        Controllers at the end of the branch, by pane number.
    """

    node: Node
    last_step: int
    description: str
    controllers: Mapping[int, ControllerChoice]

    def describe_end(self, dt: float) -> str:
        """Describe the time and the mean distances at the end of the branch.

        Parameters
        ----------
        dt : float, s
            Control period.

        Returns
        -------
        str
        """
        time = self.last_step * dt
        parts = [f"{time:.1f} s"]
        for (pane, quantity), curve in sorted(self.node.curves.items()):
            if quantity != "distance" or not len(curve):
                continue
            if pane in self.controllers:
                parts.append(f"{self.controllers[pane].label} {curve.interpolate(time):.3f} m")
        return " · ".join(parts)


class SessionDocument:
    """The nodes of a session, in the order in which they were added. The first one starts a run.

    Parameters
    ----------
    nodes : list of Node
        The nodes.
    lesson : LessonModel or None
        The chapters, if the session is a lesson.

    Attributes
    ----------
    lesson : LessonModel or None
        The chapters, if the session is a lesson.
    revision : int
        Number of edits that were made since the document was opened.
    """

    def __init__(self, nodes: list[Node], lesson: "LessonModel | None" = None) -> None:
        self.nodes = nodes
        self.lesson = lesson
        self.revision = 0

    @classmethod
    def start(cls, scenario: SessionScenario) -> Self:
        """Build the document of a new session."""
        document = cls([])
        document.nodes.append(document.build_node(None, 0, "begin", "started", Restart(scenario)))
        return document

    def build_node(
        self, parent: Node | None, branch_step: int, kind: str, description: str, edit: SessionEdit
    ) -> Node:
        """Build the next node without adding it to the document.

        Parameters
        ----------
        parent : Node or None
            The node whose time span contains the edit.
        branch_step : int
            Step at which the edit is made.
        kind : str
            Kind of the edit, as in `SessionEvent`.
        description : str
            Description of the edit.
        edit : SessionEdit
            The edit.

        Returns
        -------
        Node
        """
        first_step = 0 if isinstance(edit, Restart) else branch_step
        edits = [replace(edit, step=first_step)]
        return Node(len(self.nodes), parent, branch_step, kind, description, edits, first_step)

    def get_path(self, node: Node) -> list[Node]:
        """Return the nodes on the path from the root of the run, at time 0, to a node."""
        path = [node]
        while path[-1].parent is not None and path[-1].scenario is None:
            path.append(path[-1].parent)
        return path[::-1]

    def get_last_steps(self, node: Node, step: int) -> dict[int, int]:
        """Return the last step of each node on the path to a step of a node, by the node's number."""
        last_steps = {before.number: after.branch_step for before, after in pairwise(self.get_path(node))}
        last_steps[node.number] = step
        return last_steps

    def list_branches(self) -> list[Branch]:
        """Return all branches, in the order of the nodes at their ends."""
        branches = []
        for node in self.nodes:
            # If a child starts at the last step of its parent, the branch continues with the child.
            children = [child for child in self.nodes if child.parent is node]
            if all(child.branch_step < node.last_step for child in children):
                controllers = self.find_controllers(node)
                branches.append(Branch(node, node.last_step, node.name or node.description, controllers))
        return branches

    def find_controllers(self, node: Node) -> dict[int, ControllerChoice]:
        """Return the controllers at the end of a node, by pane number."""
        path = self.get_path(node)
        controllers = dict(enumerate(path[0].require_scenario().controllers))
        for ancestor in path:
            for edit in ancestor.edits:
                if isinstance(edit, SetController):
                    controllers[edit.pane] = edit.controller
                elif isinstance(edit, RemovePane):
                    controllers.pop(edit.pane, None)
        return controllers

    def find_branch(self, name: str) -> Branch:
        """Return the branch with a given name or, if there is none, with this number, counted from 1.

        Raises
        ------
        ParameterError
            If there is no such branch.
        """
        branches = self.list_branches()
        for branch in branches:
            # The name of a branch is empty if it has none.
            if name and name == branch.node.name:
                return branch
        for number, branch in enumerate(branches, 1):
            if name == str(number):
                return branch
        known = ", ".join(f"{number} ({branch.description})" for number, branch in enumerate(branches, 1))
        raise ParameterError(f"branch: expected one of {known}, got {name!r}")

    def list_events(self, node: Node, step: int, dt: float) -> list[SessionEvent]:
        """Return the events on the path to a step of a node, in chronological order.

        Parameters
        ----------
        node : Node
            The last node of the path.
        step : int
            The last step of the path, in the time span of the node.
        dt : float, s
            Control period.

        Returns
        -------
        list of SessionEvent
        """
        last_steps = self.get_last_steps(node, step)
        events = []
        for ancestor in self.get_path(node):
            last_step = last_steps[ancestor.number]
            # A node with a scenario starts the run, which is not an event in it.
            if ancestor.scenario is None and ancestor.branch_step <= last_step:
                time = ancestor.branch_step * dt
                events.append(SessionEvent(time, ancestor.kind, ancestor.description))
            # Sets have no order: without sorting, that of simultaneous events would be random.
            events += [
                SessionEvent(event.step * dt, event.kind, event.text)
                for event in sorted(ancestor.automatic_events)
                if event.step <= last_step
            ]
        return sorted(events, key=attrgetter("time"))


def replay(
    document: SessionDocument,
    node: Node,
    step: int,
    run: PaneGroup | None = None,
    start_node: Node | None = None,
) -> Iterator[tuple[PaneGroup, Node]]:
    """Simulate the path to a step of a node again, with all its edits.

    Parameters
    ----------
    document : SessionDocument
    node : Node
        The last node of the path.
    step : int
        The last step of the path, in the time span of the node.
    run : PaneGroup or None
        A run at some step of the node `start_node`, with which to start; by default a new run at time 0.
    start_node : Node or None
        The node whose time span contains the current step of `run`.

    Yields
    ------
    run : PaneGroup
        The run at each step, before it advances.
    node : Node
        The node whose time span contains that step.

    Raises
    ------
    InputError
        If an edit is not possible. Controllers may raise any exception.
    """
    path = document.get_path(node)
    last_steps = document.get_last_steps(node, step)
    if run is None:
        run = PaneGroup(path[0].require_scenario())
    first = 0 if start_node is None else path.index(start_node)
    for index, current in enumerate(path[first:]):
        if index > 0:
            current.apply_edits(run)
        while run.step < last_steps[current.number]:
            yield run, current
            current.automatic_events.update(run.advance())
            current.apply_edits(run)
    yield run, node
