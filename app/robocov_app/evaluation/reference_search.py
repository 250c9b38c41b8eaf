"""Searches for the best placement on a map, in separate processes.

A reference placement is the best result of many descents on the known map. If J_ref is the mean distance of
the reference placement, and J that of a controller, the gap of the controller is J / J_ref - 1.
"""

import hashlib
import json
import subprocess
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from typing import Any

from robocov.errors import OutputError
from robocov.mapfile import from_json
from robocov_app.jobs.messages import Channel
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.terminal.interruption import Interruption

REFERENCE_FORMAT = "robocov-reference 1"
"""Beginning of the hashed text. It has to be changed whenever the search gives other results."""
_POLL_INTERVAL_S = 0.2
"""Time between two checks for an interruption."""


@dataclass(frozen=True)
class ReferenceQuery:
    """Inputs of a search for a reference placement.

    Parameters
    ----------
    document : Mapping
        The map as JSON.
    robots : int
        Number of robots.
    radius : float, m
        Radius of a robot.
    lattice : int
        Number of sites along a side of the lattice on which the cost is computed.
    restarts : int
        Number of descents; the best one is used.
    seed : int
        Seed of the starting positions of the descents.
    """

    document: Mapping[str, Any]
    robots: int
    radius: float
    lattice: int
    restarts: int
    seed: int = 0

    @property
    def input_hash(self) -> str:
        """Hash of all inputs, except for the starts of the map, on which the placement does not depend."""
        inputs = {**asdict(self), "document": {**self.document, "starts": None}}
        text = f"{REFERENCE_FORMAT}{json.dumps(inputs, sort_keys=True)}"
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class ReferencePlacement:
    """The best placement that was found with the whole map known.

    Parameters
    ----------
    mean_distance : float, m
        Mean distance to the nearest robot.
    positions : tuple of (x, y), m
        Position of each robot.
    agreement : float
        Fraction of the descents whose mean distance is within 0.5% of the best.
    """

    mean_distance: float
    positions: tuple[tuple[float, float], ...]
    agreement: float


class ReferenceSearch:
    """Worker service that answers a `ReferenceQuery` with a `ReferencePlacement`."""

    failure_message = "the search failed"

    def __call__(self, requests: list[ReferenceQuery], channel: Channel) -> ReferencePlacement:
        """Find the best placement for the last request."""
        from robocov.optimum import find_optimum

        query = requests[-1]
        best = find_optimum(
            from_json(dict(query.document)),
            query.robots,
            radius=query.radius,
            lattice=query.lattice,
            restarts=query.restarts,
            seed=query.seed,
        )
        positions = tuple((x, y) for x, y in best.positions.tolist())
        return ReferencePlacement(float(best.mean_distance), positions, float(best.compute_agreement()))


def answer_queries(
    queries: Mapping[str, Any],
    workers: int,
    stop: Interruption,
    service: str = f"{__name__}:ReferenceSearch",
) -> Iterator[tuple[str, Any]]:
    """Yield the answers of a worker service in the order in which they arrive.

    Parameters
    ----------
    queries : Mapping
        The queries by name.
    workers : int
        Maximum number of processes.
    stop : Interruption
        If an interruption is requested, running searches are ended, and their answers are lost.
    service : str
        The service as ``package.module:Class``.

    Yields
    ------
    tuple of str and Any
        Name of a query, and its answer.

    Raises
    ------
    OutputError
        If a search fails or its process ends.
    """
    processes: list[subprocess.Popen[bytes]] = []
    thread_state = threading.local()

    def start_thread_process() -> None:
        thread_state.process = start_process(service)
        processes.append(thread_state.process)

    def answer_query(name: str) -> tuple[str, Any]:
        reply = ask_process(thread_state.process, queries[name])
        if reply is None:
            raise OutputError(f"reference of map {name!r}: the process of the search has ended")
        if reply.answer is None:
            raise OutputError(f"reference of map {name!r}: {reply.problem}")
        return name, reply.answer

    pool = ThreadPoolExecutor(min(workers, len(queries)), initializer=start_thread_process)
    try:
        pending = {pool.submit(answer_query, name) for name in queries}
        while pending and not stop.requested:
            done, pending = wait(pending, timeout=_POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        # Kill the processes, so that the user need not wait seconds or minutes for running searches.
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        pool.shutdown()
        for process in processes:
            end_process(process)
