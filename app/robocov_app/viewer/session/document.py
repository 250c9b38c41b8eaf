"""The session's document: a tree of touches, from which every moment can be made again.

Physics is deterministic, so a scenario and the touches with their steps *are* the run. Nothing is ever taken
out of the tree: undo goes back to the node before, a touch in the past is one more child of its node.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

from robocov.errors import InputError, ParameterError
from robocov_app.viewer.session.changes import Change, Restart
from robocov_app.viewer.session.curves import Curve
from robocov_app.viewer.session.history import Moment
from robocov_app.viewer.session.lockstep import Happening, Lockstep
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario

MOST_KEPT = 160
"""Moments of a node that are kept while another branch is shown."""


@dataclass(eq=False)
class Node:
    """One touch, and the time that passed after it until the next.

    `at`: step of the parent's time at which it was made. `kind`, `words`: as of an `Event`. `end`: step up to
    which the run has come. `name`: what people call the branch that ends here. `redo`: the child that was
    left by undo. The rest is remembered while another branch is shown: moments, cost curves by pane and kind,
    controllers of the panes, who failed and joined by itself. It can be made again, and is in no file.
    """

    number: int
    parent: Node | None
    at: int
    kind: str
    words: str
    changes: list[Change]
    end: int
    name: str = ""
    redo: Node | None = field(default=None, repr=False)
    kept: list[Moment] = field(default_factory=list, repr=False)
    curves: dict[tuple[int, str], Curve] = field(default_factory=dict, repr=False)
    controllers: dict[int, ControllerChoice] = field(default_factory=dict, repr=False)
    happenings: set[Happening] = field(default_factory=set, repr=False)

    @property
    def scenario(self) -> Scenario | None:
        """The scenario that begins here; None where the run goes on."""
        change = self.changes[0]
        return change.scenario if isinstance(change, Restart) else None

    @property
    def begun(self) -> Scenario:
        """The scenario that begins here, where one does."""
        assert self.scenario is not None
        return self.scenario

    @property
    def begin(self) -> int:
        """The step at which it begins, in its own time."""
        return self.at if self.scenario is None else 0

    def carry_out(self, run: Lockstep) -> None:
        """Change a run that goes on from one step to the next as was done here; InputError names it."""
        for change in self.changes:
            if change.step == run.step and not isinstance(change, Restart):
                try:
                    run.apply(change)
                except InputError as error:
                    raise InputError(f"touches[{self.number}], “{self.words}”: {error}") from None

    def keep(self, moments: list[Moment]) -> None:
        """Remember some of the moments, the last among them."""
        stride = -(-len(moments) // MOST_KEPT)
        self.kept = moments[-1::-stride][::-1] if moments else []


class Branch(NamedTuple):
    """A story that can be gone back to, up to a node after which nothing else was done; with its name."""

    node: Node
    end: int
    words: str

    def told(self, dt: float) -> str:
        """Return when it ends and, where that is known, each pane's mean distance then."""
        words = [f"{self.end * dt:.1f} s"]
        for pane, what in sorted(self.node.curves):
            if what == "distance":
                value = self.node.curves[pane, what].at(self.end * dt)
                # of a file that was opened the controllers are known once it has been run
                law = self.node.controllers.get(pane)
                words.append(f"{law.label} {value:.3f} m" if law else f"{value:.3f} m")
        return " · ".join(words)


class Document:
    """Nodes in the order in which they came to be; the first begins with a scenario."""

    def __init__(self, scenario: Scenario | None = None, nodes: list[Node] | None = None) -> None:
        self.nodes = nodes or []
        if scenario is not None:
            self.add(None, 0, "begin", "begun", Restart(scenario))

    def add(self, parent: Node | None, at: int, kind: str, words: str, change: Change) -> Node:
        """Add a touch in a node's time."""
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
        path = self.path(node)
        return {each.number: after.at for each, after in pairwise(path)} | {node.number: step}

    def children(self, node: Node) -> Iterator[Node]:
        """Yield what was done next in a node's time, whether or not time began anew with it."""
        return (each for each in self.nodes if each.parent is node)

    def branches(self) -> list[Branch]:
        """Return all stories, the newest last."""
        return [
            Branch(node, node.end, node.name or node.words)
            for node in self.nodes
            if node.end > max((child.at for child in self.children(node)), default=-1)
        ]

    def branch(self, name: str) -> Branch:
        """Return the story of a name, or of a number from 1 on; ParameterError if there is none."""
        branches = self.branches()
        for k, each in enumerate(branches, 1):
            if name in (each.node.name, str(k)):
                return each
        known = ", ".join(f"{k} ({each.words})" for k, each in enumerate(branches, 1))
        raise ParameterError(f"branch: {name!r}, but one of {known} was wanted")


def replayed(
    document: Document, node: Node, step: int, run: Lockstep | None = None, since: Node | None = None
) -> Iterator[tuple[Lockstep, Node]]:
    """Simulate the way to a step of a node again: yield the run at each step, and the node of its time.

    It goes on from time 0, or from a step of the node `since`. Controllers and touches may raise anything.
    """
    path, limits = document.path(node), document.limits(node, step)
    run, at = run or Lockstep(path[0].begun), 0 if since is None else path.index(since)
    while True:
        while path[at] is not node and run.step >= limits[path[at].number]:
            at += 1
            path[at].carry_out(run)
        yield run, path[at]
        if path[at] is node and run.step >= step:
            return
        path[at].happenings.update(run.advance())
        path[at].carry_out(run)
