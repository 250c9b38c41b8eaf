"""When a claim holds: thresholds that were set before anything was run, and plain words for the outcome.

A claim has one or several *criteria*: an estimate, its 95 % interval, and the range in which it has to
lie. A criterion is met where the whole interval lies in that range, refuted where all of it lies outside,
and open where it reaches over an end of the range.

    all criteria met                              the claim holds
    some met                                      it holds partly
    none met, at least one refuted                it does not hold
    all open, or too few maps to tell             undecided
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from robocov_app.figures.statistics import Interval
from robocov_app.replication.outcomes import GainOutcomes, Outcomes

Verdict: TypeAlias = Literal["holds", "holds partly", "does not hold", "undecided"]

# a bootstrap over fewer maps has too few different samples for a 95 % interval (126 of five)
LEAST_MAPS = 5

# how verdicts are said of one claim, and of several
VERDICTS: dict[Verdict, tuple[str, str]] = {
    "holds": ("holds", "hold"),
    "holds partly": ("holds partly", "hold partly"),
    "does not hold": ("does not hold", "do not hold"),
    "undecided": ("is undecided", "are undecided"),
}


@dataclass(frozen=True)
class Criterion:
    """A measure whose interval has to lie between `low` and `high`, both included, for a claim to hold."""

    text: str
    interval: Interval
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""  # "", "%", "m" or "s"; with "%", 0.5 is written as 50 %

    @property
    def met(self) -> bool | None:
        """Whether it is met; None where that is open."""
        low, high = self.interval.low, self.interval.high
        if self.low <= low and high <= self.high:
            return True
        return False if high < self.low or low > self.high else None  # with nan, all of that is wrong

    @property
    def wanted(self) -> str:
        """The range in words: "at most 5 %"."""
        low, high = amount(self.low, self.unit), amount(self.high, self.unit)
        if math.isinf(self.high):
            return f"at least {low}"
        return f"at most {high}" if math.isinf(self.low) else f"between {low} and {high}"

    @property
    def found(self) -> str:
        """The estimate and its interval in words."""
        return described(self.interval, self.unit)

    def to_json(self) -> dict[str, Any]:
        """Return what stands in ``claims.json``."""
        return {
            "measure": self.text,
            "unit": "1" if self.unit in ("", "%") else self.unit,
            "estimate": self.interval.estimate,
            "interval": [self.interval.low, self.interval.high],
            "at_least": self.low,
            "at_most": self.high,
            "met": self.met,
        }


@dataclass(frozen=True)
class Claim:
    """A claim, what the runs say of it, and why."""

    key: str  # stays the same over versions: "nonconvex-final-shared"
    part: int  # which question it belongs to
    claim: str  # the paper's sentence in our words
    source: str = ""  # where the paper says it; empty where the question is ours
    criteria: tuple[Criterion, ...] = ()  # the first is the main one: its estimate stands for the claim
    runs: int = 0  # simulated runs that went into it
    maps: int = 0  # different maps among them
    explanation: str = "There is no run that could tell."
    least_maps: int = LEAST_MAPS  # on fewer maps it is undecided

    def judged(
        self, criteria: Sequence[Criterion], explanation: str, on: Outcomes | GainOutcomes, runs: int
    ) -> Claim:
        """Return the claim with what `runs` runs in each of some scenarios say of it."""
        runs, maps = runs * len(on.scenarios), len(set(on.maps))
        return replace(self, criteria=tuple(criteria), explanation=explanation, runs=runs, maps=maps)

    @property
    def verdict(self) -> Verdict:
        """What the criteria say together; see the head of this module."""
        if self.maps < self.least_maps or not self.criteria:
            return "undecided"
        met = [criterion.met for criterion in self.criteria]
        if any(met):
            return "holds" if all(met) else "holds partly"
        return "does not hold" if False in met else "undecided"

    def to_json(self) -> dict[str, Any]:
        """Return one entry of ``claims.json``; numbers that are not finite are yet to be made null."""
        main = self.criteria[0].to_json() if self.criteria else {}
        return {
            "claim": self.claim,
            "verdict": self.verdict,
            "estimate": main.get("estimate"),
            "interval": main.get("interval"),
            "runs": self.runs,
            "key": self.key,
            "question": self.part,
            "measure": main.get("measure"),
            "maps": self.maps,
            "source": self.source,
            "explanation": self.explanation,
            "criteria": [criterion.to_json() for criterion in self.criteria],
        }


def amount(value: float, unit: str = "") -> str:
    """Return a number with its unit, as short as it can be read.

    >>> amount(0.0512, "%"), amount(0.643), amount(1.0042), amount(1.5, "m"), amount(float("nan"))
    ('5.1 %', '0.643', '1.004', '1.5 m', '–')
    """
    if not math.isfinite(value):
        return "–"
    if value < 0.0:
        return "−" + amount(-value, unit)
    if unit == "%":
        percent = 100.0 * value
        return f"{percent:.1f} %" if percent < 99.95 and round(percent, 1) % 1 else f"{percent:.0f} %"
    # ratios near 1 are told apart by their third digit after the point
    text = f"{value:.3f}" if not unit and 1.0 < value < 1.1 else f"{value:.3g}"
    return f"{text} {unit}".rstrip()


def described(interval: Interval, unit: str = "") -> str:
    """Return an estimate with its interval.

    >>> from robocov_app.figures.statistics import Interval
    >>> described(Interval(0.052, 0.031, 0.08), "%")
    '5.2 % (3.1 % to 8 %)'
    """
    estimate, low, high = (amount(each, unit) for each in (interval.estimate, interval.low, interval.high))
    return estimate if math.isnan(interval.low) else f"{estimate} ({low} to {high})"


def verdict_counts(claims: Sequence[Claim]) -> str:
    """Return in words how many claims hold, hold partly, do not hold, or are undecided."""
    found = [claim.verdict for claim in claims]
    counts = {verdict: found.count(verdict) for verdict in VERDICTS if verdict in found}
    parts = [f"{count} {VERDICTS[verdict][count > 1]}" for verdict, count in counts.items()]
    return f"Of {len(claims)} claims {', '.join(parts)}."
