"""The exact cost beside a window that must not wait: asked for in one frame, there in a later one."""

from __future__ import annotations

import queue
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov_app.live.messages import (
    Build,
    Building,
    Event,
    Failed,
    Question,
    Ready,
    Values,
    answer_of,
)
from robocov_app.live.talk import Talk

if TYPE_CHECKING:
    from types import TracebackType

    from robocov.arrays import Array
    from robocov.environment import Environment

_PER_VIEW = 4e-9
_PER_LINK = 5e-8
_PER_SITE = 2e-7
_ALWAYS = 0.01
"""Seconds for a pair of a site and a corner, a pair of corners, a site, and in any case; see `estimate`."""

_LEARNING = 0.5
"""How much of the last surprise the next estimate takes on."""


class CostWorker:
    """The coverage cost in a process of its own.

    No call waits for that process. Only the newest map and the newest question count: what has been
    overtaken is not computed. After the process has ended, for whatever reason, the next call
    starts another one.

    Examples
    --------
    ::

        with CostWorker() as worker:
            worker.environment(environment, lattice=128)
            while running:
                worker.ask(simulation.time, simulation.positions)
                for event in worker.poll():
                    ...  # Building, Ready, Answer or Failed
    """

    def __init__(self) -> None:
        self._generation = 0
        self._last: Build | None = None
        self._ready: dict[int, Ready] = {}
        self._surprise = 1.0
        self._expected: dict[int, float] = {}
        self._own_events: list[Event] = []
        self._talk: _Talk | None = None

    def environment(self, environment: Environment, lattice: int) -> int:
        """Prepare the cost of a map from now on; return the number that events will call it by."""
        self._generation += 1
        # without what has been derived already: that is quickly done again, and long to send
        self._last = Build(self._generation, replace(environment), lattice)
        expected = self._unscaled(environment, lattice)
        self._expected[self._generation] = expected
        self._own_events.append(Building(self._generation, 0.0, self._surprise * expected))
        self._talking().build(self._last)
        return self._generation

    def ask(
        self,
        time: float,
        positions: Array,
        topic: int = 0,
        point: Array | None = None,
        speeds: Array | None = None,
    ) -> None:
        """Ask for the cost of (n, 2) m positions; the answer bears the same time and topic.

        With a `point`, (2,) m, also for the shortest path from there to its nearest robot; with `speeds`,
        (n,) m/s, for the mean time until the first robot is at a place. Obstacles that move stand where
        they are at that time.
        """
        if self._last is not None:
            self._talking().ask(Question(time, np.array(positions, dtype=float), topic, point, speeds))

    def poll(self) -> list[Event]:
        """Return what has happened since the last call."""
        events, self._own_events = self._own_events, []
        if self._talk is None:
            return events
        ended = self._talk.ended
        for message in self._talk.heard():
            if isinstance(message, Values):
                events.append(answer_of(message, self._ready[message.generation]))
                continue
            if isinstance(message, Ready):
                # answers come after what they are made with
                self._ready = {message.generation: message}
                self._learn(message)
            events.append(message)
        if ended:
            self._talk.close()
            self._talk = None
            events.append(Failed(self._generation, "the process that computes the cost has ended"))
        return events

    def estimate(self, environment: Environment, lattice: int) -> float:
        """Return about how many seconds a map will take, going by its sizes and by those before it."""
        return self._surprise * self._unscaled(environment, lattice)

    def close(self) -> None:
        """End the process."""
        if self._talk is not None:
            self._talk.close()
            self._talk = None

    def __enter__(self) -> CostWorker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _talking(self) -> _Talk:
        if self._talk is None or self._talk.ended:
            if self._talk is not None:
                self._talk.close()
            self._talk = _Talk()
            self._ready = {}
            if self._last is not None:
                self._talk.build(self._last)
        return self._talk

    def _learn(self, ready: Ready) -> None:
        expected = self._expected.get(ready.generation)
        self._expected = {k: v for k, v in self._expected.items() if k > ready.generation}
        # what comes from the cache says nothing about what does not
        if expected is not None and ready.seconds > 0.2 * self._surprise * expected:
            self._surprise *= (ready.seconds / (self._surprise * expected)) ** _LEARNING

    @staticmethod
    def _unscaled(environment: Environment, lattice: int) -> float:
        low_x, low_y, high_x, high_y = environment.region.bounds
        free = environment.free
        sites = lattice**2 * free.area / max(high_x - low_x, high_y - low_y) ** 2
        corners = shapely.get_num_coordinates(free)
        return float(_ALWAYS + _PER_SITE * sites + _PER_VIEW * sites * corners + _PER_LINK * corners**2)


class _Talk(Talk):
    """A talk about the cost of the newest map, and about the newest question."""

    def __init__(self) -> None:
        self._build: Build | None = None
        self._question: Question | None = None
        self._heard: queue.SimpleQueue[Building | Ready | Values | Failed] = queue.SimpleQueue()
        super().__init__("robocov_app.live.cost_process")

    def build(self, build: Build) -> None:
        with self.changed:
            self._build = build
            self.changed.notify()

    def ask(self, question: Question) -> None:
        with self.changed:
            self._question = question
            self.changed.notify()

    def heard(self) -> list[Building | Ready | Values | Failed]:
        """Return what was said."""
        messages = []
        while not self._heard.empty():
            messages.append(self._heard.get())
        return messages

    def taken(self) -> list[Build | Question] | None:
        wanted = [each for each in (self._build, self._question) if each is not None]
        self._build = self._question = None
        return wanted or None

    def messages(self, taken: list[Build | Question]) -> list[Build | Question]:
        return taken

    def hear(self, message: Building | Ready | Values | Failed) -> None:
        self._heard.put(message)
