"""The session's document: a tree of touches, from which panes in lockstep make every moment again.

Physics is deterministic, so a scenario and the touches with their steps *are* the run. Nothing is ever taken
out of the tree: undo goes back to the node before, a touch in the past is one more child of its node.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple, Self, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.conditions import SOON
from robocov.environment import Point
from robocov.errors import InputError, ParameterError
from robocov_app.viewer.session import changes
from robocov_app.viewer.session.changes import Change, Drag, Fail, Join, Place, Release, Restart, Touch
from robocov_app.viewer.session.history import Curve, Moment, PaneSetup
from robocov_app.viewer.session.pane import Continuation, Pane, begun, resumed
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario

SPRING = 60.0  # stiffness, per kg, of the spring between a hand and the robot that it drags, 1/s²
STRONGEST = 80.0  # largest pull of the spring, per kg, m/s²
MOST_KEPT = 160  # moments of a node that are kept while another branch is shown
Happening: TypeAlias = tuple[int, str, str]  # step, kind and words, of robots that fail or join by themselves


class Lockstep:
    """Panes that begin as a scenario says; StartError, ParameterError when they cannot."""

    def __init__(self, scenario: Scenario) -> None:
        positions, conditions = scenario.positions(), scenario.conditions
        working = np.ones(len(positions), dtype=bool)
        if conditions is not None:
            conditions.check_team(len(positions))
            working = conditions.working(0.0, len(positions))
            conditions = conditions.of_robots_that_stay()
        numbers = tuple((np.flatnonzero(working) + 1).tolist())
        moving = None if scenario.given is None or scenario.moving is None else scenario.moving[working]
        self.scenario = scenario  # with controllers, gains, limits and map as they were last chosen
        self.step = 0
        self.hand: tuple[int, Point] | None = None  # the robot that is dragged, and where to, m
        self.panes = []
        for number, law in enumerate(scenario.laws):
            setup = PaneSetup(scenario.environment, law, scenario.limits, numbers, {}, conditions)
            self.panes.append(Pane(number, setup, begun(setup, positions[working], scenario.dt, moving)))

    @classmethod
    def resumed(cls, moment: Moment) -> Self:
        run = cls.__new__(cls)
        run.scenario, run.step, run.hand = moment.scenario, moment.step, moment.hand
        again = {k: resumed(state, run.scenario.dt, run.step) for k, state in moment.states.items()}
        run.panes = [Pane(k, state.setup, again[k]) for k, state in moment.states.items()]
        return run

    def moment(self, node: int = 0) -> Moment:
        states = {pane.number: pane.state() for pane in self.panes}
        return Moment(self.step, states, self.scenario, self.hand, node)

    @property
    def time(self) -> float:
        return self.step * self.scenario.dt

    def advance(self) -> list[Happening]:
        for pane in self.panes:
            _ = pane.simulation.snapshot  # a controller that fails does so before any pane has moved on
        for pane in self.panes:
            pane.step(self._pull(pane))
        self.step += 1
        return list(self._come_and_go())

    def apply(self, change: Touch) -> None:
        """Carry a change out, or nothing of it; StartError, ParameterError, MapError say why it cannot be."""
        match change:
            case Drag() | Release():
                self.hand = (change.robot, change.to) if isinstance(change, Drag) else None
                return
            case changes.RemovePane(number):
                if len(self.panes) == 1:
                    raise ParameterError("the last pane stays")
                self.panes = [pane for pane in self.panes if pane.number != number]
            case changes.EditObstacles() | changes.Paint() | changes.SetDensity():
                environment = change.on(self.scenario.environment)
                self._change_all(lambda pane: Continuation(replace(pane.setup, environment=environment)))
            case _:
                self._change_all(change.of)
                if self.hand is not None and (isinstance(change, Place) or not self._works(self.hand[0])):
                    self.hand = None
        setup, laws = self.panes[0].setup, tuple(pane.law for pane in self.panes)
        self.scenario = replace(self.scenario, environment=setup.environment, limits=setup.limits, laws=laws)

    def _works(self, robot: int) -> bool:
        return robot in self.panes[0].numbers

    def _change_all(self, wanted: Callable[[Pane], Continuation]) -> None:
        """Let every pane go on as is wanted; if one cannot, none does."""
        wants = [(pane, wanted(pane)) for pane in self.panes]
        wants = [(pane, w) for pane, w in wants if w.positions is not None or w.setup is not pane.setup]
        changed = [(pane, want.setup, pane.changed(want)) for pane, want in wants]
        for pane, setup, simulation in changed:
            pane.take(setup, simulation)

    def _pull(self, pane: Pane) -> Array | None:
        if self.hand is None or (row := pane.row(self.hand[0])) is None:
            return None
        simulation, pulls = pane.simulation, np.zeros_like(pane.simulation.positions)
        pull = SPRING * (np.array(self.hand[1]) - simulation.positions[row])
        pull -= 2.0 * np.sqrt(SPRING) * simulation.velocities[row]
        size = float(np.hypot(*pull))
        pulls[row] = pull * (simulation.team.mass[row] * min(1.0, STRONGEST / max(size, 1e-12)))
        return pulls

    def _come_and_go(self) -> Iterator[Happening]:
        conditions = self.scenario.conditions
        if conditions is None or not conditions.team_changes:
            return
        begins, ends = conditions.lives(self.scenario.robots)
        now, before = self.time + SOON, self.time - self.scenario.dt + SOON
        for number in (np.flatnonzero((begins > before) & (begins <= now)) + 1).tolist():
            if number not in self.panes[0].setup.there:
                place = next(join.place for join in conditions.joins if join.robot == number)
                x, y = self.scenario.positions()[number - 1].tolist() if place is None else place
                self.apply(Join(number, (x, y)))
                yield self.step, "robot", f"robot {number} joined"
        for number in (np.flatnonzero((ends > before) & (ends <= now)) + 1).tolist():
            if self._works(number) and len(self.panes[0].numbers) > 1:
                self.apply(Fail(number))
                yield self.step, "failure", f"robot {number} failed"


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
        raise ParameterError(f"branch: {name!r}, but one of {known} was wanted")


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
