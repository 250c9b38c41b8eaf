"""Groups of runs of the same controller, with labels and styles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

from robocov.controllers.gains import Value, format_value
from robocov.errors import format_count
from robocov_app.figures.statistics import group_by
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles, choose_curve_styles
from robocov_app.report.results.result import Gains, ReportedResult, ReportedRun, Setting
from robocov_app.sweep.study.parameters import format_parameter

MAX_VARIANTS = 8
"""Maximum number of variants that are shown separately. If there are more, each controller is one group."""
TUNED_SUFFIX = " (tuned)"
"""Suffix of the label of a controller whose gains were chosen on runs other than those in the group."""
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_MAX_GAIN_SUFFIX_CHARS = 12
"""Maximum length of a suffix with the name and value of a gain. If it is longer, letters are used instead."""


@dataclass(frozen=True, eq=False)
class RunGroup:
    """Completed runs of one controller.

    Attributes
    ----------
    label : str
    controller : str
    gains : Gains or None
        Gains of all runs. None if the runs have different gains.
    runs : tuple of ReportedRun
    """

    label: str
    controller: str
    gains: Gains | None
    runs: tuple[ReportedRun, ...]

    def select(self, setting: Setting) -> RunGroup:
        """Return the group with only the runs of a setting."""
        return replace(self, runs=tuple(run for run in self.runs if run.setting == setting))


def list_variants(result: ReportedResult) -> list[RunGroup]:
    """List the variants in a result: groups of runs with the same controller and the same gains."""
    runs_by_variant = group_by(result.completed_runs, lambda run: (run.controller, run.gains))
    suffixes: dict[tuple[str, Gains], str] = {}
    for variants in group_by(runs_by_variant, itemgetter(0)).values():
        gain_sets = [gains for _, gains in variants]
        suffixes |= dict(zip(variants, _choose_suffixes(gain_sets), strict=True))
    groups = []
    for (controller, gains), runs in runs_by_variant.items():
        label = f"{runs[0].label}{suffixes[controller, gains]}"
        groups.append(RunGroup(label, controller, gains, tuple(runs)))
    return groups


def _choose_suffixes(gain_sets: Sequence[Gains]) -> list[str]:
    """Return suffixes that distinguish sets of gains of one controller.

    They contain the name and value of the only gain that differs. If several differ, or if the text would be
    too long, they are A, B, ..., Z, A2, B2, ...
    """
    if len(gain_sets) == 1:
        return [""]
    # All sets list the gains of the controller in the same order, so each column belongs to one gain.
    columns = zip(*gain_sets, strict=False)
    differing_columns = [pairs for pairs in columns if len(set(pairs)) > 1]
    if len(differing_columns) == 1:
        suffixes = [f" {name} {format_value(value, digits=4)}" for name, value in differing_columns[0]]
        has_one_name = len({name for name, _ in differing_columns[0]}) == 1
        is_unique = len(set(suffixes)) == len(gain_sets)
        if has_one_name and is_unique and max(map(len, suffixes)) <= _MAX_GAIN_SUFFIX_CHARS:
            return suffixes
    return [_format_letter_suffix(number) for number in range(len(gain_sets))]


def _format_letter_suffix(number: int) -> str:
    """Return the suffix with a number from 0: A, B, ..., Z, A2, B2, ..."""
    round_number, letter_number = divmod(number, len(_LETTERS))
    suffix = f" {_LETTERS[letter_number]}"
    if round_number > 0:
        suffix += str(round_number + 1)
    return suffix


def label_runs(result: ReportedResult) -> dict[ReportedRun, str]:
    """Return, for each completed run, the label of its variant."""
    return {run: group.label for group in list_variants(result) for run in group.runs}


def group_by_controller(result: ReportedResult) -> list[RunGroup]:
    """List one group for each controller, with all of its completed runs regardless of their gains."""
    groups = []
    for controller, runs in group_by(result.completed_runs, lambda run: run.controller).items():
        has_same_gains = len({run.gains for run in runs}) == 1
        gains = runs[0].gains if has_same_gains else None
        groups.append(RunGroup(runs[0].label, controller, gains, tuple(runs)))
    return groups


def list_displayed_groups(result: ReportedResult) -> list[RunGroup]:
    """List the groups of tables and plots: variants, or controllers if there are many variants."""
    variants = list_variants(result)
    if len(variants) > MAX_VARIANTS:
        return group_by_controller(result)
    return variants


def choose_group_styles(result: ReportedResult) -> dict[str, CurveStyle]:
    """Choose a style for each label in a report, which all of its plots and tables use.

    Parameters
    ----------
    result : ReportedResult

    Returns
    -------
    dict of str to CurveStyle
        Displayed groups have different styles. Other variants have the style of their controller. That of
        tuned controllers is chosen by `robocov_app.report.analysis.tuning.choose_tuned_styles`.
    """
    groups = list_displayed_groups(result)
    displayed_controllers = [group.controller for group in groups]
    failed_controllers = dict.fromkeys(
        run.controller for run in result.runs if run.controller not in displayed_controllers
    )
    controllers = [*displayed_controllers, *failed_controllers]
    controller_styles = choose_controller_styles(controllers)
    styles = {}
    for run in result.runs:
        styles[run.label] = controller_styles[run.controller]
    for variant in list_variants(result):
        styles[variant.label] = controller_styles[variant.controller]
    # `controllers` lists the groups first. The styles of controllers whose runs all failed are not used.
    for group, style in zip(groups, choose_curve_styles(controllers), strict=False):
        styles[group.label] = style
    return styles


def list_settings(result: ReportedResult) -> list[Setting]:
    """List the different settings of completed runs."""
    return list(dict.fromkeys(run.setting for run in result.completed_runs))


def format_setting(result: ReportedResult, setting: Setting) -> str:
    """Format a setting: its map, and what else distinguishes it from other settings of the result."""
    map_name, robots, team = setting
    texts = [map_name]
    if len({size for _, size, _ in list_settings(result)}) > 1:
        texts.append(format_count(robots, "robot"))
    texts += [f"{name.replace('_', ' ')} {format_parameter(name, value)}" for name, value in team]
    return ", ".join(texts)


def find_varying_gains(result: ReportedResult) -> dict[str, list[str]]:
    """Return the gains that have several values, each with the controllers in which it varies."""
    values: dict[tuple[str, str], set[Value]] = {}
    for run in result.completed_runs:
        for name, value in run.gains:
            values.setdefault((name, run.controller), set()).add(value)
    controllers: dict[str, list[str]] = {}
    for (name, controller), different_values in values.items():
        if len(different_values) > 1:
            controllers.setdefault(name, []).append(controller)
    return controllers


def format_gains(gains: Sequence[tuple[str, Value]], units: Mapping[str, str]) -> str:
    """Format gains and their units as a line of text.

    Examples
    --------
    >>> format_gains([("k_rep", 0.3), ("attraction_limit", None)], {"k_rep": "N m³"})
    'k_rep 0.3 N m³, attraction_limit none'
    """
    texts = []
    for name, value in gains:
        unit = "" if value is None else units.get(name, "")
        texts.append(f"{name} {format_value(value)} {unit}".rstrip())
    return ", ".join(texts)
