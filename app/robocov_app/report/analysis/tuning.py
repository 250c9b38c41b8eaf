"""Choice of the groups to compare. Controllers with several sets of gains are tuned fairly."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.errors import format_count
from robocov_app.figures.statistics import group_by
from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.report.analysis.groups import (
    TUNED_SUFFIX,
    RunGroup,
    label_runs,
    list_displayed_groups,
    list_variants,
)
from robocov_app.report.analysis.scaling import Scales, compute_medians, scale_distance
from robocov_app.report.results.result import Gains, ReportedResult, ReportedRun

_MAX_LISTED_GAINS = 3
"""Maximum number of sets of gains that are listed for a tuned controller."""

_Fold: TypeAlias = object
"""A map, or a start and seed. The gains for the runs of a fold are chosen on the runs of all other folds."""


class ComparedGroups(NamedTuple):
    """Groups to compare.

    Attributes
    ----------
    groups : list of RunGroup
        Variants, or controllers with tuned gains.
    note : str
        Description of how gains were chosen; empty if no controller has several sets of gains.
    """

    groups: list[RunGroup]
    note: str


class _Tuning(NamedTuple):
    """The data from which gains are chosen.

    Attributes
    ----------
    folds : list
    get_fold : callable
        Returns the fold of a run.
    has_several_maps : bool
        Whether the folds are maps; otherwise, each is a start and seed.
    scales : Scales
    runs : dict of (controller, gains) to list of ReportedRun
        All runs of each variant, including failed ones.
    """

    folds: list[_Fold]
    get_fold: Callable[[ReportedRun], _Fold]
    has_several_maps: bool
    scales: Scales
    runs: dict[tuple[str, Gains], list[ReportedRun]]


def choose_compared_groups(result: ReportedResult) -> ComparedGroups:
    """Choose the groups to compare.

    If there are several controllers, those with several sets of gains are tuned: the gains for each map are
    those with the lowest median on all other maps. With only one map, this applies to each start and seed
    instead. So gains are never compared on the runs on which they were chosen.

    Parameters
    ----------
    result : ReportedResult

    Returns
    -------
    ComparedGroups
    """
    variants = list_variants(result)
    variants_by_controller = group_by(variants, lambda group: group.controller)
    if len(variants_by_controller) == len(variants):
        return ComparedGroups(variants, "")
    if len(variants_by_controller) < 2:
        return ComparedGroups(variants, "Every set of gains is compared on its own; none was chosen.")
    has_several_maps = len({run.map for run in result.completed_runs}) > 1
    get_fold = _get_map if has_several_maps else _get_start_and_seed
    folds = list(dict.fromkeys(get_fold(run) for run in result.completed_runs))
    if len(folds) < 2:
        first_variants = [group_variants[0] for group_variants in variants_by_controller.values()]
        note = "There is only one case, too few to choose gains fairly: the first gains of each are compared."
        return ComparedGroups(first_variants, note)
    tuning = _Tuning(
        folds=folds,
        get_fold=get_fold,
        has_several_maps=has_several_maps,
        scales=compute_medians(result),
        runs=group_by(result.runs, lambda run: (run.controller, run.gains)),
    )
    groups = []
    choices = []
    for controller_variants in variants_by_controller.values():
        if len(controller_variants) == 1:
            groups += controller_variants
            continue
        group, choice = _tune(controller_variants, tuning)
        groups.append(group)
        choices.append(choice)
    return ComparedGroups(groups, _describe_tuning(choices, has_several_maps=has_several_maps))


def choose_tuned_styles(
    result: ReportedResult, groups: Sequence[RunGroup], styles: Mapping[str, CurveStyle]
) -> dict[str, CurveStyle]:
    """Choose the styles of tuned controllers.

    Parameters
    ----------
    result : ReportedResult
    groups : sequence of RunGroup
        Compared groups.
    styles : mapping of str to CurveStyle
        Style of each variant.

    Returns
    -------
    dict of str to CurveStyle
        By label. If the same gains were chosen for all runs, the style is that of these gains; otherwise no
        displayed group has the style.
    """
    variant_labels = label_runs(result)
    tuned_groups = [group for group in groups if group.label.endswith(TUNED_SUFFIX)]
    displayed_controllers = [group.controller for group in list_displayed_groups(result)]
    tuned_controllers = [group.controller for group in tuned_groups]
    all_styles = choose_curve_styles([*displayed_controllers, *tuned_controllers])
    own_styles = all_styles[len(displayed_controllers) :]
    tuned_styles = {}
    for group, own_style in zip(tuned_groups, own_styles, strict=True):
        chosen_labels = {variant_labels[run] for run in group.runs}
        tuned_styles[group.label] = own_style
        if len(chosen_labels) == 1:
            tuned_styles[group.label] = styles[chosen_labels.pop()]
    return tuned_styles


def _get_map(run: ReportedRun) -> _Fold:
    """Return the fold of a run if there are several maps."""
    return run.map


def _get_start_and_seed(run: ReportedRun) -> _Fold:
    """Return the fold of a run if there is only one map."""
    return run.start, run.seed


def _tune(variants: Sequence[RunGroup], tuning: _Tuning) -> tuple[RunGroup, str]:
    """Return a group of a controller's runs with tuned gains, and a description of the chosen gains."""
    runs: list[ReportedRun] = []
    labels = []
    for fold in tuning.folds:
        best = min(variants, key=partial(_rate_elsewhere, fold=fold, tuning=tuning))
        runs += [run for run in best.runs if tuning.get_fold(run) == fold]
        labels.append(best.label)
    first_label = variants[0].runs[0].label
    group = RunGroup(first_label + TUNED_SUFFIX, variants[0].controller, None, tuple(runs))
    return group, _describe_choice(labels, tuning)


def _describe_choice(labels: Sequence[str], tuning: _Tuning) -> str:
    """Describe how often each set of gains was chosen, given the label of the set chosen for each fold."""
    counts = Counter(labels)
    unit = "maps" if tuning.has_several_maps else "cases"
    parts = [
        f"{label} on {count} of {len(tuning.folds)} {unit}"
        for label, count in counts.most_common(_MAX_LISTED_GAINS)
    ]
    unlisted = len(counts) - len(parts)
    if unlisted > 0:
        parts.append(f"and {format_count(unlisted, 'other set')}")
    return ", ".join(parts)


def _rate_elsewhere(variant: RunGroup, fold: _Fold, tuning: _Tuning) -> tuple[float, ...]:
    """Return a sort key, the lowest for the best variant: median and mean distance on all other folds."""
    assert variant.gains is not None
    distances = [
        scale_distance(run, tuning.scales)
        for run in tuning.runs[variant.controller, variant.gains]
        if tuning.get_fold(run) != fold
    ]
    if not distances:
        return (np.inf,)
    return float(np.median(distances)), float(np.mean(distances))


def _describe_tuning(choices: Sequence[str], *, has_several_maps: bool) -> str:
    """Return the note on how gains were chosen."""
    if has_several_maps:
        fold = "map"
        other_folds = "on the other maps"
    else:
        fold = "start and seed"
        other_folds = "from the others"
    return (
        f"Tuned: if a controller has several sets of gains, for each {fold} the set with the lowest median "
        f"{other_folds} is used. So gains are never compared on the runs on which they were chosen. A failed "
        f"run counts as the worst. Chosen: {'; '.join(choices)}."
    )
