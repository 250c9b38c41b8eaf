"""The session's document: a tree of touches, from which every moment can be made again; undo goes back in it.

Physics is deterministic, so a scenario and the touches with their steps *are* the run. Nothing is ever taken
out of the tree: undo goes back to the node before, a touch in the past is one more child of its node.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

from robocov.errors import InputError, ParameterError
from robocov_app.viewer.session.changes import Change, Restart
from robocov_app.viewer.session.curves import Curve
from robocov_app.viewer.session.lockstep import Happening, Lockstep
from robocov_app.viewer.session.moments import Moment
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario

MOST_KEPT = 160  # moments of a node that are kept while another branch is shown


@dataclass(eq=False)
class Node:
    """One touch, and the time that passed after it until the next."""

    number: int
    parent: "Node | None"
    at: int  # step of the parent's time at which it was made
    kind: str  # as of an `Event`
    words: str
    changes: list[Change]
    end: int  # step up to which the run has come
    name: str = ""  # what people call the branch that ends here
    redo: "Node | None" = field(default=None, repr=False)  # the child that was left by undo
    # the rest is remembered while another branch is shown, can be made again, and is in no file
    kept: list[Moment] = field(default_factory=list, repr=False)
    curves: dict[tuple[int, str], Curve] = field(default_factory=lambda: defaultdict(Curve), repr=False)
    controllers: dict[int, ControllerChoice] = field(default_factory=dict, repr=False)  # both by pane
    happenings: set[Happening] = field(default_factory=set, repr=False)

    @property
    def scenario(self) -> Scenario | None:
        """The scenario that begins here; None where the run goes on."""
        change = self.changes[0]
        return change.scenario if isinstance(change, Restart) else None

    @property
    def begun(self) -> Scenario:
        assert self.scenario is not None
        return self.scenario

    @property
    def begin(self) -> int:
        return self.at if self.scenario is None else 0

    def carry_out(self, run: Lockstep) -> None:
        """Change a run that goes on from one step to the next as was done here; InputError names it."""
        for change in self.changes:
            if change.step == run.step and not isinstance(change, Restart):
                try:
                    run.apply(change)
                except InputError as error:
                    raise InputError(f"touches[{self.number}], “{self.words}”: {error}") from None


class Branch(NamedTuple):
    """A story that can be gone back to, up to a node after which nothing else was done; with its name."""

    node: Node
    end: int
    words: str

    def told(self, dt: float) -> str:
        words = [f"{self.end * dt:.1f} s"]
        for (pane, what), curve in sorted(self.node.curves.items()):
            if what == "distance" and len(curve):
                # of a file that was opened the controllers are known once it has been run
                law = self.node.controllers.get(pane)
                words.append(f"{law.label if law else ''} {curve.at(self.end * dt):.3f} m".lstrip())
        return " · ".join(words)


class Document:
    """Nodes in the order in which they came to be; the first begins with a scenario."""

    def __init__(self, scenario: Scenario | None = None, nodes: list[Node] | None = None) -> None:
        self.nodes = nodes or []
        if scenario is not None:
            self.add(None, 0, "begin", "begun", Restart(scenario))

    def add(self, parent: Node | None, at: int, kind: str, words: str, change: Change) -> Node:
        begin = 0 if isinstance(change, Restart) else at
        node = Node(len(self.nodes), parent, at, kind, words, [replace(change, step=begin)], begin)
        self.nodes.append(node)
        return node

    def path(self, node: Node) -> list[Node]:
        """Return the nodes from the beginning of its run, time 0, to a node."""
        found = [node]
        while (before := found[-1].parent) is not None and found[-1].scenario is None:
            found.append(before)
        return found[::-1]

    def limits(self, node: Node, step: int) -> dict[int, int]:
        """Return the last step of each node, by number, on the way to a step of one."""
        return {each.number: after.at for each, after in pairwise(self.path(node))} | {node.number: step}

    def branches(self) -> list[Branch]:
        nodes = self.nodes
        ends = [node for node in nodes if all(each.at < node.end for each in nodes if each.parent is node)]
        return [Branch(node, node.end, node.name or node.words) for node in ends]

    def branch(self, name: str) -> Branch:
        """Return the story of a name, or of a number from 1 on; ParameterError if there is none."""
        branches = self.branches()
        for k, each in enumerate(branches, 1):
            if name in (each.node.name, str(k)):
                return each
        known = ", ".join(f"{k} ({each.words})" for k, each in enumerate(branches, 1))
        raise ParameterError(f"branch: expected one of {known}, got {name!r}")


def replayed(
    document: Document, node: Node, step: int, run: Lockstep | None = None, since: Node | None = None
) -> Iterator[tuple[Lockstep, Node]]:
    """Simulate the way to a step of a node again: yield the run at each step, and the node of its time.

    It goes on from time 0, or from a step of the node `since`. Controllers and touches may raise anything.
    """
    path, limits = document.path(node), document.limits(node, step)
    run, rest = run or Lockstep(path[0].begun), path[0 if since is None else path.index(since) :]
    for here in rest:
        if here is not rest[0]:
            here.carry_out(run)
        while run.step < limits[here.number]:
            yield run, here
            here.happenings.update(run.advance())
            here.carry_out(run)
    yield run, node
