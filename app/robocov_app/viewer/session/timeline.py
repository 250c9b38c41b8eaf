"""The time line: all panes in lockstep, and their common past, which can be looked at and gone on from."""

from __future__ import annotations

from collections import deque
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import RobocovError
from robocov.metrics import SETTLED_DISTANCE, SETTLED_WINDOW
from robocov_app.viewer.session.clock import Clock
from robocov_app.viewer.session.curves import Event, Ghost
from robocov_app.viewer.session.history import Circumstances, History, Moment
from robocov_app.viewer.session.pane import Lane, resumed
from robocov_app.viewer.session.past import Past
from robocov_app.viewer.session.trail import starts_of, trail_of
from robocov_app.viewer.session.undo import Undo

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from robocov.arrays import Array
    from robocov.environment import Environment
    from robocov.observation import Snapshot
    from robocov_app.viewer.session.pane import Wanted
    from robocov_app.viewer.session.scenario import Scenario
    from robocov_app.viewer.session.trail import Trail

SPRING = 60.0
"""Stiffness, per kg, of the spring between a hand and the robot that it drags, 1/s²."""

STRONGEST = 80.0
"""Largest pull of the spring, per kg, m/s²."""

MOST_GHOSTS = 8
"""Branches whose curves are kept."""

MOST_EVENTS = 400
"""Events that are kept."""

_SLIDE = 1.0
"""Seconds within which changes of the same value are one event, as of a slider that is dragged."""


class Timeline:
    """A run of one or several lanes, with its past.

    What touches it goes on from the moment that is looked at.

    Parameters
    ----------
    scenario : Scenario

    Raises
    ------
    StartError, ParameterError
        When the scenario cannot be begun.

    Attributes
    ----------
    scenario : Scenario
        What the run began with; controllers, gains, limits and the map as they were last chosen.
    lanes : list of Lane
    playing : bool
    clock : Clock
    stop_when_settled : bool
    settled : bool
        Whether no robot has got anywhere for a while.
    hand : (number, (x, y) m) or None
        The robot that is dragged, and where to.
    undo : Undo
    history : History
    ghosts : deque of Ghost
    events : deque of Event
    """

    def __init__(self, scenario: Scenario) -> None:
        self.clock = Clock(scenario.dt)
        self.playing = True
        self.stop_when_settled = False
        self.hand: tuple[int, tuple[float, float]] | None = None
        # what is undone is of the present
        self.undo = Undo(self._to_present)
        self.serial = 0
        """Grows when what is known of times so far does not hold any more."""
        self._past = Past()
        self.scenario, self.lanes = scenario, list[Lane]()
        self._begin(scenario)

    def _begin(self, scenario: Scenario) -> None:
        """Begin anew; when that fails, nothing has changed."""
        positions = scenario.positions()
        conditions, moving = scenario.conditions, None if scenario.given is None else scenario.moving
        working = np.ones(len(positions), dtype=bool)
        if conditions is not None:
            conditions.check_team(len(positions))
            working = conditions.working(0.0, len(positions))
            conditions = conditions.of_robots_that_stay()
        numbers = tuple((np.flatnonzero(working) + 1).tolist())
        lanes = [
            Lane(
                pane,
                Circumstances(scenario.environment, law, scenario.limits, numbers, {}, conditions),
                positions[working],
                scenario.dt,
                None if moving is None else moving[working],
            )
            for pane, law in enumerate(scenario.laws)
        ]
        if self.lanes and scenario.environment is self.scenario.environment:
            self.undo.keep_map()
        else:
            self.undo.clear()
        self.scenario, self.lanes = scenario, lanes
        self.clock.dt = self._past.dt = scenario.dt
        self.history = History(scenario.dt)
        self.ghosts: deque[Ghost] = deque(maxlen=MOST_GHOSTS)
        self.events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._step = 0
        self.serial += 1
        self._cursor: int | None = None
        self._waited = 0
        self._rebuilt: dict[int, tuple[object, Trail]] = {}
        self.hand = None
        self.settled = False
        self._remember()

    def recall(self, lanes: list[Lane], history: History) -> None:
        """Take over a past that was recorded, and look at its beginning; the lanes are at its end."""
        self.lanes, self.history = lanes, history
        self._step = history.last.step
        self.serial += 1
        self._cursor = 0 if len(history) > 1 else None
        for lane in lanes:
            lane.trail = trail_of(history, lane.number, len(history) - 1)

    # what there is

    @property
    def environment(self) -> Environment:
        """The map as it is now, or was at the moment that is looked at."""
        return self.circumstances(self.lanes[0]).environment

    @property
    def time(self) -> float:
        """Time of the moment that is looked at, s."""
        return self.history.time(self._cursor) if self._cursor is not None else self.end

    @property
    def end(self) -> float:
        """Time up to which the run has come, s."""
        return self._step * self.scenario.dt

    @property
    def live(self) -> bool:
        """Whether the present is looked at, not the past."""
        return self._cursor is None

    @property
    def numbers(self) -> tuple[int, ...]:
        """What people call the robots that work, in the first pane."""
        return self.circumstances(self.lanes[0]).numbers

    def circumstances(self, lane: Lane) -> Circumstances:
        """Return what holds for a lane at the moment that is looked at."""
        if self._cursor is None:
            return lane.circumstances
        return self.history[self._cursor].states[lane.number].circumstances

    def snapshot(self, lane: Lane) -> Snapshot:
        """Return the moment that is looked at; a controller that fails on it has decided nothing."""
        if self._cursor is None:
            try:
                return lane.simulation.snapshot
            except RobocovError:
                return self._past.snapshot(self.history.last.states[lane.number], self.time)
        return self._past.snapshot(self.history[self._cursor].states[lane.number], self.time)

    def positions(self, lane: Lane) -> Array:
        """Return where the robots are at the moment that is looked at, (n, 2) m."""
        if self._cursor is None:
            return lane.simulation.positions
        return self.history[self._cursor].states[lane.number].positions

    def trail(self, lane: Lane) -> tuple[Array, Array]:
        """Return where the robots went up to the moment that is looked at: (k, n, 2) m and (k,) s."""
        if self._cursor is None or self.circumstances(lane).numbers == lane.numbers:
            return lane.trail.until(self.time)
        key = self._cursor, self.serial
        kept, trail = self._rebuilt.get(lane.number, (None, lane.trail))
        if kept != key:
            trail = trail_of(self.history, lane.number, self._cursor)
            self._rebuilt[lane.number] = key, trail
        return trail.positions, trail.time

    # time

    def advance(self, seconds: float) -> int:
        """Let so many seconds pass on the clock; return how many steps were made or shown."""
        if not self.playing:
            return 0
        return self.clock.advance(seconds, self._play_on)

    def _play_on(self) -> bool:
        """Make one step, or show the next moment of the past; say whether to go on."""
        if self._cursor is not None:
            self._pass_by()
            return True
        try:
            self._advance_all()
        except RobocovError:
            self.playing = False
            raise
        if self.stop_when_settled and self.settled:
            self.playing = False
            return False
        return True

    def step(self) -> None:
        """Make a single step, or show the next moment of the past; it pauses what is playing."""
        self.playing = False
        if self._cursor is not None:
            self._show_next()
        else:
            self._advance_all()

    def _pass_by(self) -> None:
        """Let one step of the past go by: where it was thinned, moments stay for as many as are missing."""
        assert self._cursor is not None
        steps = self.history.steps
        self._waited += 1
        if self._waited >= steps[self._cursor + 1] - steps[self._cursor]:
            self._show_next()

    def _show_next(self) -> None:
        assert self._cursor is not None
        self._waited = 0
        self._cursor += 1
        if self._cursor >= len(self.history) - 1:
            self._cursor = None

    def _advance_all(self) -> None:
        for lane in self.lanes:
            # a controller that fails does so before any lane has moved on
            lane.decide()
        for lane in self.lanes:
            lane.step(self._pushes(lane))
        self._step += 1
        self._remember()
        self._come_and_go()
        if self._step % 12 == 0:
            self.settled = self._has_settled()

    def _come_and_go(self) -> None:
        """Let robots fail and join whose time has come."""

    def _remember(self) -> None:
        self.history.add(Moment(self._step, {lane.number: lane.state() for lane in self.lanes}))

    def _pushes(self, lane: Lane) -> Array | None:
        """Return the pull of the hand on the robots of a lane, N."""
        row = lane.row(self.hand[0]) if self.hand is not None else None
        if row is None or self.hand is None:
            return None
        simulation = lane.simulation
        pull = SPRING * (np.array(self.hand[1]) - simulation.positions[row])
        pull -= 2.0 * np.sqrt(SPRING) * simulation.velocities[row]
        size = float(np.hypot(*pull))
        pushes = np.zeros_like(simulation.positions)
        pushes[row] = pull * (simulation.team.mass[row] * min(1.0, STRONGEST / max(size, 1e-12)))
        return pushes

    def _has_settled(self) -> bool:
        """Whether no robot of any pane got anywhere for a while, as `metrics.settled_at` says it."""
        if self.hand is not None or self.end < SETTLED_WINDOW:
            return False
        before = self.history[self.history.at(self.end - SETTLED_WINDOW)]
        for lane in self.lanes:
            state = before.states.get(lane.number)
            if state is None or state.circumstances is not lane.circumstances:
                return False
            moved = np.hypot(*(lane.simulation.positions - state.positions).T)
            if len(moved) and float(moved.max()) >= SETTLED_DISTANCE:
                return False
        return True

    def recent(self, lane: Lane, number: int) -> Array:
        """Return where a robot was during the last seconds before the moment looked at, (k, 2) m."""
        last = self._cursor if self._cursor is not None else len(self.history) - 1
        first = self.history.at(self.time - SETTLED_WINDOW)
        places = []
        for k in range(first, last + 1, max(1, (last - first) // 30)):
            state = self.history[k].states.get(lane.number)
            if state is not None and number in state.circumstances.numbers:
                places.append(state.positions[state.circumstances.numbers.index(number)])
        return np.array(places).reshape(-1, 2)

    def look_at(self, time: float) -> None:
        """Look at the last moment not after `time`; at the end, at the present."""
        cursor = self.history.at(time)
        self.release()
        self._cursor, self._waited = (cursor if cursor < len(self.history) - 1 else None), 0

    def look_by(self, moments: int) -> None:
        """Look so many moments further on, or back."""
        now = self._cursor if self._cursor is not None else len(self.history) - 1
        self.look_at(self.history.time(min(max(now + moments, 0), len(self.history) - 1)))

    def _to_present(self) -> None:
        self._cursor, self._waited = None, 0

    def release(self) -> None:
        """Let go of a robot that is dragged; one that was swung flies on."""
        if self.hand is not None:
            self.events.append(Event(self.end, "hand", f"robot {self.hand[0]} was dragged"))
        self.hand = None

    def branch(self) -> bool:
        """Go on from the moment looked at; what came after it stays as ghost curves.

        Return whether there was anything to leave: at the present there is not.

        Raises
        ------
        StartError, ParameterError
            When that cannot be; nothing has changed then.
        """
        if self._cursor is None:
            return False
        k = self._cursor
        moment, time = self.history[k], self.history.time(k)
        simulations = [resumed(moment.states[lane.number], self.scenario.dt, time) for lane in self.lanes]
        # from here on nothing goes wrong; what `_touching` may have to put back is replaced, not altered
        ghosts = list(self.ghosts)
        for lane, simulation in zip(self.lanes, simulations, strict=True):
            starts, trail = starts_of(self.history, lane.number, k), trail_of(self.history, lane.number, k)
            ghosts += lane.leave(time)
            lane.resume(moment.states[lane.number], simulation, starts, trail)
        self.ghosts = deque(ghosts, maxlen=MOST_GHOSTS)
        self.history = self.history.until(k)
        self._step = moment.step
        self._to_present()
        self.serial += 1
        self.events = deque((event for event in self.events if event.time <= time), maxlen=MOST_EVENTS)
        self.undo.clear()  # what can be undone was done in the future
        self.scenario = replace(
            self.scenario,
            environment=self.environment,
            laws=tuple(lane.law for lane in self.lanes),
            limits=self.lanes[0].circumstances.limits,
        )
        self.settled = False
        return True

    # how it is touched

    @contextmanager
    def _touching(self) -> Iterator[None]:
        """Go on from the moment that is looked at; if what is then tried cannot be, nothing has changed."""
        if self._cursor is None:
            yield
            return
        everything = [self, self.undo, *self.lanes]
        kept = [dict(vars(each)) for each in everything]
        try:
            self.branch()
            yield
        except BaseException:
            for each, state in zip(everything, kept, strict=True):
                vars(each).clear()
                vars(each).update(state)
            raise

    def _change_all(self, wanted: Callable[[Lane], Wanted]) -> None:
        """Let every lane go on as is wanted; if one cannot, none does."""
        changes = []
        for lane in self.lanes:
            want = wanted(lane)
            changes.append((lane, want.circumstances, lane.changed(want)))
        for lane, circumstances, simulation in changes:
            lane.take(circumstances, simulation)

    def _changed(self, kind: str, words: str) -> None:
        """Note what has been touched, and let the newest moment tell of it."""
        last = self.events[-1] if self.events else None
        if (
            last is not None
            and last.kind == kind
            and kind in ("law", "limits")
            and _subject(last.text) == _subject(words)
            and self.end - last.time < _SLIDE
        ):
            self.events.pop()
        self.events.append(Event(self.end, kind, words))
        self._amend()

    def _amend(self) -> None:
        self.settled = False
        self.history.amend(Moment(self._step, {lane.number: lane.state() for lane in self.lanes}))


def _subject(text: str) -> str:
    """Return what of an event's text is the same while a slider is dragged."""
    return text.partition(" = ")[0]
