"""New maps, sampled from the generators of the suite, and a test of whether gaps are larger on new maps.

A map with a new seed is statistically like any other map of its family. Unless a controller or its gains are
fitted to the maps of the suite, its gap on a new map is equally likely to have any rank among its gaps on the
maps of that family, on the same track. If gaps on new maps are too often among the largest, the controller
is fitted to the suite.

The track is drawn, too. Otherwise, a controller could be fitted to all other tracks without being noticed.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.environment import Environment
from robocov.errors import NoLayoutError, ParameterError
from robocov_app.benchmark import suite

MAX_NEW_MAPS = len(suite.FAMILIES) - 1
"""Maximum number of new maps: one of each family that has a generator."""
SIGNIFICANCE_LEVEL = 0.001
"""A controller counts as fitted to the suite if the p-value of its ranks on new maps is below this level."""
_MAX_MAP_SEED = 2**31
"""Upper limit of the seeds of new maps and starts."""
_MAX_ATTEMPTS = 100
"""Maximum number of seeds that are tried for a new map."""


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
        Minimum possible p-value with these runs. With few runs, it is too large to show a difference.
    """

    new_gap: float
    suite_gap: float
    p_value: float
    min_p_value: float

    @property
    def is_worse(self) -> bool:
        """Whether the controller is clearly worse on new maps."""
        return self.p_value < SIGNIFICANCE_LEVEL

    @property
    def is_conclusive(self) -> bool:
        """Whether there are enough runs to show a difference."""
        return self.min_p_value < SIGNIFICANCE_LEVEL


def choose_track(
    maps_by_track: Mapping[str, Sequence[str]], count: int, rng: np.random.Generator
) -> str | None:
    """Choose a track for runs on new maps at random.

    Parameters
    ----------
    maps_by_track : mapping of str to sequence of str
        Maps of each track on which the controller was rated.
    count : int
        Number of new maps.
    rng : Generator

    Returns
    -------
    str or None
        One of the tracks that have enough maps to show a difference. If there is none, a track with maps of
        families that have a generator. None if there is no such track either.
    """
    sizes_by_track = {track: _count_maps_by_family(maps) for track, maps in maps_by_track.items()}
    tracks = [track for track, sizes in sizes_by_track.items() if sizes]
    conclusive_tracks = []
    for track in tracks:
        # The families are drawn, and may be those with the fewest maps.
        smallest_sizes = sorted(sizes_by_track[track].values())[:count]
        if _compute_min_p_value(smallest_sizes) < SIGNIFICANCE_LEVEL:
            conclusive_tracks.append(track)
    candidates = conclusive_tracks or tracks
    if not candidates:
        return None
    return candidates[int(rng.integers(len(candidates)))]


def _count_maps_by_family(maps: Iterable[str]) -> Counter[str]:
    """Return the number of maps of each family that has a generator."""
    families = (suite.FAMILY_OF[name] for name in maps)
    return Counter(family for family in families if suite.has_generator(family))


def _compute_min_p_value(family_sizes: Iterable[int]) -> float:
    """Return the p-value if the gap on a new map of each family is larger than on all its other maps."""
    return 1.0 / math.prod(size + 1 for size in family_sizes)


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
        If none of the seeds that are tried gives a map of a family.
    """
    generated_families = [family for family in families if suite.has_generator(family)]
    chosen = rng.permutation(len(generated_families))[:count].tolist()
    return [_sample_map(generated_families[k], rng) for k in sorted(chosen)]


def _sample_map(family: str, rng: np.random.Generator) -> NewMap:
    """Sample a map of a family; seeds for which the generator finds no map are skipped."""
    for _ in range(_MAX_ATTEMPTS):
        seed = int(rng.integers(suite.MIN_NEW_SEED, _MAX_MAP_SEED))
        try:
            environment = suite.build_family_map(family, seed)
        except NoLayoutError:
            continue
        start_seed = int(rng.integers(_MAX_MAP_SEED))
        return NewMap(f"{family}-{seed}", family, start_seed, environment)
    raise ParameterError(f"--new-maps: none of {_MAX_ATTEMPTS} seeds gives a map of the family {family}")


def compare_gaps(
    rows: Sequence[Mapping[str, Any]],
    new_gaps: Sequence[tuple[str, float]],
    track: str,
    rng: np.random.Generator,
) -> NewMapComparison | None:
    """Compare the gaps on new maps with those in the rows of a result.

    Parameters
    ----------
    rows : sequence of Mapping
        Rows of the result.
    new_gaps : sequence of (str, float)
        Family and gap of each new map, all of different families. The gap is infinite if the run failed.
    track : str
        Track of the runs on new maps.
    rng : Generator
        Random numbers for the choice of a run on each map of the suite.

    Returns
    -------
    NewMapComparison or None
        None if the result has no runs on maps of these families.
    """
    gaps_by_family = _sample_gaps(rows, track, rng)
    compared = [(family, gap) for family, gap in new_gaps if gaps_by_family.get(family)]
    if not compared:
        return None
    sizes = [len(gaps_by_family[family]) for family, _ in compared]
    # Rank 1 is the largest gap.
    ranks = [1 + sum(other >= gap for other in gaps_by_family[family]) for family, gap in compared]
    suite_gaps = [gap for family, _ in compared for gap in gaps_by_family[family]]
    return NewMapComparison(
        new_gap=float(np.median([gap for _, gap in compared])),
        suite_gap=float(np.median(suite_gaps)),
        p_value=_compute_p_value(ranks, sizes),
        min_p_value=_compute_min_p_value(sizes),
    )


def _sample_gaps(
    rows: Sequence[Mapping[str, Any]], track: str, rng: np.random.Generator
) -> dict[str, list[float]]:
    """Return the gap of one run on each map of a track, by family; infinite if the run failed.

    There is one run on each new map. The mean gap of several runs would vary less than that of one.
    """
    gaps_by_map: dict[str, list[float]] = {}
    for row in rows:
        if row["track"] == track:
            gap = row.get("gap")
            gaps_by_map.setdefault(row["map"], []).append(math.inf if gap is None else gap)
    gaps_by_family: dict[str, list[float]] = {}
    for name, gaps in gaps_by_map.items():
        gap = gaps[int(rng.integers(len(gaps)))]
        gaps_by_family.setdefault(suite.FAMILY_OF[name], []).append(gap)
    return gaps_by_family


def _compute_p_value(ranks: Sequence[int], family_sizes: Sequence[int]) -> float:
    """Compute the probability that random ranks are at least as low as the observed ones.

    Each rank is uniformly distributed from 1 to the size of its family plus 1, which includes the new map.
    Ranks are divided by this maximum and added, so that families of all sizes count the same.
    """
    max_ranks = [size + 1 for size in family_sizes]
    # With this unit, all divided ranks are whole numbers, and their sum has an exact distribution.
    unit = math.lcm(*max_ranks)
    distribution = np.ones(1)
    for max_rank in max_ranks:
        probabilities = np.zeros(unit + 1)
        probabilities[unit // max_rank :: unit // max_rank] = 1.0 / max_rank
        distribution = np.convolve(distribution, probabilities)
    observed_sum = sum(rank * unit // max_rank for rank, max_rank in zip(ranks, max_ranks, strict=True))
    return float(distribution[: observed_sum + 1].sum())
