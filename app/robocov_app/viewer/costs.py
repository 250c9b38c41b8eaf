"""The exact cost of all panes beside the window: asked for in turn, each answer with its own time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache, cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.cost import CoverageCost, MomentaryCost
from robocov.errors import RobocovError
from robocov_app.live.cost_worker import CostWorker
from robocov_app.live.evaluation import evaluated
from robocov_app.live.messages import Answer, Building, Failed, Question, Ready
from robocov_app.render.field import Field, FieldLattice

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array
    from robocov.cost import CoverageResult, Sites
    from robocov.environment import Environment

LATTICE = 128
"""Sites along a side."""

_PANES = 1 << 20
"""More than there will ever be."""

_PATIENCE = 0.5
"""Seconds after which an answer is not waited for any more."""


@dataclass(frozen=True, eq=False)
class Known:
    """The newest that is known of a pane's cost.

    Attributes
    ----------
    time : float, s
        For which moment.
    result : CoverageResult
    path : (w, 2) m or None
        From the cursor to its nearest robot.
    lattice : callable
        Returns the sites as a field wants them.
    travel_time : float, s, or None
        Mean time until the first robot is at a place; None where it was not asked for.
    """

    time: float
    result: CoverageResult
    path: Array | None
    lattice: Callable[[], FieldLattice]
    travel_time: float | None = None

    @cached_property
    def field(self) -> Field:
        """The distances as layers want them; made only where one is shown."""
        return Field(self.lattice(), self.result)


class Costs(ABC):
    """Where the window has its costs from.

    Parameters
    ----------
    lattice : int

    Attributes
    ----------
    known : dict of int to Known
        By pane; of the map as it is.
    state : str
        What is to be said about a map that is not ready yet, or why there is no cost; else empty.
    """

    def __init__(self, lattice: int = LATTICE) -> None:
        self.known: dict[int, Known] = {}
        self.state = ""
        self._lattice = lattice
        self._waiting: dict[int, Question] = {}

    @abstractmethod
    def environment(self, environment: Environment) -> None:
        """Take another map from now on."""

    def forget(self) -> None:
        """Leave out what has been asked and is not yet answered: it was of another run."""
        self._waiting, self.known = {}, {}

    def ask(
        self,
        pane: int,
        time: float,
        positions: Array,
        point: Array | None = None,
        speeds: Array | None = None,
    ) -> None:
        """Ask for the cost of (n, 2) m positions, and for a path from a point.

        With `speeds`, (n,) m/s, for the mean time until the first robot is at a place too. What was asked
        about the pane before and is not yet on its way is forgotten.
        """
        # it keeps its place among the panes that wait, so that each has its turn
        self._waiting[pane] = Question(time, np.array(positions), pane, point, speeds)

    @abstractmethod
    def poll(self) -> list[tuple[int, Known]]:
        """Return what has been answered since the last call, by pane."""

    def close(self) -> None:
        """End what works for it."""
        self.forget()


class DirectCosts(Costs):
    """Computes in this process: for pictures that must not depend on the machine's speed."""

    def __init__(self, lattice: int = LATTICE) -> None:
        super().__init__(lattice)
        self._cost: CoverageCost | None = None
        self._momentary: MomentaryCost | None = None
        self._lattices: tuple[CoverageCost, Callable[[], FieldLattice]] | None = None

    def environment(self, environment: Environment) -> None:
        before = self._cost
        self.known, self.state, self._waiting = {}, "", {}
        self._cost = self._momentary = None
        if before is not None and before.environment.same_place(environment):
            self._cost = before.with_density(environment)
        else:
            try:
                self._cost = CoverageCost(environment, self._lattice)
            except RobocovError as error:
                self.state = f"no cost: {error}"
                return
        self._momentary = MomentaryCost(self._cost)

    def poll(self) -> list[tuple[int, Known]]:
        asked, self._waiting = self._waiting, {}
        answers = []
        for pane, question in asked.items():
            if self._momentary is None:
                continue
            try:
                found = evaluated(self._momentary, question)
            except RobocovError:
                continue
            self.known[pane] = Known(
                question.time, found.result, found.path, self._lattice_of(found.cost), found.travel_time
            )
            answers.append((pane, self.known[pane]))
        return answers

    def _lattice_of(self, cost: CoverageCost) -> Callable[[], FieldLattice]:
        if self._lattices is None or self._lattices[0] is not cost:
            self._lattices = cost, lattice_of(cost.sites)
        return self._lattices[1]


class WorkerCosts(Costs):
    """Has it computed by another process, which is asked about one pane after the other."""

    def __init__(self, lattice: int = LATTICE) -> None:
        super().__init__(lattice)
        self._worker = CostWorker()
        self._generation = -1
        self._out = -1.0
        self._ready = False
        self._run = 0
        self._sites: Callable[[], FieldLattice] | None = None

    def environment(self, environment: Environment) -> None:
        self.known, self._waiting, self._ready, self._out = {}, {}, False, -1.0
        self._generation = self._worker.environment(environment, self._lattice)
        self.state = "cost: preparing the map"

    def forget(self) -> None:
        super().forget()
        self._run += 1  # answers that are on their way are passed over

    def ask(self, *args: Any, **kwargs: Any) -> None:
        super().ask(*args, **kwargs)
        self._send()

    def poll(self) -> list[tuple[int, Known]]:
        answers = []
        for event in self._worker.poll():
            if event.generation != self._generation:
                continue
            if isinstance(event, Building):
                # also once more, after the other process had ended
                self._ready = False
                left = f", {event.seconds_left:.0f} s left" if event.seconds_left >= 1.0 else ""
                self.state = f"cost: preparing the map, {event.fraction:.0%}{left}"
            elif isinstance(event, Ready):
                self._ready, self.state = True, ""
                self._sites = lattice_of(event.sites)
            elif isinstance(event, Answer) and self._sites is not None:
                self._out = -1.0
                run, pane = divmod(event.topic, _PANES)
                if run == self._run:
                    self.known[pane] = Known(
                        event.time, event.result, event.path, self._sites, event.travel_time
                    )
                    answers.append((pane, self.known[pane]))
            elif isinstance(event, Failed):
                self._out = -1.0
                if not self._ready:
                    self.state = f"no cost: {event.message}"
        self._send()
        return answers

    def close(self) -> None:
        self._worker.close()

    def _send(self) -> None:
        now = perf_counter()
        if not self._waiting or not self._ready or 0.0 <= now - self._out < _PATIENCE:
            return
        pane = next(iter(self._waiting))
        question = self._waiting.pop(pane)
        topic = self._run * _PANES + pane
        self._worker.ask(question.time, question.positions, topic, question.point, question.speeds)
        self._out = now


def lattice_of(sites: Sites) -> Callable[[], FieldLattice]:
    """Return what makes the sites what a field wants, once, when it is asked for first."""
    return cache(lambda: FieldLattice(sites))
