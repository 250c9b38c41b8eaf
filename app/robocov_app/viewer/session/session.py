"""The session: panes in lockstep with their whole past, every way to touch them, and to take touches back."""

from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from operator import attrgetter
from time import perf_counter
from typing import Self

import numpy as np

from robocov.arrays import Array
from robocov.environment import Environment, Point
from robocov.errors import ParameterError, RobocovError
from robocov.metrics import SETTLED_DISTANCE_M, SETTLED_WINDOW_S
from robocov.observation import Snapshot
from robocov_app.render.scene import Sensed
from robocov_app.viewer.session import changes
from robocov_app.viewer.session.changes import Change, Drag, Release, Touch, map_change
from robocov_app.viewer.session.clock import Clock
from robocov_app.viewer.session.curves import Curve, Event, Ghost
from robocov_app.viewer.session.decision_replay import replayed_snapshot, sensor_in
from robocov_app.viewer.session.file import SavedSession
from robocov_app.viewer.session.lockstep import Lockstep
from robocov_app.viewer.session.moments import History, Moment, PaneSetup, State, Trail, way_of
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.scenario import MOST_PANES, ControllerChoice, Scenario, TeamSpec
from robocov_app.viewer.session.undo_tree import MOST_KEPT, Document, Node, replayed

MOST_GHOSTS = 8  # branches whose curves are shown
PUSHED = 5e-3  # meters from which on a robot counts as pushed: who leans on something moves in any case
MOST_SENSED = 300  # moments of another branch from which it is found out anew what was sensed
_SLIDE = 1.0  # seconds of simulation within which changes of a value, as by a slider, are one touch
_SLICE = 0.03  # seconds of a frame for making a branch again


@dataclass(frozen=True)
class SavePoint:
    """State to which a session returns after an unexpected error."""

    head: Node
    head_changes: tuple[Change, ...]
    head_texts: tuple[str, str]  # kind and words
    node_count: int
    run: Lockstep
    run_state: tuple[object, ...]
    panes: tuple[Pane, ...]
    history: History
    last: Moment
    cursor: int | None
    revision: int
    recorded_until: float | None


class Session:
    """Session of the window; StartError, ParameterError when the scenario cannot be begun.

    What touches it goes on from the moment that is looked at, or is refused, and nothing has changed then.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.clock = Clock(scenario.dt)
        self.playing, self.stop_when_settled, self.settled = True, False, False
        self.recorded_until: float | None = None  # s, up to there the run is a record
        self.repeatable = True  # whether the scenario leads to that record
        self.serial = 0  # grows when what is known of times so far does not hold any more
        self.revision = 0  # grows with every touch
        self._remaking: Iterator[None] | None = None
        self._script: list[Node] = []
        self.document = Document(scenario)
        self._begin_at(self.document.nodes[0], Lockstep(scenario))

    @classmethod
    def opened(cls, saved: SavedSession) -> Self:
        """Return the session of a file, made again up to its present; paused."""
        root = saved.document.path(saved.head)[0]
        session = cls(root.begun)
        session.playing, session.document = False, saved.document
        session._begin_at(root, session._run)
        for _ in session._remade(saved.head, saved.step):
            pass
        return session

    def _begin_at(self, head: Node, run: Lockstep) -> None:
        history = History(run.scenario.dt)
        history.add(run.moment(head.number))
        self._go_on(head, run, history)

    def _go_on(self, head: Node, run: Lockstep, history: History) -> None:
        self.head = head  # where in the document the present is
        self._run, self.history, self.clock.dt = run, history, run.scenario.dt
        self._cursor: int | None = None
        self._gesture: tuple[object, float] | None = None
        self._rebuilt: dict[int, tuple[object, Trail]] = {}
        self._ghosts: list[Ghost] | None = None
        self._waited, self.settled = 0, False
        self.serial += 1

    def recall(self, history: History) -> None:
        """Take over a past that was recorded, and look at its beginning; the panes are at its end."""
        self.history, last = history, history.last
        self._run.step, self._run.scenario, self.head.end = last.step, last.scenario, last.step
        self.recorded_until = last.step * history.dt
        self._cursor = 0 if len(history) > 1 else None
        self.serial += 1
        for pane in self.panes:
            pane.trail, _ = way_of(history, pane.number, len(history) - 1)

    @property
    def scenario(self) -> Scenario:
        return self._run.scenario

    @property
    def panes(self) -> list[Pane]:
        return self._run.panes

    @property
    def hand(self) -> tuple[int, Point] | None:
        return self._run.hand

    @property
    def environment(self) -> Environment:
        return self.setup(self.panes[0]).environment

    @property
    def time(self) -> float:
        return self.history.time(self._number)

    @property
    def end(self) -> float:
        return self._run.time

    @property
    def live(self) -> bool:
        return self._cursor is None

    @property
    def numbers(self) -> tuple[int, ...]:
        return self.setup(self.panes[0]).numbers

    @property
    def step_now(self) -> int:
        return self._run.step

    @property
    def can_be_made_again(self) -> bool:
        return self.recorded_until is None or self.repeatable

    def require_document(self) -> None:
        if not self.can_be_made_again:
            raise ParameterError("this began with a recorded run, which cannot be made again")
        for pane in self.panes:
            pane.law.made()

    @property
    def at_end_of_record(self) -> bool:
        """Whether the present is the end of a record that nobody has gone on from."""
        return self.recorded_until is not None and self.end <= self.recorded_until + 1e-9

    @property
    def _number(self) -> int:
        return len(self.history) - 1 if self._cursor is None else self._cursor

    def _state(self, pane: Pane) -> State:
        return self.history[self._number].states[pane.number]

    def setup(self, pane: Pane) -> PaneSetup:
        return self._state(pane).setup

    def snapshot(self, pane: Pane) -> Snapshot:
        """Return the moment that is looked at; a controller that fails on it has decided nothing."""
        if self._cursor is None:
            with suppress(RobocovError):
                return pane.simulation.observe_and_decide()
        return replayed_snapshot(self._state(pane), self.time, self.scenario.dt)

    def positions(self, pane: Pane) -> Array:
        """Return where the robots are at the moment that is looked at, (n, 2) m."""
        return pane.simulation.positions if self.live else self._state(pane).positions

    def trail(self, pane: Pane) -> tuple[Array, Array]:
        """Return where the robots went up to the moment that is looked at: (k, n, 2) m and (k,) s."""
        if self.setup(pane).numbers == pane.numbers:
            return pane.trail.until(self.time)
        key = self._cursor, self.serial
        kept, trail = self._rebuilt.get(pane.number, (None, pane.trail))
        if kept != key:
            trail, _ = way_of(self.history, pane.number, self._number)
            self._rebuilt[pane.number] = key, trail
        return trail.positions, trail.time

    @property
    def events(self) -> list[Event]:
        limits, found = self.document.limits(self.head, self._run.step), list[Event]()
        for node in self.document.path(self.head):
            happened = [] if node.scenario is not None else [(node.at, node.kind, node.words)]
            for step, kind, words in (*happened, *sorted(node.happenings)):
                if step <= limits[node.number]:
                    found.append(Event(step * self.scenario.dt, kind, words))
        return sorted(found, key=attrgetter("time"))

    @property
    def ghosts(self) -> list[Ghost]:
        if self._ghosts is None:
            self._ghosts = self._other_curves()[-2 * MOST_GHOSTS * len(self.panes) :]
        return self._ghosts

    def recent(self, pane: Pane, number: int) -> Array:
        """Return where a robot was during the last seconds before the moment looked at, (k, 2) m."""
        last, first, places = self._number, self.history.at(self.time - SETTLED_WINDOW_S), []
        for k in range(first, last + 1, max(1, (last - first) // 30)):
            state = self.history[k].states.get(pane.number)
            if state is not None and number in state.setup.numbers:
                places.append(state.positions[state.setup.numbers.index(number)])
        return np.array(places).reshape(-1, 2)

    def compared(self, what: str = "distance") -> tuple[float, dict[int, float]]:
        """Return the newest time not after now when the costs of all panes with any are known, and these."""
        curves = {pane.number: curve for pane in self.panes if len(curve := pane.curves[what])}
        time = min([self.time, *(curve.last_time for curve in curves.values())])
        values = {number: curve.at(time) for number, curve in curves.items()}
        return time, {number: value for number, value in values.items() if np.isfinite(value)}

    def advance(self, seconds: float) -> int:
        if self._remaking is not None:
            self.remake(_SLICE)
            return 0
        return self.clock.advance(seconds, self._play_on) if self.playing else 0

    def step(self) -> None:
        self.playing = False
        if self._cursor is None:
            self._advance()
        else:
            self._look(self._cursor + 1)

    def look_at(self, time: float) -> None:
        self.release()
        self._look(self.history.at(time))

    def look_by(self, moments: int) -> None:
        self.release()
        self._look(max(self._number + moments, 0))

    def _look(self, cursor: int) -> None:
        self._cursor, self._waited = (cursor if cursor < len(self.history) - 1 else None), 0

    def _play_on(self) -> bool:
        """Make one step, or show the next moment of the past; say whether to go on."""
        if self._cursor is not None:
            now, after = self.history[self._cursor], self.history[self._cursor + 1]
            self._waited += 1
            # where the past was thinned, moments stay for as many steps as are missing
            if self._waited >= after.step - now.step:
                self._look(self._cursor + 1)
            if self._cursor is None and self.at_end_of_record:
                self.playing = False  # to go on from there is for people to decide
            return self.playing
        try:
            self._advance()
        except RobocovError:
            self.playing = False
            raise
        self.playing = self.playing and not (self.stop_when_settled and self.settled)
        return self.playing

    def _advance(self) -> None:
        self.head.happenings.update(self._run.advance())
        self.head.carry_out(self._run)  # it goes on amid a touch that lasted, as a drag
        self.head.end = max(self.head.end, self._run.step)
        self.history.add(self._run.moment(self.head.number))
        self._follow()
        if self._run.step % 12 == 0:
            self.settled = self._has_settled()

    def _has_settled(self) -> bool:
        if self.hand is not None or self.end < SETTLED_WINDOW_S:
            return False
        before = self.history[self.history.at(self.end - SETTLED_WINDOW_S)]
        for pane in self.panes:
            state = before.states[pane.number]
            alike, places = state.setup is pane.setup, pane.simulation.positions
            if not alike or np.hypot(*(places - state.positions).T).max() >= SETTLED_DISTANCE_M:
                return False
        return True

    def follow(self, node: Node) -> None:
        """Let what was done on the way to a node be done again as time goes by; any other touch ends that."""
        self._script = self.document.path(node)

    def _follow(self) -> None:
        if self.head not in self._script:
            self._script = []
        for node in self._script[self._script.index(self.head) + 1 :] if self._script else ():
            if node.at != self._run.step:
                break
            self.head, self.settled = node, False
            node.carry_out(self._run)
            self.history.amend(self._run.moment(self.head.number))

    def branch(self) -> bool:
        """Go on from the moment looked at, if that is past, and say so; what came after stays as a branch."""
        if self._cursor is None:
            return False
        moment = self.history[self._cursor]
        self._take_over(Lockstep.resumed(moment), moment.node, self.history.until(self._cursor))
        return True

    def enter(self, node: Node, step: int | None = None) -> None:
        """Go to a step of a node, its end by default; where simulating takes long, with every `advance`."""
        self.remake()
        self._remaking = self._remade(node, node.end if step is None else step)
        self.remake(np.inf if np.isinf(self.clock.budget) else 4 * _SLICE)

    def remake(self, seconds: float = np.inf) -> None:
        """Go on with making a branch again for so many seconds, by default to its end."""
        began, remaking, self._remaking = perf_counter(), self._remaking, None
        for _ in remaking or ():
            if perf_counter() - began > seconds:
                self._remaking = remaking
                return

    def undo(self) -> str | None:
        """Go back to right before the newest touch; return what it was, None if there is none."""
        if (parent := (node := self.head).parent) is None:
            return None
        parent.redo = node
        self.enter(parent, node.at)
        return node.words

    def redo(self) -> str | None:
        """Go to the end of what was undone last; return what it was, None if there is none."""
        if (node := self.head.redo) is None:
            return None
        self.enter(node)
        return node.words

    def _remade(self, node: Node, step: int) -> Iterator[None]:
        """Make the run up to a step of a node again, and take it over; stop for breath after each step."""
        path, limits = self.document.path(node), self.document.limits(node, step)
        rank = {each.number: k for k, each in enumerate(path)}
        on_the_way = set(rank) & {each.number for each in self.document.path(self.head)}
        kept = [moment for moment in self.history.moments if moment.node in on_the_way]
        kept += [moment for each in path if each.number not in on_the_way for moment in each.kept]
        kept = [moment for moment in kept if moment.step <= limits[moment.node]]
        kept.sort(key=lambda moment: (rank[moment.node], moment.step))
        run = Lockstep.resumed(kept[-1]) if kept else Lockstep(path[0].begun)
        history = History(run.scenario.dt, self.history.most_bytes)
        for moment in kept or [run.moment(path[0].number)]:
            history.amend(moment)
        for _, here in replayed(self.document, node, step, run, path[rank[history.last.node]]):
            if (run.step, here.number) != (history.last.step, history.last.node):
                history.amend(run.moment(here.number))
            yield
        self._take_over(run, node.number, history)

    def _take_over(self, run: Lockstep, node: int, history: History, change: Touch | None = None) -> None:
        """Let another moment of the document be the present, and carry out a change there if that can be."""
        self.stow()
        left = self.document.limits(self.head, self._run.step)
        on_the_way, head = run.step <= left.get(node, -1), self.document.nodes[node]
        path, limits = self.document.path(head), self.document.limits(head, run.step)
        before = {pane.number: pane for pane in self.panes} if on_the_way else {}
        for pane in run.panes:
            pane.trail, pane.starts = way_of(history, pane.number, len(history) - 1)
            for what, curve in pane.curves.items():
                for each in path:
                    curve.extend(each.curves[pane.number, what], limits[each.number] * run.scenario.dt)
            known = before.get(pane.number)
            pane.sensed = _sensed_in(history, pane.number) if known is None else known.sensed.copy()
            pane.sensed.cut(run.time)
        if change is not None:
            run.apply(change)
        self._go_on(head, run, history)

    def stow(self) -> None:
        moments = defaultdict[int, list[Moment]](list)
        for moment in self.history.moments:
            moments[moment.node].append(moment)
        path, dt = self.document.path(self.head), self.scenario.dt
        for node, after in zip(path, [*path[1:], None], strict=True):
            now = moments[node.number]
            later = node.kept if after is None or not now else []
            kept = [*now, *(each for each in later if each.step > self._run.step)]
            node.kept = kept[:: -max(-(-len(kept) // MOST_KEPT), 1)][::-1]  # the last among them
            for pane in self.panes:
                node.controllers[pane.number] = pane.law
                for what, curve in pane.curves.items():
                    known = curve.between(node.begin * dt, np.inf if after is None else after.at * dt)
                    known.extend(node.curves[pane.number, what])
                    node.curves[pane.number, what] = known

    def _other_curves(self) -> list[Ghost]:
        limits, dt, found = self.document.limits(self.head, self._run.step), self.scenario.dt, []
        root = self.document.path(self.head)[0]
        for branch in self.document.branches():
            path, number = self.document.path(branch.node), branch.node.number
            theirs = self.document.limits(branch.node, branch.end)
            for pane, law in branch.node.controllers.items() if path[0] is root else ():
                for what in ("distance", "time"):
                    curve = Curve()
                    for node in path:
                        since, until = limits.get(node.number, -np.inf), theirs[node.number]
                        if until > since:
                            curve.extend(node.curves[pane, what].between(since * dt, until * dt))
                    if len(curve) > 1:
                        found.append(Ghost(law.name, law.words, curve.time, curve.value, what, number))
        return found

    def do(self, change: Touch, kind: str, words: str, gesture: object = None) -> None:
        """Carry a change out from the moment looked at; changes of one `gesture`, not None, are one touch."""
        self.remake()
        self._script, let_go = [], False
        if self._cursor is None:
            self._run.apply(change)
        else:
            moment, history = self.history[self._cursor], self.history.until(self._cursor)
            resumed = Lockstep.resumed(moment)
            let_go = resumed.hand is not None and not isinstance(change, Drag | Release)
            resumed.hand = None if let_go else resumed.hand
            self._take_over(resumed, moment.node, history, change)
        run, (now, since) = self._run, self._gesture or (None, 0.0)
        if gesture is not None and gesture == now and (kind == "hand" or self.end - since < _SLIDE):
            head, last = self.head, self.head.changes[-1]
            both_pull = isinstance(change, Drag) and isinstance(last, Drag)
            if both_pull and last.step == run.step and len(head.changes) > 1:  # other changes add up
                head.changes.pop()
            head.changes.append(replace(change, step=run.step))
            head.kind, head.words = kind, words
        else:
            self.head = self.document.add(self.head, run.step, kind, words, change)
            if let_go:  # of what was dragged at that moment of the past
                self.head.changes.insert(0, Release(step=run.step))
        self._gesture = None if gesture is None else (gesture, self.end)
        self.revision += 1
        self._ghosts, self.settled = None, False
        self.history.amend(run.moment(self.head.number))

    def save_point(self) -> SavePoint:
        """Return what `roll_back` needs to come back to the present state."""
        return SavePoint(
            head=self.head,
            head_changes=tuple(self.head.changes),
            head_texts=(self.head.kind, self.head.words),
            node_count=len(self.document.nodes),
            run=self._run,
            run_state=_state_of(self._run),
            panes=tuple(self.panes),
            history=self.history,
            last=self.history.last,
            cursor=self._cursor,
            revision=self.revision,
            recorded_until=self.recorded_until,
        )

    def roll_back(self, point: SavePoint, *, in_step: bool) -> None:
        """Come back to an earlier state after an unexpected error, paused; nothing happens if it is the same.

        Parameters
        ----------
        point : SavePoint
            State to come back to.
        in_step : bool
            Whether a step of the simulation may have been interrupted, which leaves no other trace.
        """
        nodes = self.document.nodes
        is_same = (
            self._run is point.run
            and _state_of(self._run) == point.run_state
            and self.history is point.history
            and self.history.last is point.last
            and self.head is point.head
            and tuple(self.head.changes) == point.head_changes
            and len(nodes) == point.node_count
        )
        if is_same and not (in_step and self.playing):
            return
        del nodes[point.node_count :]
        for node in nodes:
            if node.redo is not None and node.redo not in nodes:
                node.redo = None
        point.head.changes[:] = point.head_changes
        point.head.kind, point.head.words = point.head_texts
        point.history.rewind(point.last)
        run = point.run
        with suppress(RobocovError):  # a recorded run that cannot go on stays as it was
            run = Lockstep.resumed(point.last)
        former = {pane.number: pane for pane in point.panes}
        for pane in run.panes:
            pane.trail, pane.starts = way_of(point.history, pane.number, len(point.history) - 1)
            if pane.number in former:
                pane.curves = former[pane.number].curves
                pane.sensed = former[pane.number].sensed.copy()
                pane.sensed.cut(run.time)
        self._remaking, self._script = None, []
        self._go_on(point.head, run, point.history)
        self._cursor, self.recorded_until = point.cursor, point.recorded_until
        self.revision = point.revision
        self.playing = False

    def restart(self, **changed: object) -> None:
        """Begin at time 0, with changes of the scenario if there are any; undo comes back to this run."""
        scenario = self.scenario
        if changed.keys() & {"environment", "robots", "start", "seed"}:
            changed.setdefault("given", None)
        known = {None, "uniform", *scenario.environment.starts}  # an obstacle may have covered it
        if "environment" in changed or scenario.start not in known:
            changed.setdefault("start", None)
        new: Scenario = replace(scenario, **changed)  # type: ignore[arg-type]
        self.remake()
        run = Lockstep(new)
        self.stow()
        words, restart = _anew(scenario, new), changes.Restart(new)
        self._begin_at(self.document.add(self.head, self._run.step, "begin", words, restart), run)
        self.recorded_until = None
        self.revision += 1

    def set_law(self, pane: Pane, law: ControllerChoice) -> None:
        before, change = self.setup(pane).law, changes.SetController(pane.number, law)
        if law.name != before.name:
            self.do(change, "law", f"{law.label} takes over")
        elif law != before:
            words = law.words_since(before)
            self.do(change, "law", f"{law.label}: {words}", ("gain", pane.number, words.partition(" = ")[0]))

    def set_limits(self, limits: TeamSpec) -> None:
        if limits != self.setup(self.panes[0]).limits:
            self.do(changes.SetLimits(limits), "limits", "limits changed", "limits")

    def add_pane(self, law: ControllerChoice) -> None:
        if len(self.panes) >= MOST_PANES:
            raise ParameterError(f"there is room for {MOST_PANES} controllers side by side")
        self.restart(laws=(*self.scenario.laws, law))

    def remove_pane(self, pane: Pane) -> None:
        self.do(changes.RemovePane(pane.number), "pane", f"{pane.law.label} left out")

    def edit(self, environment: Environment, words: str) -> int:
        change = map_change(self.environment, environment)
        before = {pane.number: self.positions(pane) for pane in self.panes}
        self.do(change, "obstacle", words)
        after = {pane.number: pane.simulation.positions for pane in self.panes}
        return max(int((np.hypot(*(after[k] - before[k]).T) > PUSHED).sum()) for k in before)

    def paint(self, dabs: tuple[Point, ...], radius: float, *, lowers: bool, stroke: object) -> None:
        words = "density lowered" if lowers else "density raised"
        self.do(changes.Paint(dabs, radius, lowers), "density", words, ("stroke", stroke))

    def grab(self, number: int, point: Point) -> None:
        """Drag a robot to a point: by a spring while the run goes on; one that failed, or paused, at once."""
        if self.playing and number in self.numbers:
            to = round(float(point[0]), 4), round(float(point[1]), 4)
            self.do(Drag(number, to), "hand", f"robot {number} was dragged", ("hand", number))
        else:
            self.place(number, point)

    def release(self) -> None:
        if self.hand is not None and self._cursor is None:
            number = self.hand[0]
            self.do(Release(), "hand", f"robot {number} was dragged", ("hand", number))
        self._gesture = None

    def place(self, number: int, point: Point) -> None:
        """Put a robot, or one that failed, at a point or as near as it fits, until `release` as one touch."""
        at = float(point[0]), float(point[1])
        self.do(changes.Place(number, at), "hand", f"robot {number} was moved", ("place", number))

    def add_robot(self, point: Point) -> int:
        new = self.setup(self.panes[0]).there[-1] + 1
        self.do(changes.Join(new, (float(point[0]), float(point[1]))), "robot", f"robot {new} joined")
        return new

    def remove_robot(self, number: int) -> None:
        self.do(changes.Leave(number), "robot", f"robot {number} taken out")

    def fail_robot(self, number: int) -> None:
        self.do(changes.Fail(number), "failure", f"robot {number} failed")

    def revive_robot(self, number: int) -> None:
        self.do(changes.Revive(number), "robot", f"robot {number} works again")

    def fail_or_revive(self, number: int) -> str:
        failed = number in self.setup(self.panes[0]).failed
        (self.revive_robot if failed else self.fail_robot)(number)
        return self.head.words


def _state_of(run: Lockstep) -> tuple[object, ...]:
    """Return what of a run differs after it was changed, other than by a step."""
    panes = [(pane.number, id(pane.setup), id(pane.simulation)) for pane in run.panes]
    return run.step, run.hand, id(run.scenario), *panes


def _sensed_in(history: History, pane: int) -> Sensed:
    found = Sensed()
    for k in range(0, len(history), max(1, len(history) // MOST_SENSED)):
        time, state = history.time(k), history[k].states[pane]
        setup, sensor = state.setup, sensor_in(state.setup.solid)
        sensor.set_time(time)
        found.add(time, setup.numbers, sensor.find_nearest_points(state.positions, setup.team.sensing_range))
    return found


def _anew(before: Scenario, after: Scenario) -> str:
    words = [f"{law.label} compared" for law in after.laws[len(before.laws) :]]
    if after.environment is not before.environment:
        words.append(f"map {after.environment.name}")
    elif after.start_name != before.start_name:
        words.append(f"start {after.start_name}")
    if after.robots != before.robots:
        words.append(f"{after.robots} robots")
    if after.seed != before.seed:
        words.append(f"seed {after.seed}")
    return ", ".join(words) or "begun anew"
