"""What is compared with what."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reported_results import entry, result_of

from robocov_app.report.groups import (
    MOST_GROUPS,
    TUNED,
    by_controller,
    dependences,
    gain_text,
    medians,
    relative,
    setting_label,
    settings,
    shown_groups,
    styles,
    variants,
)


def grid(levels=(0.1, 1.0), seeds=3):
    entries = [
        entry("rapf", seed, 2.0 + level + 0.1 * seed, gains=(("k_rep", level), ("limit", None)))
        for seed in range(seeds)
        for level in levels
    ]
    return [*entries, *(entry("rpf", seed, 4.0 + seed, gains=(("k_rep", 1.0),)) for seed in range(seeds))]


def test_variants_are_called_by_the_gain_that_differs() -> None:
    groups = variants(result_of(grid()))
    assert [group.label for group in groups] == ["RAPF k_rep 0.1", "RAPF k_rep 1", "RPF"]
    assert [len(group.entries) for group in groups] == [3, 3, 3]
    assert dict(groups[1].gains or ())["k_rep"] == 1.0


@pytest.mark.parametrize(
    "sets",
    [
        [(("k", 1.0), ("m", 1.0)), (("k", 2.0), ("m", 2.0))],
        [(("k", 1.0),), (("k", 1.0 + 1e-9),)],
        [(("a_gain_with_a_long_name", 1.0),), (("a_gain_with_a_long_name", 2.0),)],
        [(("k", 1.0),), ()],
    ],
)
def test_variants_are_lettered_where_no_one_short_gain_tells_them_apart(sets) -> None:
    groups = variants(result_of([entry(seed=k, gains=gains) for k, gains in enumerate(sets)]))
    assert [group.label for group in groups] == ["RAPF A", "RAPF B"]


def test_variants_differ_in_label_color_dashes_and_mark_and_their_controller_keeps_its_own() -> None:
    result = result_of([*grid(levels=(1, 3, 30, 100)), entry("rapf", error="no"), entry("mine", error="no")])
    looks = styles(result)
    own = [looks[group.label] for group in shown_groups(result)]
    assert len(own) == 5 and all(len(set(map(str, part))) == 5 for part in zip(*own, strict=True))
    assert looks["RAPF"] == looks["RAPF" + TUNED] == own[0] and looks["mine"] not in own


def test_too_many_variants_are_shown_by_controller() -> None:
    many = result_of(grid(levels=tuple(range(1, MOST_GROUPS + 2))))
    assert [group.label for group in shown_groups(many)] == ["RAPF", "RPF"]
    assert [group.gains is None for group in by_controller(many)] == [True, False]
    assert styles(many)["RAPF k_rep 3"] == styles(many)["RAPF"]  # not shown apart


def test_letters_go_on_after_z() -> None:
    sets = [(("k", float(k)), ("m", float(k))) for k in range(54)]
    labels = [group.label for group in variants(result_of([entry(gains=gains) for gains in sets]))]
    assert len(set(labels)) == 54 and labels[25:27] == ["RAPF Z", "RAPF A2"] and labels[53] == "RAPF B3"


def test_runs_that_failed_are_in_no_group() -> None:
    result = result_of([entry(), entry(seed=1, error="no"), entry("rpf", error="no")])
    assert [len(group.entries) for group in variants(result)] == [1]


@given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=20), st.floats(0.01, 100.0))
def test_relative_costs_do_not_depend_on_the_size_of_a_map(finals, factor) -> None:
    small = [entry(seed=k, final=value) for k, value in enumerate(finals)]
    large = [entry(seed=k, final=value * factor, map_name="large") for k, value in enumerate(finals)]
    result = result_of([*small, *large])
    (group,) = variants(result)
    values = relative(group.entries, medians(result))
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
