"""Panes that move on together: the spring of the hand that drags a robot, robots that come and go."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Self, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.conditions import TIME_TOLERANCE_S
from robocov.environment import Point
from robocov.errors import ParameterError
from robocov.simulation import check_joins
from robocov_app.viewer.session import changes
from robocov_app.viewer.session.changes import Drag, Fail, Join, Place, Release, Touch
from robocov_app.viewer.session.moments import Moment, PaneSetup
from robocov_app.viewer.session.pane import Continuation, Pane, begun, resumed
from robocov_app.viewer.session.scenario import Scenario

SPRING = 60.0  # stiffness, per kg, of the spring between a hand and the robot that it drags, 1/s²
STRONGEST = 80.0  # largest pull of the spring, per kg, m/s²
Happening: TypeAlias = tuple[int, str, str]  # step, kind and words, of robots that fail or join by themselves


class Lockstep:
    """Panes that begin as a scenario says; StartError, ParameterError when they cannot."""

    def __init__(self, scenario: Scenario) -> None:
        positions, conditions = scenario.positions(), scenario.conditions
        working = np.ones(len(positions), dtype=bool)
        if conditions is not None:
            conditions.check_team(len(positions))
            check_joins(scenario.environment, conditions)
            working = conditions.find_working(0.0, len(positions))
            conditions = conditions.drop_team_changes()
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
            # A controller that fails does so before any pane has moved.
            pane.simulation.observe_and_decide()
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
                held = self.hand is not None and self.panes[0].row(self.hand[0]) is not None
                if isinstance(change, Place) or not held:
                    self.hand = None
        setup, laws = self.panes[0].setup, tuple(pane.law for pane in self.panes)
        self.scenario = replace(self.scenario, environment=setup.environment, limits=setup.limits, laws=laws)

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

    def _describe_offset(self, number: int, requested: Point) -> str:
        """Return how far from the requested place a robot joined, in words; empty if it joined there."""
        pane = self.panes[0]
        row = pane.row(number)
        offset = 0.0 if row is None else float(np.hypot(*(pane.simulation.positions[row] - requested)))
        if offset < 5e-4:
            return ""
        return f" {offset:.2f} m from [{requested[0]:g}, {requested[1]:g}]"

    def _come_and_go(self) -> Iterator[Happening]:
        conditions = self.scenario.conditions
        if conditions is None or not conditions.has_team_changes:
            return
        begins, ends = conditions.compute_working_periods(self.scenario.robots)
        now, before = self.time + TIME_TOLERANCE_S, self.time - self.scenario.dt + TIME_TOLERANCE_S
        for number in (np.flatnonzero((begins > before) & (begins <= now)) + 1).tolist():
            if number not in self.panes[0].setup.there:
                place = next(join.place for join in conditions.joins if join.robot == number)
                x, y = self.scenario.positions()[number - 1].tolist() if place is None else place
                self.apply(Join(number, (x, y)))
                yield self.step, "robot", f"robot {number} joined{self._describe_offset(number, (x, y))}"
        for number in (np.flatnonzero((ends > before) & (ends <= now)) + 1).tolist():
            if number in self.panes[0].numbers and len(self.panes[0].numbers) > 1:
                self.apply(Fail(number))
                yield self.step, "failure", f"robot {number} failed"
