"""Many runs of small teams in one process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.controllers import CONTROLLERS, remembers
from robocov.record import ARRAYS, Recorder
from robocov.robots import Team
from robocov.simulation import DEFAULT_DT, Simulation

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.conditions import Conditions
    from robocov.controllers.base import Controller
    from robocov.environment import Environment
    from robocov.record import Record

_LARGEST_TEAM = 15
"""From 16 robots on cells come off a triangulation, and a step of one team alone is as quick."""

_AT_ONCE = 64
"""Runs that are moved on together."""


def simulate_many(
    environment: Environment,
    controller: Controller,
    starts: Sequence[Array],
    duration: float,
    team: Team | None = None,
    dt: float = DEFAULT_DT,
    *,
    conditions: Sequence[Conditions | None] | None = None,
    start: str | None = None,
    seeds: Sequence[int] | None = None,
) -> list[Record]:
    """Simulate runs of one controller in one environment, and return their records.

    Each is the same, bit for bit, as ``Simulation(environment, controller, starts[k], ...).run(duration)``.
    Teams of up to 15 robots under a law that remembers nothing (RAPF, RPF, Lloyd, range-limited), without
    conditions and moving obstacles, are moved on together, several times as quickly; others one by one.

    Parameters
    ----------
    environment, controller, team, dt
        As `Simulation` takes them, the same for all.
    starts : sequence of (n, 2) m
        For each run the centres of the robots at the beginning; teams may differ in size without `team`.
    duration : float, s
    conditions : sequence of Conditions or None
        Those of each run; None: ideal ones.
    start : str, seeds : sequence of int
        Where the starts came from, kept in the records.

    Raises
    ------
    RobocovError
        As `Simulation`.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> starts = [rooms.start().sample(6, seed=seed) for seed in range(3)]
    >>> records = rc.simulate_many(rooms, rc.Rapf(), starts, 1.0)
    >>> [record.positions.shape for record in records]
    [(61, 6, 2), (61, 6, 2), (61, 6, 2)]
    """
    each = [None] * len(starts) if conditions is None else list(conditions)
    together: dict[int, list[int]] = {}
    records: dict[int, Record] = {}
    by_itself = environment.moves or remembers(controller) or type(controller) not in CONTROLLERS.values()
    for run, (positions, under) in enumerate(zip(starts, each, strict=True)):
        seed = None if seeds is None else seeds[run]
        if by_itself or len(positions) > _LARGEST_TEAM or not (under is None or under.ideal):
            simulation = Simulation(environment, controller, positions, team, dt, conditions=under)
            records[run] = simulation.run(duration, start=start, seed=seed)
        else:
            together.setdefault(len(positions), []).append(run)
    for size, group in together.items():
        one = Team.homogeneous(size) if team is None else team
        for first in range(0, len(group), _AT_ONCE):
            runs = group[first : first + _AT_ONCE]
            places, robots = np.concatenate([starts[run] for run in runs]), Team.joined([one] * len(runs))
            simulation = Simulation(environment, controller, places, robots, dt, runs=len(runs))
            recorder = Recorder(environment, robots, controller, dt, start=start)
            for snapshot in simulation.snapshots(duration):
                recorder.add(snapshot)
            record = recorder.record()
            for k, run in enumerate(runs):
                own = {
                    name: getattr(record, name)[:, k * size : (k + 1) * size].copy() for name in ARRAYS[1:]
                }
                seed = None if seeds is None else seeds[run]
                records[run] = replace(record, team=one, seed=seed, **own)
    return [records[run] for run in range(len(starts))]
