"""The exact cost of all panes beside the window: asked for in turn, each answer with its own time."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.cost import CoverageCost, CoverageResult, Sites, TimeVaryingCost
from robocov.defaults import DEFAULT_LATTICE
from robocov.environment import Environment
from robocov.errors import InputError, RobocovError
from robocov.kernel_compilation import call_cost_kernels, compile_kernels
from robocov_app.jobs.messages import Line, Wire
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker
from robocov_app.render.distance_field import Field, FieldLattice

_PAUSE = 0.05  # seconds between two words on how far a map is
_Sites: TypeAlias = tuple[Sites, Array, Array | None]  # with corners and weights: what all results share
_INDICES = ("owner", "first_corner", "last_corner")


@dataclass(frozen=True, eq=False)
class Known:
    """The newest that is known of a pane's cost."""

    time: float
    result: CoverageResult
    path: Array | None  # way-points from the cursor to its nearest robot, empty where none can come
    lattice: Callable[[], FieldLattice]  # returns the sites as a field wants them
    travel_time: float | None = None  # s, mean time until the first robot is at a place

    @cached_property
    def field(self) -> Field:
        return Field(self.lattice(), self.result)


class Costs:
    """Costs for a window, computed in another process, or `direct` where pictures must not depend on it."""

    def __init__(self, lattice: int = DEFAULT_LATTICE, *, direct: bool = False) -> None:
        self.known: dict[int, Known] = {}  # by pane, of the map as it is
        self.state = ""  # how far a new map is, or why there is no cost
        self.lattice = lattice  # sites along a side
        self._worker: Worker[Known | _Sites] = DirectWorker(CostService(), _CostWire())
        if not direct:
            service = "robocov_app.viewer.costs:CostService"
            self._worker = LatestWorker(service, "computes the cost", _CostWire)
        self._map: CostQuestion | None = None
        self._asked: CostQuestion | None = None
        self._number, self._ready = 0, False
        self._waiting: dict[int, CostQuestion] = {}
        self._pane: int | None = None  # of what is asked; None for a map, or where nobody wants it any more

    def environment(self, environment: Environment) -> None:
        self._number += 1
        self._map = CostQuestion(self._number, environment, self.lattice)
        self.known, self._waiting = {}, {}
        self._prepare()
        self.poll()

    def forget(self) -> None:
        """Leave out what has been asked and is not yet answered: it was of another run."""
        self._waiting, self.known, self._pane = {}, {}, None

    def ask(
        self,
        pane: int,
        time: float,
        at: Array,
        point: Array | None = None,
        speeds: Array | None = None,
        *,
        aside: bool = False,
    ) -> None:
        """Ask for the cost at (n, 2) m, a path from a point and, with (n,) m/s, the mean time.

        What was asked about the pane before and is not yet on its way is forgotten. `aside`: for a curve; it
        does not become what is known of the pane.
        """
        if self._map is not None:  # it keeps its place among the panes that wait, so that each has its turn
            asked = replace(self._map, time=time, positions=np.array(at), point=point, speeds=speeds)
            self._waiting[pane] = replace(asked, aside=aside)

    def poll(self) -> list[tuple[int, Known]]:
        answers, worker = [], self._worker
        while self._asked is not None or self._ask_next():
            answer = worker.poll()
            if worker.busy:
                if worker.progress is not None:
                    fraction, seconds = worker.progress
                    left = f", {seconds:.0f} s left" if seconds >= 1.0 else ""
                    self.state = f"cost: preparing the map, {fraction:.0%}{left}"
                break
            asked, self._asked = self._asked, None
            if asked is self._map:
                self._ready = answer is not None
                self.state = "" if self._ready else f"no cost: {worker.trouble}"
            elif answer is None:
                if not worker.is_alive:
                    self._prepare()  # it is started again; not if it dies of that too
            elif self._pane is not None and isinstance(answer, Known):
                if asked is None or not asked.aside:
                    self.known[self._pane] = answer
                answers.append((self._pane, answer))
        return answers

    def close(self) -> None:
        self.forget()
        self._worker.close()

    def _prepare(self) -> None:
        self._ready, self.state = False, "cost: preparing the map"
        self._asked, self._pane = self._map, None
        self._worker.put(self._map)

    def _ask_next(self) -> bool:
        if not self._waiting or not self._ready:
            return False
        self._pane = next(iter(self._waiting))
        self._asked = self._waiting.pop(self._pane)
        self._worker.put(self._asked)
        return True


@dataclass(frozen=True, eq=False)
class CostQuestion:
    """Request for the cost on map `number`, which is told once. Without positions: prepare it."""

    number: int
    environment: Environment | None
    lattice: int
    time: float = 0.0
    positions: Array | None = None
    point: Array | None = None
    speeds: Array | None = None
    aside: bool = False


class _Answer(NamedTuple):
    """Answer on its way: sites only where they are others than before."""

    sites: _Sites | None
    time: float = 0.0
    result: CoverageResult | None = None
    path: Array | None = None
    travel_time: float | None = None


class _CostWire(Wire):
    """Says each map once, and puts together what is said once of the results."""

    def __init__(self) -> None:
        self._told = -1
        self._sites: _Sites | None = None
        self._lattice: Callable[[], FieldLattice] | None = None

    def encode(self, question: CostQuestion) -> CostQuestion:
        if question.number == self._told or question.environment is None:
            return replace(question, environment=None)
        self._told = question.number
        # without what has been derived already: that is quickly done again, and long to send
        return replace(question, environment=replace(question.environment))

    def decode(self, answer: _Answer) -> Known | _Sites:
        if answer.sites is not None:
            self._sites, sites = answer.sites, answer.sites[0]
            self._lattice = cache(lambda: FieldLattice(sites))
        assert self._sites is not None and self._lattice is not None
        if answer.result is None:
            return self._sites
        sites, corners, weights = self._sites
        same: dict[str, Any] = {"points": sites.points, "corners": corners, "weights": weights}
        indices = {name: getattr(answer.result, name).astype(np.intp) for name in _INDICES}
        result = replace(answer.result, **indices, **same)
        return Known(answer.time, result, answer.path, self._lattice, answer.travel_time)


class CostService:
    """Prepares the newest map, and answers the newest question about it."""

    failing = "the cost could not be computed"

    def __init__(self) -> None:
        # If another process is compiling these kernels already, wait for it.
        compile_kernels([call_cost_kernels])
        self._cost: CoverageCost | None = None
        self._told: CoverageCost | None = None
        self._momentary: TimeVaryingCost | None = None

    def __call__(self, questions: list[CostQuestion], line: Line) -> _Answer:
        maps = [question for question in questions if question.environment is not None]
        if maps:
            self._prepare(maps[-1], line)
        cost, momentary, question = self._cost, self._momentary, questions[-1]
        if cost is None or momentary is None:
            raise InputError("the map has no cost")
        answer = _Answer(None)
        if question.positions is not None:
            answer, cost = _evaluated(momentary, question), momentary.get_cost(question.time)
        sites = None if cost is self._told else (cost.sites, cost.corners, cost.weights)
        self._told = cost
        return answer._replace(sites=sites)

    def _prepare(self, asked: CostQuestion, line: Line) -> None:
        environment, before, said = asked.environment, self._cost, (began := time.perf_counter())
        assert environment is not None

        def give_up(done: float) -> None:
            if any(question.environment is not None for question in line.newer()):
                raise RobocovError("there is a newer map")

        def tell(done: float) -> None:
            nonlocal said
            give_up(done)
            now = time.perf_counter()
            if now - said > _PAUSE and done > 0.0:
                said = now
                line.tell((done, (now - began) * (1.0 - done) / done))

        self._momentary = None
        if before and before.lattice == asked.lattice and before.environment.has_same_geometry(environment):
            self._cost = before.with_density(environment)
        else:
            self._cost = CoverageCost(environment, asked.lattice, progress=tell)
        self._momentary = TimeVaryingCost(self._cost, progress=give_up)


def _evaluated(momentary: TimeVaryingCost, question: CostQuestion) -> _Answer:
    now, positions = question.time, question.positions
    assert positions is not None
    result = momentary.evaluate_all_robots(now, positions)
    if result is None:
        raise InputError("positions: expected at least one at a free position, got none")
    path = travel_time = None
    if question.speeds is not None:
        first = momentary(now, positions, speeds=question.speeds)
        travel_time = None if first is None else first.mean_time
    if question.point is not None:
        with suppress(RobocovError):  # the point is not free
            path = momentary.get_cost(now).find_path(
                positions[momentary.find_counted_robots(now, positions)], question.point
            )
    indices = {name: getattr(result, name).astype(np.int32) for name in _INDICES}  # half as long on the way
    same: dict[str, Any] = dict.fromkeys(["weights", "environment", "sites"])
    same |= dict.fromkeys(["points", "corners"], np.empty((0, 2)))
    return _Answer(None, now, replace(result, **indices, **same), path, travel_time)
