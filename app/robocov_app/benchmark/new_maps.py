"""Maps that nobody has seen: drawn by the verifier from the generators of the suite, and compared with it.

A map of a family with a new seed is as good as any other one of the family. Unless a controller, or its
gains, were fitted to the maps of the suite, its gap on a new map is equally likely to have any rank among its
gaps on the maps of that family. If its gaps on new maps are too often among the largest, it knows the suite.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.generator import GENERATORS, generate_map
from robocov_app.benchmark import suite
from robocov_app.benchmark.floor_plans import FLOOR_PLANS, build_floor_plan

TRACK = "ideal"
"""Track of the runs on new maps."""
MAX_NEW_MAPS = len(suite.FAMILIES) - 1
"""One map of each family that has a generator."""
MIN_P_VALUE = 0.001
"""A controller whose ranks on new maps have a smaller p-value knows the suite."""
_MAX_MAP_SEED = 2**31
_MAX_ATTEMPTS = 100
_RANK_SAMPLES = 100_000
_SAME_SUM = 1e-9
"""Margin of comparisons of sums of ranks."""


@dataclass(frozen=True)
class NewMap:
    """A map that the verifier drew.

    Attributes
    ----------
    name : str
        Name for messages, with its family and seed.
    family : str
    start_seed : int
        Seed of the starting positions.
    environment : Environment
    """

    name: str
    family: str
    start_seed: int
    environment: Environment


@dataclass(frozen=True)
class NewMapComparison:
    """Gaps on new maps compared with those on the maps of the suite.

    Attributes
    ----------
    new_gap, suite_gap : float
        Median gap on the new maps, and over the maps of the same families in the suite.
    p_value : float
        Probability of ranks that are at least as high if the new maps are like those of the suite.
    min_p_value : float
        The smallest possible p-value. With few runs in a result, nothing can be shown.
    """

    new_gap: float
    suite_gap: float
    p_value: float
    min_p_value: float

    @property
    def is_worse(self) -> bool:
        """Whether the controller is clearly worse on new maps."""
        return self.p_value < MIN_P_VALUE


def draw_new_maps(families: Sequence[str], count: int, rng: np.random.Generator) -> list[NewMap]:
    """Draw new maps of different families.

    Parameters
    ----------
    families : sequence of str
        Names of families; those without a generator are ignored.
    count : int
        Number of maps; less if there are fewer families.
    rng : Generator

    Returns
    -------
    list of NewMap
    """
    drawable = [family for family in families if family in GENERATORS or family in FLOOR_PLANS]
    chosen = rng.permutation(len(drawable))[:count].tolist()
    return [_draw_map(drawable[k], rng) for k in sorted(chosen)]


def _draw_map(family: str, rng: np.random.Generator) -> NewMap:
    """Draw a map of a family. Seeds for which the generator finds no map are skipped."""
    for _ in range(_MAX_ATTEMPTS):
        seed = int(rng.integers(suite.MIN_NEW_SEED, _MAX_MAP_SEED))
        try:
            if family in GENERATORS:
                environment = generate_map(seed, kind=family)
            else:
                environment = build_floor_plan(family, seed)
        except ParameterError:
            continue
        start_seed = int(rng.integers(_MAX_MAP_SEED))
        return NewMap(f"{family}-{seed}", family, start_seed, environment)
    raise ParameterError(f"--new-maps: no new map of the family {family} can be drawn")


def compare_gaps(
    rows: Sequence[Mapping[str, Any]], new_gaps: Sequence[tuple[str, float]]
) -> NewMapComparison | None:
    """Compare the gaps on new maps with those in the rows of a result.

    Parameters
    ----------
    rows : sequence of Mapping
        Rows of the result.
    new_gaps : sequence of (str, float)
        Family and gap of each new map; infinite if the run failed. Families are different.

    Returns
    -------
    NewMapComparison or None
        None if there is nothing to compare.
    """
    gaps_by_family = _collect_gaps(rows)
    compared = [(family, gap) for family, gap in new_gaps if gaps_by_family.get(family)]
    if not compared:
        return None
    sizes = []
    ranks = []
    for family, gap in compared:
        suite_gaps = gaps_by_family[family]
        sizes.append(len(suite_gaps) + 1)
        ranks.append(1 + sum(other >= gap for other in suite_gaps))
    fractions = [rank / size for rank, size in zip(ranks, sizes, strict=True)]
    suite_gaps = [gap for family, _ in compared for gap in gaps_by_family[family]]
    return NewMapComparison(
        new_gap=float(np.median([gap for _, gap in compared])),
        suite_gap=float(np.median(suite_gaps)),
        p_value=_compute_p_value(sum(fractions), sizes),
        min_p_value=1.0 / math.prod(sizes),
    )


def _collect_gaps(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    """Return the mean gap on each map of the track by family; infinite if a run failed."""
    gaps_by_map: dict[str, list[float]] = {}
    for row in rows:
        if row["track"] == TRACK and row["map"] in suite.TRACKS[TRACK].maps:
            gap = row.get("gap")
            gaps_by_map.setdefault(row["map"], []).append(math.inf if gap is None else gap)
    gaps_by_family: dict[str, list[float]] = {}
    for name, gaps in gaps_by_map.items():
        gaps_by_family.setdefault(suite.FAMILY_OF[name], []).append(float(np.mean(gaps)))
    return gaps_by_family


def _compute_p_value(observed_sum: float, sizes: Sequence[int]) -> float:
    """Return the probability that a sum of uniform ranks, each by its size, is at most the observed one.

    A low rank is that of a large gap. The probability is estimated from random ranks.
    """
    rng = np.random.default_rng(0)
    sums = np.zeros(_RANK_SAMPLES)
    for size in sizes:
        sums += rng.integers(1, size + 1, _RANK_SAMPLES) / size
    hits = np.count_nonzero(sums <= observed_sum + _SAME_SUM)
    return (1 + int(hits)) / (1 + _RANK_SAMPLES)
