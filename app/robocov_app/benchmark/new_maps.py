"""New maps, sampled from the generators of the suite, and a test of whether gaps are larger on new maps.

A map with a new seed is statistically like any other map of its family. Unless a controller or its gains are
fitted to the maps of the suite, its gap on a new map is equally likely to have any rank among its gaps on the
maps of that family. If gaps on new maps are too often among the largest, the controller is fitted to the
suite.
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
from robocov_app.benchmark.realistic_maps import FLOOR_PLANS, build_floor_plan

TRACK = "ideal"
"""Track of the runs on new maps."""
MAX_NEW_MAPS = len(suite.FAMILIES) - 1
"""Maximum number of new maps: one of each family that has a generator."""
MIN_P_VALUE = 0.001
"""Minimum p-value of ranks on new maps at which a controller does not count as fitted to the suite."""
_MAX_MAP_SEED = 2**31
"""Upper limit of the seeds of new maps and starts."""
_MAX_ATTEMPTS = 100
"""Maximum number of seeds that are tried for a new map."""
_RANK_SAMPLES = 100_000
"""Number of random samples with which a p-value is estimated."""
_RANK_SUM_TOLERANCE = 1e-9
"""Tolerance in comparisons of sums of ranks."""


@dataclass(frozen=True)
class NewMap:
    """A map that the verifier drew.

    Attributes
    ----------
    name : str
        Family and seed, for messages.
    family : str
        Name of the family in the suite.
    start_seed : int
        Seed of the starting positions.
    environment : Environment
        The map.
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
        Median gap on the new maps, and on the maps of the same families in the suite.
    p_value : float
        Probability of ranks at least as extreme if the controller is not fitted to the suite.
    min_p_value : float
        Minimum possible p-value with these runs. With few runs, it is too large to show a
        difference.
    """

    new_gap: float
    suite_gap: float
    p_value: float
    min_p_value: float

    @property
    def is_worse(self) -> bool:
        """Whether the controller is clearly worse on new maps."""
        return self.p_value < MIN_P_VALUE


def sample_new_maps(families: Sequence[str], count: int, rng: np.random.Generator) -> list[NewMap]:
    """Sample new maps of different families.

    Parameters
    ----------
    families : sequence of str
        Names of families; those without a generator are ignored.
    count : int
        Number of maps; fewer are sampled if fewer families have a generator.
    rng : Generator
        Random numbers for the choice of families and seeds.

    Returns
    -------
    list of NewMap

    Raises
    ------
    ParameterError
        If no seed gives a map of a family.
    """
    generated_families = [family for family in families if family in GENERATORS or family in FLOOR_PLANS]
    chosen = rng.permutation(len(generated_families))[:count].tolist()
    return [_sample_map(generated_families[k], rng) for k in sorted(chosen)]


def _sample_map(family: str, rng: np.random.Generator) -> NewMap:
    """Sample a map of a family; seeds for which the generator finds no map are skipped."""
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
    raise ParameterError(f"--new-maps: no seed gives a map of the family {family}")


def compare_gaps(
    rows: Sequence[Mapping[str, Any]], new_gaps: Sequence[tuple[str, float]]
) -> NewMapComparison | None:
    """Compare the gaps on new maps with those in the rows of a result.

    Parameters
    ----------
    rows : sequence of Mapping
        Rows of the result.
    new_gaps : sequence of (str, float)
        Family and gap of each new map, all of different families. The gap is infinite if the run failed.

    Returns
    -------
    NewMapComparison or None
        None if the result has no runs on maps of these families.
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
        # Rank 1 is the largest gap.
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
    """Return the mean gap over the runs on each map of the track, by family; infinite if a run failed."""
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
    """Estimate the probability that random ranks have a sum of at most the observed one.

    Each rank is uniformly distributed from 1 to one of the sizes, and is divided by this size. Low ranks mean
    large gaps.
    """
    rng = np.random.default_rng(0)
    sums = np.zeros(_RANK_SAMPLES)
    for size in sizes:
        sums += rng.integers(1, size + 1, _RANK_SAMPLES) / size
    extreme_count = np.count_nonzero(sums <= observed_sum + _RANK_SUM_TOLERANCE)
    # Counting the observed ranks as one more sample keeps the p-value above 0.
    return (1 + int(extreme_count)) / (1 + _RANK_SAMPLES)
