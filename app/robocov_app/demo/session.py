"""The session: all panes in lockstep, their common past, and every way to touch them. Knows no pygame."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError, RobocovError, StartError
from robocov.metrics import SETTLED_DISTANCE, SETTLED_WINDOW
from robocov.observation import Decision, Snapshot
from robocov.relocation import relocated
from robocov_app.demo.clock import Clock, speed_words
from robocov_app.demo.curves import Event, Ghost
from robocov_app.demo.history import Circumstances, History, Moment
from robocov_app.demo.lane import Lane, with_failed
from robocov_app.demo.past import Past
from robocov_app.demo.scenario import MOST_PANES, MOST_ROBOTS, Law, Limits, Scenario
from robocov_app.demo.trail import Trail
from robocov_app.demo.undo import Edit, Undo

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from robocov.arrays import Array
    from robocov.environment import Environment

SPRING = 60.0
"""Stiffness, per kg, of the spring between a hand and the robot that it drags, 1/s²."""

STRONGEST = 80.0
"""Largest pull of the spring, per kg, m/s²."""

MOST_GHOSTS = 8
"""Branches whose curves are kept."""

MOST_EVENTS = 400
"""Events that are kept."""


class Session:
    """What is going on in the window.

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
        What `restart` goes back to; controllers, gains and the map as they were last chosen.
    lanes : list of Lane
    playing : bool
    clock : Clock
    stop_when_settled : bool
    hand : (number, (x, y) m) or None
        The robot that is dragged, and where to.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.clock = Clock(scenario.dt)
        self.playing = True
        self.stop_when_settled = False
        self.hand: tuple[int, tuple[float, float]] | None = None
        self.undo = Undo()
        self.serial = 0
        """Grows when what is known of times so far does not hold any more."""
        self._past = Past()
        self._begin(scenario)

    def _begin(self, scenario: Scenario) -> None:
        """Begin anew; when that fails, nothing has changed."""
        positions = scenario.positions()
        numbers = tuple(range(1, len(positions) + 1))
        lanes = [
            Lane(
                pane,
                Circumstances(scenario.environment, law, scenario.limits, numbers, {}),
                positions,
                scenario.dt,
            )
            for pane, law in enumerate(scenario.laws)
        ]
        self.scenario, self.lanes = scenario, lanes
        self._next_pane = len(lanes)
        self.history = History(scenario.dt)
        self.ghosts: deque[Ghost] = deque(maxlen=MOST_GHOSTS)
        self.events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self.undo.clear()
        self._step = 0
        self.serial += 1
        self._cursor: int | None = None
        self.hand = None
        self.settled = False
        self._remember()

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
                seen = lane.simulation.observe()
                return Snapshot(seen, Decision(np.zeros_like(seen.positions)))
        return self._past.snapshot(self.history[self._cursor].states[lane.number], self.time)

    def positions(self, lane: Lane) -> Array:
        """Return where the robots are at the moment that is looked at, (n, 2) m."""
        if self._cursor is None:
            return lane.simulation.positions
        return self.history[self._cursor].states[lane.number].positions

    def trail(self, lane: Lane) -> tuple[Array, Array]:
        """Return where the robots went up to the moment that is looked at: (k, n, 2) m and (k,) s."""
        if self._cursor is not None and self.circumstances(lane).numbers != lane.numbers:
            return self._trail_of(lane, self._cursor)
        return lane.trail.until(self.time)

    def _trail_of(self, lane: Lane, last: int) -> tuple[Array, Array]:
        """Return the trail of the robots that worked in the past."""
        trail = self._rebuilt_trail(lane, last)
        return trail.positions, trail.time

    def _rebuilt_trail(self, lane: Lane, last: int) -> Trail:
        numbers = self.history[last].states[lane.number].circumstances.numbers
        trail = Trail(len(numbers))
        for k in range(last + 1):
            moment = self.history[k]
            state = moment.states.get(lane.number)
            if state is None:
                continue
            places = np.full((len(numbers), 2), np.nan)
            row_of = {number: row for row, number in enumerate(state.circumstances.numbers)}
            for row, number in enumerate(numbers):
                if number in row_of:
                    places[row] = state.positions[row_of[number]]
            trail.add(self.history.time(k), places)
        return trail

    # time

    def advance(self, seconds: float) -> int:
        """Let so many seconds pass on the clock; return how many steps were made or shown."""
        if not self.playing:
            return 0
        return self.clock.advance(seconds, self._play_on)

    def _play_on(self) -> bool:
        """Make one step, or show the next moment of the past; say whether to go on."""
        if self._cursor is not None:
            self._forward()
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
            self._forward()
        else:
            self._advance_all()

    def _forward(self) -> None:
        assert self._cursor is not None
        self._cursor += 1
        if self._cursor >= len(self.history) - 1:
            self._cursor = None

    def _advance_all(self) -> None:
        for lane in self.lanes:
            lane.step(self._pushes(lane))
        self._step += 1
        self._remember()
        if self._step % 12 == 0:
            self.settled = self._has_settled()

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
        while cursor < len(self.history) - 1 and not self._shows_all(cursor):
            cursor += 1
        self.hand = None
        self._cursor = cursor if cursor < len(self.history) - 1 else None

    def look_by(self, moments: int) -> None:
        """Look so many moments further on, or back."""
        now = self._cursor if self._cursor is not None else len(self.history) - 1
        self.look_at(self.history.time(min(max(now + moments, 0), len(self.history) - 1)))

    def _shows_all(self, k: int) -> bool:
        return all(lane.number in self.history[k].states for lane in self.lanes)

    def branch(self) -> bool:
        """Go on from the moment looked at; what came after it stays as ghost curves.

        Return whether there was anything to leave: at the present there is not.
        """
        if self._cursor is None:
            return False
        k = self._cursor
        moment, time = self.history[k], self.history.time(k)
        first = self.history[0]
        for lane in self.lanes:
            state = moment.states[lane.number]
            trail = self._rebuilt_trail(lane, k)
            rest = lane.curve.cut(time)
            if len(rest) > 1:
                self.ghosts.append(Ghost(lane.law.name, branch_words(lane.law), rest.time, rest.value))
            starts = np.array(state.positions)
            began = first.states.get(lane.number)
            for row, number in enumerate(state.circumstances.numbers):
                if began is not None and number in began.circumstances.numbers:
                    starts[row] = began.positions[began.circumstances.numbers.index(number)]
            lane.resume(state, time, starts)
            lane.trail = trail
        self.history.cut(k)
        self._step, self._cursor = moment.step, None
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

    # scenario

    def restart(self, **changes: object) -> None:
        """Begin anew, with changes of the scenario if there are any.

        Raises
        ------
        StartError, ParameterError
            When that cannot be; the run then goes on as it is.
        """
        scenario = self.scenario
        if "environment" in changes or "robots" in changes or "start" in changes or "seed" in changes:
            changes.setdefault("given", None)
        if "environment" in changes:
            changes.setdefault("start", None)
        else:
            changes["environment"] = self.environment
            if scenario.start is not None and scenario.start not in {*self.environment.starts, "uniform"}:
                changes.setdefault("start", None)
        self._begin(replace(scenario, **changes))  # type: ignore[arg-type]

    def set_law(self, lane: Lane, law: Law) -> None:
        """Let another controller, or other gains, take over in a lane.

        Raises
        ------
        ParameterError
            When the controller cannot be made.
        """
        if law == self.circumstances(lane).law:
            return
        law.made()
        self.branch()
        switched = law.name != lane.law.name
        words = f"{law.label} takes over" if switched else f"{law.label}: {gain_words(lane.law, law)}"
        lane.change(replace(lane.circumstances, law=law))
        self.scenario = replace(self.scenario, laws=tuple(each.law for each in self.lanes))
        self._changed("law", words)

    def set_limits(self, limits: Limits) -> None:
        """Change what all robots are and can do.

        Raises
        ------
        ParameterError, StartError
            When a value is out of range, or the robots do not fit.
        """
        if limits == self.lanes[0].circumstances.limits:
            return
        limits.team(1)
        self.branch()
        self._change_all(lambda lane: replace(lane.circumstances, limits=limits))
        self.scenario = replace(self.scenario, limits=limits)
        self._changed("limits", "limits changed")

    def add_pane(self, law: Law) -> None:
        """Compare with one controller more; all begin anew, from the same starts.

        Raises
        ------
        ParameterError
            When there are as many as there is room for.
        """
        if len(self.lanes) >= MOST_PANES:
            raise ParameterError(f"there is room for {MOST_PANES} controllers side by side")
        self.restart(laws=(*self.scenario.laws, law))

    def remove_pane(self, lane: Lane) -> None:
        """Leave a lane out from now on; the others go on.

        Raises
        ------
        ParameterError
            When it is the only one.
        """
        if len(self.lanes) == 1:
            raise ParameterError("the last pane stays")
        self.lanes.remove(lane)
        self.scenario = replace(self.scenario, laws=tuple(each.law for each in self.lanes))

    # robots

    def grab(self, number: int, point: tuple[float, float]) -> None:
        """Drag a robot towards a point: by a spring while the run goes on, at once while it is paused."""
        self.branch()
        if self.playing:
            self.hand = number, point
            self.settled = False
        else:
            self.place(number, point)

    def release(self) -> None:
        """Let go; a robot that was swung flies on."""
        if self.hand is not None:
            self.events.append(Event(self.end, "hand", f"robot {self.hand[0]} was dragged"))
        self.hand = None

    def place(self, number: int, point: tuple[float, float]) -> None:
        """Put a robot, or one that failed, at a point or as near as it fits."""
        self.branch()

        def placed(lane: Lane) -> None:
            circumstances = lane.circumstances
            row = lane.row(number)
            if row is None:
                return
            positions = np.array(lane.simulation.positions)
            velocities = np.array(lane.simulation.velocities)
            positions[row] = _nearest_free(circumstances, positions, row, point)
            velocities[row] = 0.0
            lane.change(circumstances, positions, velocities)

        self._all_or_none(placed)
        self._amend()

    def add_robot(self, point: tuple[float, float], number: int | None = None) -> int:
        """Let one robot more join at a point, or as near as it fits; return its number.

        Raises
        ------
        StartError
            When there is no room.
        ParameterError
            When there are as many as there may be.
        """
        self.branch()
        present = {*self.lanes[0].numbers, *self.lanes[0].circumstances.failed}
        if len(present) >= MOST_ROBOTS:
            raise ParameterError(f"there are {MOST_ROBOTS} robots already")
        new = max(present, default=0) + 1 if number is None else number

        def join(lane: Lane) -> None:
            circumstances = lane.circumstances
            after = replace(circumstances, numbers=(*circumstances.numbers, new))
            positions = np.vstack([lane.simulation.positions, point])
            positions[-1] = _nearest_free(after, positions, len(positions) - 1, point)
            lane.change(after, positions, np.vstack([lane.simulation.velocities, (0.0, 0.0)]))

        self._all_or_none(join)
        self._changed("robot", f"robot {new} joined")
        self.undo.add(Edit(f"robot {new}", lambda: self._leave(new), lambda: self._rejoin(point, new)))
        return new

    def _rejoin(self, point: tuple[float, float], number: int) -> None:
        self.undo.hold(lambda: self.add_robot(point, number))

    def remove_robot(self, number: int) -> None:
        """Take a robot out.

        Raises
        ------
        ParameterError
            When it is the last one that works.
        """
        place = self._place_of(number)
        failed = number in self.lanes[0].circumstances.failed
        self.branch()
        self._leave(number)

        def back() -> None:
            self.undo.hold(lambda: self.add_robot(place, number))
            if failed:
                self.undo.hold(lambda: self.fail_robot(number))

        self.undo.add(Edit(f"robot {number} taken out", back, lambda: self._leave(number)))

    def _leave(self, number: int) -> None:
        self._need_another(number)
        self._without(number, lambda circumstances, place: circumstances)
        self._changed("robot", f"robot {number} taken out")

    def fail_robot(self, number: int) -> None:
        """Let a robot fail: it stays where it is, stops, and is not heard any more.

        Raises
        ------
        ParameterError
            When it is the last one that works.
        """
        self._need_another(number)
        self.branch()
        self._without(
            number,
            lambda circumstances, place: replace(
                circumstances, failed={**circumstances.failed, number: place}
            ),
        )
        self._changed("failure", f"robot {number} failed")
        self.undo.add(
            Edit(
                f"failure of robot {number}",
                lambda: self.undo.hold(lambda: self.revive_robot(number)),
                lambda: self.undo.hold(lambda: self.fail_robot(number)),
            )
        )

    def revive_robot(self, number: int) -> None:
        """Let a robot that failed work again."""
        self.branch()

        def revive(lane: Lane) -> None:
            circumstances = lane.circumstances
            if number not in circumstances.failed:
                return
            failed = dict(circumstances.failed)
            place = failed.pop(number)
            after = replace(circumstances, numbers=(*circumstances.numbers, number), failed=failed)
            positions = np.vstack([lane.simulation.positions, place])
            lane.change(after, positions, np.vstack([lane.simulation.velocities, (0.0, 0.0)]))

        self._all_or_none(revive)
        self._changed("robot", f"robot {number} works again")
        self.undo.add(
            Edit(
                f"revival of robot {number}",
                lambda: self.undo.hold(lambda: self.fail_robot(number)),
                lambda: self.undo.hold(lambda: self.revive_robot(number)),
            )
        )

    def _need_another(self, number: int) -> None:
        if not set(self.lanes[0].numbers) - {number}:
            raise ParameterError("the last robot that works stays")

    def _place_of(self, number: int) -> tuple[float, float]:
        lane = self.lanes[0]
        row = lane.row(number)
        if row is None:
            return lane.circumstances.failed[number]
        x, y = lane.simulation.positions[row].tolist()
        return x, y

    def _without(
        self,
        number: int,
        then: Callable[[Circumstances, tuple[float, float]], Circumstances],
    ) -> None:
        """Take a robot off the rows of every lane."""

        def go(lane: Lane) -> None:
            circumstances = lane.circumstances
            row = lane.row(number)
            failed = {key: place for key, place in circumstances.failed.items() if key != number}
            if row is None:
                lane.change(replace(circumstances, failed=failed))
                return
            x, y = lane.simulation.positions[row].tolist()
            numbers = tuple(each for each in circumstances.numbers if each != number)
            after = then(replace(circumstances, numbers=numbers, failed=failed), (x, y))
            lane.change(
                after,
                np.delete(lane.simulation.positions, row, axis=0),
                np.delete(lane.simulation.velocities, row, axis=0),
            )

        if self.hand is not None and self.hand[0] == number:
            self.hand = None
        self._all_or_none(go)

    # map

    def edit(self, environment: Environment, words: str) -> int:
        """Go on with another map of the same place; return how many robots had to be pushed out of the way.

        Raises
        ------
        StartError
            When there is no room for a robot any more; nothing has changed then.
        """
        self.branch()
        before = self.environment
        pushed = self._put(environment)
        self._changed("obstacle", words)
        self.undo.add(
            Edit(words, lambda: self._revert(before, words), lambda: self._redo(environment, words))
        )
        return pushed

    def _put(self, environment: Environment) -> int:
        places = {lane.number: lane.simulation.positions for lane in self.lanes}
        self._change_all(lambda lane: replace(lane.circumstances, environment=environment))
        moved = [
            int((np.hypot(*(lane.simulation.positions - places[lane.number]).T) > 1e-6).sum())
            for lane in self.lanes
        ]
        self.scenario = replace(self.scenario, environment=environment)
        return max(moved)

    def _revert(self, environment: Environment, words: str) -> None:
        self._put(environment)
        self._changed("obstacle", f"{words}: undone")

    def _redo(self, environment: Environment, words: str) -> None:
        self._put(environment)
        self._changed("obstacle", words)

    # how it is done

    def _change_all(self, wanted: Callable[[Lane], Circumstances]) -> None:
        self._all_or_none(lambda lane: lane.change(wanted(lane)))

    def _all_or_none(self, change: Callable[[Lane], None]) -> None:
        """Change every lane; if one cannot be changed, none is."""
        kept = [dict(lane.__dict__) for lane in self.lanes]
        try:
            for lane in self.lanes:
                change(lane)
        except RobocovError:
            for lane, state in zip(self.lanes, kept, strict=True):
                lane.__dict__.clear()
                lane.__dict__.update(state)
            raise

    def _changed(self, kind: str, words: str) -> None:
        """Note what has been touched, and let the newest moment tell of it."""
        self.events.append(Event(self.end, kind, words))
        self._amend()

    def _amend(self) -> None:
        self.settled = False
        self.history.amend(Moment(self._step, {lane.number: lane.state() for lane in self.lanes}))

    def summary(self) -> Mapping[str, float]:
        """Return the newest mean distance of each lane, m, by its number."""
        return {lane.number: lane.curve.at(self.time) for lane in self.lanes}


def gain_words(before: Law, after: Law) -> str:
    """Return which gains differ, as people write them."""
    changed = [name for name in after.known if before.value(name) != after.value(name)]
    words = []
    for name in changed:
        value = after.value(name)
        words.append(f"{name} = {'no limit' if value is None else f'{value:.3g}'}")
    return ", ".join(words)


def branch_words(law: Law) -> str:
    """Return how a branch that was left is called."""
    gains = ", ".join(
        f"{name} {'no limit' if value is None else f'{value:.3g}'}"
        for name, value in law.gains.items()
        if value != law.known[name].default
    )
    return f"{law.label}, {gains}" if gains else law.label


def speed_after(session: Session) -> str:
    """Return the speed in words, and whether the machine keeps up with it."""
    words = speed_words(session.clock.speed)
    return f"{words}, as fast as it goes" if session.clock.behind else words


def _nearest_free(
    circumstances: Circumstances, positions: Array, row: int, point: tuple[float, float]
) -> Array:
    """Return the place nearest to a point where one robot fits, the others staying where they are.

    Raises
    ------
    StartError
        When there is none.
    """
    environment = with_failed(circumstances)
    radius = circumstances.limits.radius
    others = np.delete(positions, row, axis=0)
    place = np.array(point, dtype=float)
    for _ in range(60):
        place = relocated(environment, place[None], circumstances.limits.team(1))[0]
        if not len(others):
            return place
        apart = np.hypot(*(others - place).T)
        near = int(apart.argmin())
        if apart[near] >= 2 * radius:
            return place
        away = place - others[near]
        length = float(np.hypot(*away))
        direction = away / length if length > 1e-9 else np.array([1.0, 0.0])
        # a little to one side, so that it goes round a crowd instead of to and fro
        direction = direction + 0.3 * np.array([-direction[1], direction[0]])
        place = others[near] + (2 * radius + 2e-3) * direction / np.hypot(*direction)
    raise StartError("there is no room for a robot there")
