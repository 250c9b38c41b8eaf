"""What came out of many runs, laid out so that contenders can be compared in the same scenarios.

A *scenario* is a map, a start and a seed: every contender began from the same positions there. A run that
failed is nan, and drops out of every comparison that needs it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray

if TYPE_CHECKING:
    from robocov.controllers.gains import Value


class Scenario(NamedTuple):
    """Where the robots began, and on what map."""

    map: str
    start: str
    seed: int


@dataclass(frozen=True, eq=False)
class Outcomes:
    """What every contender reached in every scenario.

    Attributes
    ----------
    scenarios : m scenarios
    values : dict of (contender, measure) to (m,)
        Measures: ``final`` and ``reference`` (m), ``gap`` (J/J_ref - 1), ``early`` and ``first_minute``
        (m, time averages), ``stuck`` (robots), ``contacts``, ``settled`` (s, nan where it did not).
    placements : dict of contender to (m, n, 2) m
        Where the robots were at the end; nan where the run failed.
    shares : dict of map to float, m
        Side of a square as large as one robot's share of the free space.
    """

    scenarios: tuple[Scenario, ...]
    values: Mapping[tuple[str, str], Array]
    placements: Mapping[str, Array] = field(default_factory=dict)
    shares: Mapping[str, float] = field(default_factory=dict)

    def of(self, contender: str, measure: str) -> Array:
        """Return what a contender reached, (m,); all nan where it did not take part."""
        found = self.values.get((contender, measure))
        return np.full(len(self.scenarios), np.nan) if found is None else found

    @property
    def maps(self) -> tuple[str, ...]:
        """The map of each scenario."""
        return tuple(scenario.map for scenario in self.scenarios)

    @property
    def starts(self) -> tuple[str, ...]:
        """The start of each scenario."""
        return tuple(scenario.start for scenario in self.scenarios)

    def together(self, contenders: Iterable[str], measure: str) -> BoolArray:
        """Return in which scenarios all of these contenders have a finite value, (m,)."""
        finite = np.ones(len(self.scenarios), dtype=bool)
        for contender in contenders:
            finite &= np.isfinite(self.of(contender, measure))
        return finite

    def median_by_map(self, contender: str, measure: str = "gap") -> dict[str, float]:
        """Return the median of what a contender reached on each map on which it has a finite value."""
        values = self.of(contender, measure)
        found: dict[str, float] = {}
        for map_ in dict.fromkeys(self.maps):
            here = values[[each == map_ for each in self.maps]]
            here = here[np.isfinite(here)]
            if len(here):
                found[map_] = float(np.median(here))
        return found

    def among(self, chosen: BoolArray) -> Outcomes:
        """Return some of the scenarios."""
        return Outcomes(
            tuple(scenario for scenario, kept in zip(self.scenarios, chosen, strict=True) if kept),
            {key: values[chosen] for key, values in self.values.items()},
            {contender: places[chosen] for contender, places in self.placements.items()},
            self.shares,
        )

    def from_starts(self, starts: Iterable[str]) -> Outcomes:
        """Return the scenarios that begin from these starts."""
        wanted = set(starts)
        return self.among(np.array([start in wanted for start in self.starts], dtype=bool))


def joined(parts: Sequence[Outcomes]) -> Outcomes:
    """Return the outcomes of several studies together; a contender has nan where it did not take part.

    Scenarios keep the order in which they are first met. Where several parts have a contender in the same
    scenario, the last one counts.
    """
    scenarios = tuple(dict.fromkeys(scenario for part in parts for scenario in part.scenarios))
    place = {scenario: k for k, scenario in enumerate(scenarios)}
    values: dict[tuple[str, str], Array] = {}
    placements: dict[str, Array] = {}
    shares: dict[str, float] = {}
    for part in parts:
        rows = [place[scenario] for scenario in part.scenarios]
        for key, own in part.values.items():
            values.setdefault(key, np.full(len(scenarios), np.nan))[rows] = own
        for contender, places in part.placements.items():
            missing = np.full((len(scenarios), *places.shape[1:]), np.nan)
            placements.setdefault(contender, missing)[rows] = places
        shares |= part.shares
    return Outcomes(scenarios, values, placements, shares)


@dataclass(frozen=True, eq=False)
class GainOutcomes:
    """What one law reached with every set of gains of a grid.

    Attributes
    ----------
    scenarios : m scenarios
    gains : g sets of gains
    excess : (g, m)
        J/J_ref: the final mean distance by that of the map's centralised reference; nan where a run failed.
    """

    scenarios: tuple[Scenario, ...]
    gains: tuple[Mapping[str, Value], ...]
    excess: Array

    @property
    def maps(self) -> tuple[str, ...]:
        """The map of each scenario."""
        return tuple(scenario.map for scenario in self.scenarios)

    @property
    def complete(self) -> GainOutcomes:
        """The scenarios in which no run failed."""
        fine: BoolArray = np.asarray(np.isfinite(self.excess).all(axis=0))
        kept = tuple(each for each, good in zip(self.scenarios, fine, strict=True) if good)
        return GainOutcomes(kept, self.gains, self.excess[:, fine])

    def best(self, columns: Sequence[int] | None = None) -> int:
        """Return the number of the gains whose mean of J/J_ref is least, over all scenarios or some.

        Scenarios in which any run failed do not count. Of gains that are equally good the first is taken.
        """
        excess = self.excess if columns is None else self.excess[:, list(columns)]
        return int(np.argmin(excess[:, np.isfinite(excess).all(axis=0)].mean(axis=1)))

    def with_gain(self, name: str, value: float) -> GainOutcomes:
        """Return the part of the grid in which one gain has this value."""
        rows = [k for k, gains in enumerate(self.gains) if gains.get(name) == value]
        return GainOutcomes(self.scenarios, tuple(self.gains[k] for k in rows), self.excess[rows])
