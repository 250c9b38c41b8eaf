"""The outcome of a result as text: main findings, problems of the robots, and missing runs."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from robocov.errors import format_count
from robocov_app.report.analysis.comparisons import GroupComparison
from robocov_app.report.analysis.groups import label_runs
from robocov_app.report.facts import format_densities
from robocov_app.report.results.result import ReportedResult, ReportedRun

_MAX_HEADLINES = 6
"""Maximum number of comparisons among the main findings."""
_MAX_LISTED_REASONS = 3


def list_findings(result: ReportedResult, comparisons: Sequence[GroupComparison]) -> list[str]:
    """List the main findings: one sentence or a few for the top of a section.

    Parameters
    ----------
    result : ReportedResult
    comparisons : sequence of GroupComparison

    Returns
    -------
    list of str
    """
    runs = [run for run in result.completed_runs if np.isfinite(run.final_distance)]
    if not runs:
        return ["No run has a result."]
    if result.kind == "sweep":
        return _summarize_sweep(runs, comparisons)
    if len(runs) == 1:
        return [_summarize_run(result, runs[0])]
    return [_summarize_comparison(result, runs)]


def _summarize_sweep(runs: Sequence[ReportedRun], comparisons: Sequence[GroupComparison]) -> list[str]:
    """Return the outcomes of comparisons as sentences, or the median of all runs if there are none."""
    paired = [comparison for comparison in comparisons if comparison.pair_count > 1]
    if not paired:
        median = np.median([run.final_distance for run in runs])
        return [f"{format_count(len(runs), 'run')}, median final distance {median:.3f} m."]
    sentences = [comparison.format_headline() for comparison in paired[:_MAX_HEADLINES]]
    if len(paired) > _MAX_HEADLINES:
        sentences.append(f"{format_count(len(paired) - _MAX_HEADLINES, 'more comparison')} below.")
    return sentences


def _summarize_run(result: ReportedResult, run: ReportedRun) -> str:
    """Describe the only run: final mean distance, gap to the reference, and whether it settled."""
    text = f"At the end the nearest robot is {run.final_distance:.3f} m away on average"
    gap = result.compute_gap(run)
    if np.isfinite(gap):
        text += f", a gap of {100 * gap:.1f}% to the best known placement"
    settled_at = run.metrics.get("settled_at_s")
    if settled_at is None:
        return f"{text}; not settled by the end."
    return f"{text}; settled after {settled_at:.1f} s."


def _summarize_comparison(result: ReportedResult, runs: Sequence[ReportedRun]) -> str:
    """List the final mean distances of all runs, the lowest first, in a sentence."""
    lowest = min(run.final_distance for run in runs)
    labels = label_runs(result)
    texts = []
    for run in sorted(runs, key=lambda run: run.final_distance):
        text = f"{labels[run]} {run.final_distance:.3f} m"
        excess = _format_excess(run.final_distance, lowest)
        if excess:
            text += f" (+{excess})"
        texts.append(text)
    subject = "Final mean distance to the nearest robot"
    if format_densities(result):
        subject += ", weighted by φ"
    if len(texts) == 2 and lowest > 0:
        best, other = sorted(runs, key=lambda run: run.final_distance)
        excess = _format_excess(other.final_distance, lowest)
        comparison = f"{excess} more" if excess else "practically the same"
        return (
            f"{subject}: {lowest:.3f} m with {labels[best]}, {other.final_distance:.3f} m with "
            f"{labels[other]}, which is {comparison}."
        )
    return f"{subject}: {', '.join(texts)}."


def _format_excess(distance: float, lowest: float) -> str:
    """Return by how many percent a mean distance exceeds the lowest one.

    The text is empty if the excess rounds to 0%, or if the lowest mean distance is 0.
    """
    if lowest == 0.0:
        return ""
    text = f"{distance / lowest - 1:.0%}"
    return "" if text == "0%" else text


def describe_incomplete_runs(result: ReportedResult) -> list[str]:
    """Describe how many runs failed, cannot be read, or are missing, in one sentence each."""
    sentences = []
    if result.failed_runs:
        sentences.append(_describe_failed_runs(result))
    if result.damaged_runs:
        reasons = [f"{run.folder} ({run.reason})" for run in result.damaged_runs]
        runs = format_count(len(reasons), "run")
        verb = _choose_verb(len(reasons))
        sentences.append(f"{runs} cannot be read and {verb} left out: {_list_reasons(reasons)}")
    if result.missing_count:
        runs = format_count(result.expected_count, "run")
        verb = _choose_verb(result.missing_count)
        sentences.append(f"Not finished: {result.missing_count} of {runs} {verb} missing.")
    return sentences


def _choose_verb(count: int) -> str:
    """Return "is" for one item, "are" for several."""
    return "is" if count == 1 else "are"


def _describe_failed_runs(result: ReportedResult) -> str:
    """Describe how many runs of each controller failed, and why."""
    run_counts = Counter(run.label for run in result.runs)
    failure_counts = Counter(run.label for run in result.failed_runs)
    controllers = ", ".join(
        f"{label} {count} of {run_counts[label]}" for label, count in failure_counts.most_common()
    )
    reasons = _list_reasons([run.error or "" for run in result.failed_runs])
    runs = format_count(len(result.runs), "run")
    return f"{len(result.failed_runs)} of {runs} failed ({controllers}): {reasons}"


def _list_reasons(reasons: Sequence[str]) -> str:
    """List the first distinct reasons, followed by the number of others."""
    different_reasons = list(dict.fromkeys(reasons))
    text = "; ".join(different_reasons[:_MAX_LISTED_REASONS])
    if len(different_reasons) > _MAX_LISTED_REASONS:
        text += f"; and {format_count(len(different_reasons) - _MAX_LISTED_REASONS, 'more reason')}"
    return f"{text}."


def list_problems(result: ReportedResult) -> list[str]:
    """Describe in how many runs there were contacts, stuck robots, and teams that had not settled."""
    runs = result.completed_runs
    max_stuck = max((run.metrics.get("stuck_robots") or 0 for run in runs), default=0)
    stuck_problem = "a robot was stuck at the end"
    if max_stuck > 1:
        limit = "" if len(runs) == 1 else "up to "
        stuck_problem = f"{limit}{max_stuck} robots were stuck at the end"
    counts = {
        "a robot touched a wall or another robot": sum(
            (run.metrics.get("contacts") or 0) > 0 for run in runs
        ),
        stuck_problem: sum((run.metrics.get("stuck_robots") or 0) > 0 for run in runs),
        "the team had not settled by the end": sum(_is_unsettled(run) for run in runs),
    }
    problems = {problem: count for problem, count in counts.items() if count}
    if len(runs) == 1:
        return [f"{problem[0].upper()}{problem[1:]}." for problem in problems]
    return [f"In {count} of {len(runs)} runs {problem}." for problem, count in problems.items()]


def _is_unsettled(run: ReportedRun) -> bool:
    """Return whether the team of a run had not settled by the end."""
    return run.has_metric("mean_distance_m") and not run.has_metric("settled_at_s")
