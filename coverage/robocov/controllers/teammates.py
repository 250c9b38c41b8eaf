"""Knowledge of one robot about the others: positions, last contacts, and times at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray

REST_RADIUS_M = 0.1
"""Distance within which a robot at rest stays."""


class Teammates(NamedTuple):
    """Knowledge of a robot about (k,) others."""

    robots: IntArray
    """(k,) Their numbers, ascending."""
    positions: Array
    """(k, 2) m, their known or assumed positions."""
    heard_times: Array
    """(k,) s, when they were last heard."""
    heard_distances: Array
    """(k,) m, their distances then."""
    rest_times: Array
    """(k,) s, the time since which they have been within `REST_RADIUS_M` of `rest_positions`."""
    rest_positions: Array
    """(k, 2) m"""

    @classmethod
    def build_empty(cls) -> Teammates:
        """Build the knowledge of a robot that has not heard any other one."""
        return cls(
            robots=np.empty(0, dtype=np.intp),
            positions=np.empty((0, 2)),
            heard_times=np.empty(0),
            heard_distances=np.empty(0),
            rest_times=np.empty(0),
            rest_positions=np.empty((0, 2)),
        )

    def add_observation(
        self, robots: IntArray, positions: Array, own_position: Array, time: float, is_gone: BoolArray
    ) -> Teammates:
        """Add the positions of robots that are heard now.

        Parameters
        ----------
        robots : (m,) int array
        positions : (m, 2) array, m
        own_position : (2,) array, m
        time : float, s
        is_gone : (k,) bool array
            Robots known so far that are removed unless they are heard.
        """
        now = np.full(len(robots), time)
        distances = np.sqrt(((positions - own_position) ** 2).sum(axis=1))
        heard = Teammates(robots, positions, now, distances, now, positions)
        is_kept = ~(np.isin(self.robots, robots) | is_gone)
        columns = [np.concatenate([new, old[is_kept]]) for new, old in zip(heard, self, strict=True)]
        order = np.argsort(columns[0])
        later = Teammates(*(column[order] for column in columns))
        _, here, there = np.intersect1d(later.robots, self.robots, assume_unique=True, return_indices=True)
        distances = np.sqrt(((later.positions[here] - self.rest_positions[there]) ** 2).sum(axis=1))
        is_at_rest = distances < REST_RADIUS_M
        here = here[is_at_rest]
        there = there[is_at_rest]
        later.rest_positions[here] = self.rest_positions[there]
        later.rest_times[here] = self.rest_times[there]
        return later

    def add_reports(self, reports: Sequence[Teammates], robot: int, gone: Mapping[int, float]) -> Teammates:
        """Add reports about robots that were heard by others more recently.

        Parameters
        ----------
        reports : sequence of Teammates
            Of several reports with the same time the first one counts.
        robot : int
            The robot itself; reports about it are ignored.
        gone : mapping of int to float, s
            Times at which it considered robots failed or missing: only later reports about these count.
        """
        sources: list[Sequence[Array | IntArray]] = [self]
        for report in reports:
            min_times = [
                math.inf if other == robot else gone.get(other, -1.0) for other in report.robots.tolist()
            ]
            is_new = report.heard_times > np.array(min_times)
            # The robot cannot be considered failed because of its silence: it may never have been in range.
            report = report._replace(heard_distances=np.full(len(is_new), math.inf))
            sources.append([column[is_new] for column in report])
        columns = [np.concatenate(parts) for parts in zip(*sources, strict=True)]
        order = np.lexsort((-columns[2], columns[0]))  # by robot, the latest first; stable
        _, first = np.unique(columns[0][order], return_index=True)
        order = order[first]
        return Teammates(*(column[order] for column in columns))
