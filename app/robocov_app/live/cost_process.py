"""The process that computes the cost: ``python -m robocov_app.live.cost_process``, for a `CostWorker` only.

Only the newest map and the newest question count. While a map is being prepared, questions are answered
for the one before. The process ends when its standard input does, which it does however its parent ends.
"""

from __future__ import annotations

import os
import threading
import time
from typing import BinaryIO

from robocov.cost import CoverageCost, MomentaryCost
from robocov.errors import RobocovError
from robocov_app.live.evaluation import evaluated
from robocov_app.live.messages import Build, Building, Failed, Question, Ready, receive, send, values_of
from robocov_app.live.own_process import own_streams

_PAUSE = 0.05
"""Seconds between two words on how far a map is."""


class _NewerError(Exception):
    """There is a newer map."""


class Process:
    """Reads what is wanted, and does the newest of it."""

    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source, self._target = source, target
        self._wanted = threading.Condition()
        self._build: Build | None = None
        self._question: Question | None = None
        self._generation = -1
        self._cost: CoverageCost | None = None
        self._momentary: MomentaryCost | None = None
        self._told: CoverageCost | None = None

    def run(self) -> None:
        """Go on for ever; reading ends the process."""
        threading.Thread(target=self._read, daemon=True).start()
        while True:
            with self._wanted:
                self._wanted.wait_for(lambda: self._build or (self._question and self._momentary))
                build, self._build = self._build, None
            if build is not None:
                self._prepare(build)
            self._answer()

    def _read(self) -> None:
        while (message := receive(self._source)) is not None:
            with self._wanted:
                if isinstance(message, Build):
                    self._build = message
                else:
                    self._question = message
                self._wanted.notify()
        os._exit(0)

    def _prepare(self, build: Build) -> None:
        began = said = time.perf_counter()

        def tell(done: float) -> None:
            nonlocal said
            if self._build is not None:
                raise _NewerError
            now = time.perf_counter()
            if now - said > _PAUSE and done > 0.0:
                said = now
                self._say(Building(build.generation, done, (now - began) * (1.0 - done) / done))
            # what was ready stays so until there is something newer
            self._answer()

        try:
            cost = self._weighed(build)
            if cost is None:
                cost = CoverageCost(build.environment, build.lattice, progress=tell)
        except _NewerError:
            return
        except RobocovError as error:
            self._cost = self._momentary = None
            self._say(Failed(build.generation, str(error)))
            return
        self._generation, self._cost = build.generation, cost
        # a map of a moment is given up when there is another map
        self._momentary = MomentaryCost(cost, progress=self._check)
        self._tell(cost, time.perf_counter() - began)

    def _check(self, done: float) -> None:
        if self._build is not None:
            raise _NewerError

    def _tell(self, cost: CoverageCost, seconds: float) -> None:
        """Say what the answers are made with that come now."""
        self._told = cost
        self._say(Ready(self._generation, cost.sites, cost.corners, seconds, cost.weights))

    def _weighed(self, build: Build) -> CoverageCost | None:
        """Return the cost of a map that differs from the one before in its density alone; None for others."""
        cost, environment = self._cost, build.environment
        if cost is None or cost.lattice != build.lattice or not cost.environment.same_place(environment):
            return None
        return cost.with_density(environment)

    def _answer(self) -> None:
        """Answer the newest question, if there is one and a map for it."""
        with self._wanted:
            question, momentary = self._question, self._momentary
            if question is None or momentary is None:
                return
            self._question = None
        began = time.perf_counter()
        try:
            evaluation = evaluated(momentary, question)
        except _NewerError:
            return
        except RobocovError as error:
            # on a map that is about to be replaced, robots may well be where there were obstacles
            self._say(Failed(self._generation, str(error)))
            return
        seconds = time.perf_counter() - began
        if evaluation.cost is not self._told:
            self._tell(evaluation.cost, seconds)
        self._say(values_of(self._generation, question, evaluation, seconds))

    def _say(self, message: object) -> None:
        try:
            send(self._target, message)
        except OSError:
            os._exit(0)


def main() -> None:
    """Talk to the parent, which after Ctrl-C closes the pipe."""
    Process(*own_streams()).run()


if __name__ == "__main__":
    main()
