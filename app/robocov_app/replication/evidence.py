"""Evidence on every controller: summaries of its outcomes, comparisons, and its profile."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from robocov.controllers import get_gain_values, get_information, load_controller_class, make_controller
from robocov.controllers.gains import format_value
from robocov.typing import FloatArray
from robocov_app.figures.statistics import Interval, bootstrap, estimate_median_time, group_by
from robocov_app.replication.assets import ASSETS
from robocov_app.replication.design.contenders import OWN, Contender
from robocov_app.replication.design.studies import AXES, STRONG_INDEX
from robocov_app.replication.formatting import NO_VALUE, capitalize, format_amount
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes, PairedComparison
from robocov_app.replication.results.study_results import IDEAL, BeyondResults, Degradation

_MAX_WORST_MAPS = 3
"""Number of maps that are named as the worst of a controller."""
_MEDIAN_MEASURES = ("final", "over_run", "path", "work")
_MIN_REPORTED_FRACTION = 0.05
"""A failure is reported if it occurs in more than this fraction of the runs."""


class ControllerProfile(NamedTuple):
    """Name, source and behavior of a controller, and the information that it uses."""

    controller: str
    label: str
    information: str
    """The information that it uses."""
    short_source: str
    source: str
    behavior: str


@dataclass(frozen=True)
class ContenderSummary:
    """Summary of the outcomes of one contender.

    Parameters
    ----------
    contender : Contender
    runs : int
    gap : Interval
        Median of J / J_ref - 1.
    quartiles : tuple of float
        Quartiles of the gap.
    contact_fraction : float
        Fraction of runs with contact.
    blocked_fraction : float
        Fraction of robots that have a wall between them and their goals at the end; nan if the controller has
        no goals.
    rest_fraction : float
        Fraction of runs that come to rest.
    rest_time : float
        Kaplan-Meier estimate of the median time until rest, s; inf if most runs do not come to rest.
    medians : Mapping
        Medians of J at the end (``final``) and over the run (``over_run``), of the path length of a robot, m
        (``path``), and of the work of the team, J (``work``).
    """

    contender: Contender
    runs: int
    gap: Interval
    quartiles: tuple[float, float]
    contact_fraction: float
    blocked_fraction: float
    rest_fraction: float
    rest_time: float
    medians: Mapping[str, float]


class OwnComparison(NamedTuple):
    """Comparison of one of our controllers with a contender."""

    own_label: str
    label: str
    pairs: PairedComparison


@dataclass(frozen=True)
class ControllerEvidence:
    """Evidence on a registered controller.

    Parameters
    ----------
    profile : ControllerProfile
    summaries : sequence of ContenderSummary
        Summaries of its contenders, the best one first. Everything else is about the best one.
    medians_by_map : Mapping
        Median gap on each map.
    comparisons : sequence of OwnComparison
    failures : str
        Sentences on where it fails.
    tuning : str
        Sentence on how its gains were tuned; empty if they were not.
    """

    profile: ControllerProfile
    summaries: Sequence[ContenderSummary]
    medians_by_map: Mapping[str, float]
    comparisons: Sequence[OwnComparison]
    failures: str
    tuning: str


@cache
def load_profile(controller: str) -> ControllerProfile:
    """Return the profile of a controller from ``controllers.toml``, or without an entry, its summary."""
    controller_class = load_controller_class(controller)
    profiles = tomllib.loads((ASSETS / "controllers.toml").read_text(encoding="utf-8"))
    entry = profiles.get(controller, {})
    source = entry.get("source", "")
    if not entry.get("read", True):
        source = source.removesuffix(".") + "; implemented from general knowledge, not from its text."
    behavior = entry.get("does") or f"{capitalize(controller_class.summary).rstrip('.')}."
    return ControllerProfile(
        controller=controller,
        label=controller_class.label,
        information=get_information(controller_class),
        short_source=entry.get("short", NO_VALUE),
        source=source,
        behavior=behavior,
    )


def summarize_contenders(
    outcomes: Outcomes, contenders: Iterable[Contender], duration: float
) -> list[ContenderSummary]:
    """Summarize the outcomes of contenders.

    Parameters
    ----------
    outcomes : Outcomes
    contenders : iterable of Contender
        Contenders without runs that have a gap are left out.
    duration : float
        Duration of the runs, s.

    Returns
    -------
    list of ContenderSummary
    """
    summaries = []
    for contender in contenders:
        known = outcomes.select_finite("gap", contender.key)
        if not known.instances:
            continue
        gaps = known.get_values(contender.key, "gap")
        low, high = np.quantile(gaps, [0.25, 0.75]).tolist()
        settled = known.get_values(contender.key, "settled")
        rest_times = settled[np.isfinite(settled)]
        censored = np.full(len(settled) - len(rest_times), duration)
        medians = {name: np.median(known.get_values(contender.key, name)) for name in _MEDIAN_MEASURES}
        summaries.append(
            ContenderSummary(
                contender,
                runs=len(gaps),
                gap=bootstrap(gaps, clusters=known.maps),
                quartiles=(low, high),
                contact_fraction=_compute_positive_fraction(known.get_values(contender.key, "contacts")),
                blocked_fraction=_compute_mean(known.get_values(contender.key, "blocked")),
                rest_fraction=len(rest_times) / len(settled),
                rest_time=estimate_median_time(rest_times, censored),
                medians=medians,
            )
        )
    return summaries


def _compute_positive_fraction(counts: FloatArray) -> float:
    """Return the fraction of positive values among the finite counts, (m,); nan without finite counts."""
    finite = counts[np.isfinite(counts)]
    return float((finite > 0).mean()) if len(finite) else float("nan")


def _compute_mean(values: FloatArray) -> float:
    """Return the mean of the finite values, (m,); nan if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else float("nan")


def rank_contenders(results: BeyondResults) -> list[ContenderSummary]:
    """Return the summaries of all contenders by ascending median gap."""
    summaries = summarize_contenders(results.outcomes, results.contenders, results.plan.duration)
    return sorted(summaries, key=lambda summary: summary.gap.estimate)


def collect_evidence(
    results: BeyondResults, summaries: Iterable[ContenderSummary]
) -> list[ControllerEvidence]:
    """Collect the evidence on every controller, in the order of the summaries."""
    by_controller = group_by(summaries, lambda summary: summary.contender.controller)
    evidence = []
    for name, own_summaries in by_controller.items():
        best = own_summaries[0]
        tuning = describe_tuning(name, results.gains[name]) if name in results.gains else ""
        evidence.append(
            ControllerEvidence(
                load_profile(name),
                own_summaries,
                medians_by_map=results.outcomes.compute_medians_by_map(best.contender.key),
                comparisons=_list_own_comparisons(results, own_summaries),
                failures=describe_failures(results.outcomes, best),
                tuning=tuning,
            )
        )
    return evidence


def _list_own_comparisons(
    results: BeyondResults, summaries: Sequence[ContenderSummary]
) -> list[OwnComparison]:
    """List the comparisons of our own controllers with the contenders in the summaries."""
    comparisons = []
    for own in OWN:
        for summary in summaries:
            other = summary.contender
            if other.key == own.key:
                continue
            pairs = results.outcomes.compare(own.key, other.key)
            if pairs is not None:
                comparisons.append(OwnComparison(own.label, other.label, pairs))
    return comparisons


def collect_degradations(
    results: BeyondResults, summaries: Iterable[ContenderSummary]
) -> dict[str, list[Degradation]]:
    """Return the degradations of each controller: without disturbances, then with each strong one.

    Parameters
    ----------
    results : BeyondResults
    summaries : iterable of ContenderSummary
        Determine the order of the controllers.

    Returns
    -------
    dict
        Degradations by controller.
    """
    by_value = {(each.controller, each.axis, each.value): each for each in results.degradations}
    names = dict.fromkeys(summary.contender.controller for summary in summaries)
    degradations = {}
    for name in names:
        strong = [by_value[name, axis, values[STRONG_INDEX]] for axis, values in AXES.items()]
        degradations[name] = [by_value[name, IDEAL, None], *strong]
    return degradations


def describe_failures(outcomes: Outcomes, summary: ContenderSummary) -> str:
    """Return sentences about the worst maps and runs of a contender, and the failures that it often has."""
    key = summary.contender.key
    medians = outcomes.compute_medians_by_map(key)
    worst_maps = sorted(medians.items(), key=lambda item: -item[1])[:_MAX_WORST_MAPS]
    highest = ", ".join(f"{name} {format_amount(median, '%')}" for name, median in worst_maps)
    gaps = outcomes.get_values(key, "gap")
    worst = int(np.nanargmax(gaps))
    text = (
        f"Highest medians: {highest}. Worst run: gap {format_amount(gaps[worst], '%')} "
        f"({outcomes.instances[worst]})."
    )
    failures = _list_failures(summary)
    return f"{text} {failures}" if failures else text


def _list_failures(summary: ContenderSummary) -> str:
    """Return a sentence with the frequent failures, or that there was no contact; empty otherwise."""
    failures = (
        (summary.contact_fraction, "robots touch a wall or each other in {} of the runs"),
        (summary.blocked_fraction, "a wall is between {} of the robots and their goals at the end"),
        (1.0 - summary.rest_fraction, "the team has not settled at the end in {} of the runs"),
    )
    texts = []
    for fraction, description in failures:
        if fraction > _MIN_REPORTED_FRACTION:
            texts.append(description.format(format_amount(fraction, "%")))
    if texts:
        return f"{capitalize('; '.join(texts))}."
    return "No contact in any run." if summary.contact_fraction == 0.0 else ""


def describe_tuning(controller: str, outcomes: GainOutcomes) -> str:
    """Return a sentence on the best gains of a controller, and their advantage over other sets."""
    grid = outcomes.select_complete()
    if not grid.instances:
        return "Gains: its defaults; in every scenario of the tuning some run failed."
    best = grid.find_best()
    worst = int(np.argmax(grid.relative_costs.mean(axis=1)))
    varied = [name for name in grid.gains[best] if len({gains[name] for gains in grid.gains}) > 1]
    values = ", ".join(f"{name} {format_value(grid.gains[best][name])}" for name in varied)
    defaults = dict(get_gain_values(make_controller(controller)))
    default_rows = (row for row, gains in enumerate(grid.gains) if dict(gains) == defaults)
    default_row = next(default_rows, None)
    means = [format_amount(mean) for mean in grid.relative_costs.mean(axis=1)]

    def describe_ratio(row: int) -> str:
        ratio = float(np.median(grid.relative_costs[best] / grid.relative_costs[row]))
        return f"median ratio {format_amount(ratio)}"

    as_default = ", the default" if default_row == best else ""
    text = (
        f"Gains: {values}{as_default}: of {len(grid.gains)} sets, the best one on "
        f"{len(set(grid.maps))} tuning maps, mean J/J_ref {means[best]}"
    )
    if default_row is not None and default_row != best:
        text += f"; with its defaults {means[default_row]}, {describe_ratio(default_row)}"
    return f"{text}; with the worst set {means[worst]}, {describe_ratio(worst)}."
