"""Criteria and claims, and the verdicts that follow from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, TypeAlias

from robocov_app.figures.statistics import Interval, adjust_p_values
from robocov_app.replication.claims.thresholds import ALPHA, MIN_MAPS
from robocov_app.replication.formatting import format_amount, format_interval
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes, PairedComparison

Verdict: TypeAlias = Literal["holds", "holds partly", "does not hold", "undecided"]

VERDICTS: dict[Verdict, tuple[str, str]] = {
    "holds": ("holds", "hold"),
    "holds partly": ("holds partly", "hold partly"),
    "does not hold": ("does not hold", "do not hold"),
    "undecided": ("is undecided", "are undecided"),
}
"""Predicates of each verdict, for one claim and for several."""

LIMITED = 7
"""Number of the question about limited ranges. Questions 1 to 7 are on the paper's claims."""
GOALS = 8
RIVALS = 9
EXTENSIONS = 10
"""Numbers of the questions beyond the paper."""


class CriterionResult(NamedTuple):
    """Result of the test of a criterion."""

    is_met: bool | None
    """Whether the whole interval is in the range; None if only part of it is, or if it is unknown."""
    p_value: float
    """The p-value of the hypothesis that the true value is outside the range."""
    refutation_p_value: float
    """The p-value of the hypothesis that the true value is in the range."""


@dataclass(frozen=True)
class Criterion:
    """A measure whose interval has to lie in a range for a claim to hold.

    Parameters
    ----------
    measure : str
        Description of the measured value.
    interval : Interval
        Its estimate and 95% interval.
    low, high : float
        Ends of the range, both included.
    unit : str
        "", "%", "m" or "s". For "%", a value of 0.5 is written as 50%.
    """

    measure: str
    interval: Interval
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""

    @property
    def is_met(self) -> bool | None:
        """Whether the whole interval is in the range; None if only part of it is, or if it is unknown."""
        if self.low <= self.interval.low and self.interval.high <= self.high:
            return True
        if self.interval.high < self.low or self.interval.low > self.high:
            return False
        return None

    @property
    def p_value(self) -> float:
        """The p-value of the hypothesis that the true value is outside the range."""
        return self.interval.compute_p_value(self.low, self.high)

    @property
    def refutation_p_value(self) -> float:
        """The p-value of the hypothesis that the true value is in the range."""
        # The true value is outside the range if it is below the lower end or above the upper end. There is a
        # one-sided test for each end; the lower p-value counts, adjusted for their number by Bonferroni.
        p_values = []
        if math.isfinite(self.low):
            p_values.append(self.interval.compute_p_value(-math.inf, self.low))
        if math.isfinite(self.high):
            p_values.append(self.interval.compute_p_value(self.high, math.inf))
        return min([1.0, *(len(p_values) * p_value for p_value in p_values)])

    @property
    def result(self) -> CriterionResult:
        """The result of its test."""
        return CriterionResult(self.is_met, self.p_value, self.refutation_p_value)

    @property
    def range_text(self) -> str:
        """The range as text, for example "at most 5%"."""
        low = format_amount(self.low, self.unit)
        high = format_amount(self.high, self.unit)
        if math.isinf(self.high):
            return f"at least {low}"
        if math.isinf(self.low):
            return f"at most {high}"
        return f"between {low} and {high}"

    @property
    def result_text(self) -> str:
        """The estimate with its interval as text."""
        return format_interval(self.interval, self.unit)

    def to_json(self) -> dict[str, Any]:
        """Return the content of the criterion in ``claims.json``."""
        return {
            "measure": self.measure,
            "unit": "1" if self.unit in ("", "%") else self.unit,
            "estimate": self.interval.estimate,
            "interval": [self.interval.low, self.interval.high],
            "at_least": self.low,
            "at_most": self.high,
            "met": self.is_met,
            "p": self.p_value,
            "p_refutation": self.refutation_p_value,
        }


@dataclass(frozen=True)
class Claim:
    """A claim with its criteria and verdict.

    Parameters
    ----------
    key : str
        Identifier that does not change between versions, for example "nonconvex-final-shared".
    question : int
        Number of the question that the claim belongs to.
    text : str
        The claim in our words.
    source : str
        Where the paper makes the claim; empty if the question is ours.
    gains : str
        Gains with which the claim is tested; empty if there is no choice.
    criteria : tuple of Criterion
        The first is the main criterion, whose estimate represents the claim.
    runs, maps : int
        Number of simulated runs that the criteria are based on, and of different maps among them.
    explanation : str
        Sentences that explain the verdict.
    min_maps : int
        Minimum number of maps for a verdict other than "undecided".
    adjusted_p_value : float or None
        The p-value adjusted by Holm for all claims that are tested together; None if the claim is
        tested alone.
    family_size : int
        Number of claims that are tested together.
    """

    key: str
    question: int
    text: str
    source: str = ""
    criteria: tuple[Criterion, ...] = ()
    runs: int = 0
    maps: int = 0
    explanation: str = "No run can decide it."
    min_maps: int = MIN_MAPS
    adjusted_p_value: float | None = None
    family_size: int = 1
    gains: str = ""

    def judge(
        self,
        criteria: Iterable[Criterion],
        explanation: str,
        outcomes: Outcomes | GainOutcomes,
        runs_per_instance: int,
    ) -> Claim:
        """Return the claim with criteria, an explanation, and the numbers of runs and maps.

        Parameters
        ----------
        criteria : iterable of Criterion
        explanation : str
        outcomes : Outcomes or GainOutcomes
            Outcomes that the criteria are based on.
        runs_per_instance : int
            Number of runs on each of their problem instances.
        """
        return replace(
            self,
            criteria=tuple(criteria),
            explanation=explanation,
            runs=runs_per_instance * len(outcomes.instances),
            maps=len(set(outcomes.maps)),
        )

    @property
    def p_value(self) -> float:
        """The highest p-value of the criteria."""
        return max((criterion.p_value for criterion in self.criteria), default=1.0)

    @property
    def p_value_text(self) -> str:
        """The p-values as text, for example "p = 0.001, Holm-adjusted 0.007"."""
        text = f"p = {format_amount(self.p_value)}"
        if self.adjusted_p_value is not None:
            text += f", Holm-adjusted {format_amount(self.adjusted_p_value)}"
        return text

    @property
    def verdict(self) -> Verdict:
        """The verdict by `derive_verdict`; it is undecided on too few maps."""
        if self.maps < self.min_maps:
            return "undecided"
        results = [criterion.result for criterion in self.criteria]
        return derive_verdict(results, self.adjusted_p_value, self.family_size)

    def to_json(self) -> dict[str, Any]:
        """Return the content of the claim in ``claims.json``."""
        main = self.criteria[0].to_json() if self.criteria else {}
        return {
            "claim": self.text,
            "gains": self.gains,
            "verdict": self.verdict,
            "estimate": main.get("estimate"),
            "interval": main.get("interval"),
            "p": self.p_value,
            "p_adjusted": self.adjusted_p_value,
            "runs": self.runs,
            "key": self.key,
            "question": self.question,
            "measure": main.get("measure"),
            "maps": self.maps,
            "source": self.source,
            "explanation": self.explanation,
            "criteria": [criterion.to_json() for criterion in self.criteria],
        }


def derive_verdict(
    results: Sequence[CriterionResult], adjusted_p_value: float | None, family_size: int
) -> Verdict:
    """Derive the verdict on a claim from the results of its criteria.

    Parameters
    ----------
    results : sequence of CriterionResult
        One for each criterion.
    adjusted_p_value : float or None
        The p-value of the claim, adjusted by Holm; None if the claim is tested alone.
    family_size : int
        Number of claims that are tested together.

    Returns
    -------
    Verdict
        The first of these that applies:

        - "holds" if all criteria are met, and the adjusted p-value is significant;
        - "holds partly" if a criterion is met, and its p-value, adjusted by Bonferroni, is significant;
        - "does not hold" if no criterion is met, and one is refuted with a p-value that is significant after
          this adjustment;
        - "undecided".

    Notes
    -----
    The verdict is monotone: if one criterion is better met, with lower p-values, and all else is equal, the
    verdict is the same or better, in the order "does not hold", "undecided", "holds partly", "holds".
    """

    def is_significant(p_value: float) -> bool:
        return family_size == 1 or family_size * p_value <= ALPHA

    met = [result for result in results if result.is_met]
    refuted = [result for result in results if result.is_met is False]
    are_all_met = len(met) == len(results) > 0
    if are_all_met and (adjusted_p_value is None or adjusted_p_value <= ALPHA):
        return "holds"
    if any(is_significant(result.p_value) for result in met):
        return "holds partly"
    if not met and any(is_significant(result.refutation_p_value) for result in refuted):
        return "does not hold"
    return "undecided"


def adjust_claims(claims: Sequence[Claim]) -> list[Claim]:
    """Adjust the p-values of claims that are tested together by Holm's method.

    Claims without criteria are included: their p-value is 1.
    """
    adjusted = adjust_p_values({claim.key: claim.p_value for claim in claims})
    return [replace(claim, adjusted_p_value=adjusted[claim.key], family_size=len(claims)) for claim in claims]


def summarize_verdicts(claims: Sequence[Claim]) -> str:
    """Return a sentence that counts the verdicts: "Of 3 claims, 2 hold, 1 is undecided."."""
    verdicts = [claim.verdict for claim in claims]
    texts = []
    for verdict, (singular, plural) in VERDICTS.items():
        count = verdicts.count(verdict)
        if count:
            texts.append(f"{count} {plural if count > 1 else singular}")
    return f"Of {len(claims)} claims, {', '.join(texts)}."


def judge_pairs(
    claim: Claim,
    pairs: PairedComparison | None,
    *,
    ratio_measure: str,
    wins_measure: str,
    explain: Callable[[PairedComparison], str],
    max_ratio: float = 1.0,
    min_wins: float = 0.5,
) -> Claim:
    """Judge whether the first of two contenders has the lower values, in the median and in most pairs.

    Parameters
    ----------
    claim : Claim
    pairs : PairedComparison or None
        If it is None, the claim is returned unchanged.
    ratio_measure, wins_measure : str
        Names of the median ratio, and of the fraction of pairs in which the first value is lower.
    explain : callable
        Returns the explanation of the verdict.
    max_ratio, min_wins : float
        Bounds of these measures.
    """
    if pairs is None:
        return claim
    criteria = (
        Criterion(ratio_measure, pairs.median_ratio, high=max_ratio),
        Criterion(wins_measure, pairs.wins, low=min_wins, unit="%"),
    )
    return claim.judge(criteria, explain(pairs), pairs.outcomes, runs_per_instance=2)
