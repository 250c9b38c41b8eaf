"""Tables of controllers with their gains."""

from collections.abc import Sequence

from robocov.controllers.gains import Value, format_value
from robocov_app.report.analysis.groups import RunGroup, format_gains, list_displayed_groups, list_variants
from robocov_app.report.results.result import ReportedResult
from robocov_app.report.tables.table import NO_VALUE, PageTable

MAX_GAIN_SETS = 200
"""Maximum number of sets of gains that are listed."""


def build_controllers_table(result: ReportedResult) -> PageTable:
    """Build the table of controllers, including controllers whose runs all failed."""
    groups = list_displayed_groups(result)
    controllers = {group.controller for group in groups}
    for run in result.failed_runs:
        if run.controller not in controllers:
            controllers.add(run.controller)
            groups.append(RunGroup(run.label, run.controller, None, (run,)))
    return _build_gains_table("Controllers and their gains", groups, result)


def build_gain_sets_table(result: ReportedResult) -> PageTable | None:
    """Build the table of all sets of gains; return None if another table shows them, or if there are many."""
    variants = list_variants(result)
    if len(variants) == len(list_displayed_groups(result)) or len(variants) > MAX_GAIN_SETS:
        return None
    return _build_gains_table("Sets of gains", variants, result)


def _build_gains_table(caption: str, groups: Sequence[RunGroup], result: ReportedResult) -> PageTable:
    """Build a table of groups with their gains."""
    rows = []
    for group in groups:
        if group.gains is None:
            gains = _format_gain_ranges(group, result)
        else:
            gains = format_gains(group.gains, result.gain_units)
        rows.append((group.label, group.controller, gains or NO_VALUE))
    return PageTable(caption, ("Controller", "Name", "Gains"), rows, text_columns=frozenset({1, 2}))


def _format_gain_ranges(group: RunGroup, result: ReportedResult) -> str:
    """Format the gains of a group, each with the range of its values."""
    values: dict[str, list[Value]] = {}
    for run in group.runs:
        for name, value in run.gains:
            values.setdefault(name, []).append(value)
    texts = []
    for name, gain_values in values.items():
        texts.append(f"{name} {_format_range(gain_values, result.gain_units.get(name, ''))}")
    return ", ".join(texts)


def _format_range(values: Sequence[Value], unit: str) -> str:
    """Format the values of a gain: the range of numbers, or a list of texts; "or none" if some are None."""
    if any(isinstance(value, str) for value in values):
        return " or ".join(dict.fromkeys(map(format_value, values)))
    numbers = [value for value in values if isinstance(value, int | float)]
    if not numbers:
        return "none"
    minimum = min(numbers)
    maximum = max(numbers)
    low = format_value(minimum, digits=4)
    high = format_value(maximum, digits=4)
    if low == high:
        # Sampled gains have six significant digits, so they may differ in the fifth or sixth.
        low = format_value(minimum)
        high = format_value(maximum)
    text = low if low == high else f"{low} to {high}"
    text += f" {unit}".rstrip()
    if len(numbers) < len(values):
        text += " or none"
    return text
