"""What is compared with what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reported_results import entry, result_of

from robocov_app.report.groups import (
    CLUSTERS,
    MOST_GROUPS,
    by_controller,
    compared,
    compared_groups,
    comparisons,
    dependences,
    gain_text,
    medians,
    relative,
    setting_label,
    settings,
    shown_groups,
    variants,
)
from robocov_app.statistics import paired


def grid(levels=(0.1, 1.0), seeds=3):
    entries = [
        entry("rapf", seed, 2.0 + level + 0.1 * seed, gains=(("k_rep", level), ("limit", None)))
        for seed in range(seeds)
        for level in levels
    ]
    return [*entries, *(entry("rpf", seed, 4.0 + seed, gains=(("k_rep", 1.0),)) for seed in range(seeds))]


def test_variants_are_lettered_where_there_are_several() -> None:
    groups = variants(result_of(grid()))
    assert [group.label for group in groups] == ["RAPF A", "RAPF B", "RPF"]
    assert [len(group.entries) for group in groups] == [3, 3, 3]
    assert dict(groups[1].gains or ())["k_rep"] == 1.0


def test_too_many_variants_are_shown_by_controller() -> None:
    many = result_of(grid(levels=tuple(range(1, MOST_GROUPS + 2))))
    assert [group.label for group in shown_groups(many)] == ["RAPF", "RPF"]
    assert [group.gains is None for group in by_controller(many)] == [True, False]
    assert [group.label for group in compared_groups(many)] == [
        "RAPF A",
        "RPF",
    ]  # the lowest gain is the best


def test_letters_go_on_after_z() -> None:
    labels = [group.label for group in variants(result_of(grid(levels=tuple(range(1, 55)))))][:-1]
    assert len(set(labels)) == 54 and labels[25:27] == ["RAPF Z", "RAPF A2"] and labels[53] == "RAPF B3"


def test_runs_that_failed_are_in_no_group() -> None:
    result = result_of([entry(), entry(seed=1, error="no"), entry("rpf", error="no")])
    assert [len(group.entries) for group in variants(result)] == [1]


def test_pairs_share_map_team_start_and_seed() -> None:
    entries = [
        entry("rapf", 0, 1.0),
        entry("rpf", 0, 2.0),
        entry("rapf", 1, 1.0),
        entry("rpf", 1, 2.0, start="corner"),
        entry("rapf", 2, 1.0, robots=5),
        entry("rpf", 2, 2.0),
        entry("rapf", 3, 3.0, map_name="museum"),
        entry("rpf", 3, 2.0, map_name="museum"),
        entry("rpf", 4, None),
        entry("rapf", 4, 1.0),
        entry("rapf", 5, 1.0, team=(("max_speed", 1.0),)),
        entry("rpf", 5, 1.0, team=(("max_speed", 2.0),)),
    ]
    (comparison,) = comparisons(result_of(entries))
    assert [case[0] for case in comparison.cases] == ["rooms", "museum"]
    assert comparison.a.tolist() == [1.0, 3.0] and comparison.b.tolist() == [2.0, 2.0]
    assert comparison.paired.pairs == 2 and comparison.paired.wins.estimate == 0.5


def test_there_is_no_comparison_without_pairs() -> None:
    assert comparisons(result_of([entry("rapf", 0), entry("rpf", 1)])) == []
    assert comparisons(result_of([entry("rapf", 0)])) == []
    assert comparisons(result_of([entry(error="no")])) == []


@pytest.mark.parametrize("maps", [CLUSTERS - 1, CLUSTERS])
def test_whole_maps_are_drawn_from_enough_of_them(maps) -> None:
    rng = np.random.default_rng(1)
    entries = [
        entry(controller, seed, float(rng.uniform(1, 3)), map_name=f"m{k}")
        for k in range(maps)
        for seed in range(4)
        for controller in ("rapf", "rpf")
    ]
    first, second = variants(result_of(entries))
    comparison = compared(first, second)
    assert comparison is not None and comparison.by_map == (maps == CLUSTERS)
    labels = [case[0] for case in comparison.cases] if maps == CLUSTERS else None
    assert comparison.paired == paired(comparison.a, comparison.b, labels)


def test_many_groups_are_compared_with_the_first() -> None:
    names = ["rapf", "rpf", "lloyd", "a", "b", "c"]
    found = comparisons(result_of([entry(name, 0, 1.0 + k) for k, name in enumerate(names)]))
    assert [(each.first.controller, each.second.controller) for each in found] == [
        ("rapf", name) for name in names[1:]
    ]
    few = comparisons(result_of([entry(name, 0, 1.0 + k) for k, name in enumerate(names[:4])]))
    assert len(few) == 6


@given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=20), st.floats(0.01, 100.0))
def test_relative_costs_do_not_depend_on_the_size_of_a_map(finals, factor) -> None:
    small = [entry(seed=k, final=value) for k, value in enumerate(finals)]
    large = [entry(seed=k, final=value * factor, map_name="large") for k, value in enumerate(finals)]
    result = result_of([*small, *large])
    (group,) = variants(result)
    values = relative(group, medians(result))
    assert values[: len(finals)] == pytest.approx(values[len(finals) :])
    assert np.median(values) == pytest.approx(1.0)


def test_settings_are_named_by_what_tells_them_apart() -> None:
    same = result_of([entry(), entry(seed=1)])
    assert [setting_label(same, each) for each in settings(same)] == ["rooms"]
    teams = [
        entry(robots=n, team=(("max_speed", speed), ("sensing_range", None)))
        for n in (4, 6)
        for speed in (0.5, 1.0)
    ]
    several = result_of(teams)
    labels = [setting_label(several, each) for each in settings(several)]
    assert labels[0] == "rooms, 4 robots, max speed 0.5 m/s, sensing range no limit"
    assert len(set(labels)) == 4


def test_gains_that_vary_are_found_per_controller() -> None:
    assert dependences(result_of(grid())) == {"k_rep": ["rapf"]}
    assert dependences(result_of(grid(levels=(1.0,)))) == {}


def test_gains_are_told_with_their_units() -> None:
    assert gain_text([("k", 0.1), ("limit", None), ("n", 3.0)], {"k": "N"}) == "k 0.1 N, limit none, n 3"
