"""Groups of runs, their labels and styles, and scaled distances."""

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reported_results import build_result, build_run

from robocov_app.report.analysis.groups import (
    MAX_VARIANTS,
    choose_group_styles,
    find_varying_gains,
    format_gains,
    format_setting,
    group_by_controller,
    list_displayed_groups,
    list_settings,
    list_variants,
)
from robocov_app.report.analysis.scaling import compute_medians, scale_distances
from robocov_app.report.results.result import Gains, ReportedRun


def build_gain_study(values: Iterable[float] = (0.1, 1.0), seeds: int = 3) -> list[ReportedRun]:
    """Return runs of RAPF with several values of a gain, and runs of RPF."""
    runs = []
    for seed in range(seeds):
        for value in values:
            gains = (("k_rep", value), ("limit", None))
            runs.append(build_run("rapf", seed, 2.0 + value + 0.1 * seed, gains=gains))
    runs += [build_run("rpf", seed, 4.0 + seed, gains=(("k_rep", 1.0),)) for seed in range(seeds)]
    return runs


def test_variants_are_labeled_by_the_gain_that_differs() -> None:
    groups = list_variants(build_result(build_gain_study()))
    assert [group.label for group in groups] == ["RAPF k_rep 0.1", "RAPF k_rep 1", "RPF"]
    assert [len(group.runs) for group in groups] == [3, 3, 3]
    assert dict(groups[1].gains or ())["k_rep"] == 1.0


@pytest.mark.parametrize(
    "gain_sets",
    [
        [(("k", 1.0), ("m", 1.0)), (("k", 2.0), ("m", 2.0))],
        [(("k", 1.0),), (("k", 1.0 + 1e-9),)],
        [(("a_gain_with_a_long_name", 1.0),), (("a_gain_with_a_long_name", 2.0),)],
        [(("k", 1.0),), ()],
    ],
)
def test_variants_are_lettered_if_no_short_gain_distinguishes_them(gain_sets: list[Gains]) -> None:
    runs = [build_run(seed=seed, gains=gains) for seed, gains in enumerate(gain_sets)]
    groups = list_variants(build_result(runs))
    assert [group.label for group in groups] == ["RAPF A", "RAPF B"]


def test_letters_are_numbered_after_z() -> None:
    gain_sets = [(("k", float(number)), ("m", float(number))) for number in range(54)]
    groups = list_variants(build_result([build_run(gains=gains) for gains in gain_sets]))
    labels = [group.label for group in groups]
    assert len(set(labels)) == 54
    assert labels[25:27] == ["RAPF Z", "RAPF A2"]
    assert labels[53] == "RAPF B3"


def test_variants_differ_in_color_dashes_and_mark() -> None:
    failed_runs = [build_run("rapf", error="no"), build_run("mine", error="no")]
    result = build_result([*build_gain_study(values=(1, 3, 30, 100)), *failed_runs])
    styles = choose_group_styles(result)
    group_styles = [styles[group.label] for group in list_displayed_groups(result)]
    assert len(group_styles) == 5
    for values in zip(*group_styles, strict=True):
        assert len(set(map(str, values))) == 5
    assert styles["RAPF"] == group_styles[0]
    assert styles["mine"] not in group_styles


def test_too_many_variants_are_displayed_by_controller() -> None:
    result = build_result(build_gain_study(values=range(1, MAX_VARIANTS + 2)))
    assert [group.label for group in list_displayed_groups(result)] == ["RAPF", "RPF"]
    assert [group.gains is None for group in group_by_controller(result)] == [True, False]
    styles = choose_group_styles(result)
    assert styles["RAPF k_rep 3"] == styles["RAPF"]


def test_failed_runs_are_in_no_group() -> None:
    result = build_result([build_run(), build_run(seed=1, error="no"), build_run("rpf", error="no")])
    assert [len(group.runs) for group in list_variants(result)] == [1]


@given(st.lists(st.floats(0.1, 100.0), min_size=1, max_size=20), st.floats(0.01, 100.0))
def test_scaled_distances_do_not_depend_on_the_size_of_a_map(distances: list[float], factor: float) -> None:
    small_runs = [build_run(seed=seed, final=distance) for seed, distance in enumerate(distances)]
    large_runs = [
        build_run(seed=seed, final=distance * factor, map_name="large")
        for seed, distance in enumerate(distances)
    ]
    result = build_result([*small_runs, *large_runs])
    (group,) = list_variants(result)
    scaled = scale_distances(group.runs, compute_medians(result))
    assert scaled[: len(distances)] == pytest.approx(scaled[len(distances) :])
    assert np.median(scaled) == pytest.approx(1.0)


def test_a_single_setting_is_described_by_its_map() -> None:
    result = build_result([build_run(), build_run(seed=1)])
    assert [format_setting(result, setting) for setting in list_settings(result)] == ["rooms"]


def test_settings_are_distinguished_by_robots_and_team() -> None:
    runs = [
        build_run(robots=robots, team=(("max_speed", speed), ("sensing_range", None)))
        for robots in (4, 6)
        for speed in (0.5, 1.0)
    ]
    result = build_result(runs)
    texts = [format_setting(result, setting) for setting in list_settings(result)]
    assert texts[0] == "rooms, 4 robots, max speed 0.5 m/s, sensing range no limit"
    assert len(set(texts)) == 4
    result = build_result([build_run(robots=1), build_run(robots=2)])
    texts = [format_setting(result, setting) for setting in list_settings(result)]
    assert texts == ["rooms, 1 robot", "rooms, 2 robots"]


def test_varying_gains_are_found_for_each_controller() -> None:
    assert find_varying_gains(build_result(build_gain_study())) == {"k_rep": ["rapf"]}
    assert find_varying_gains(build_result(build_gain_study(values=(1.0,)))) == {}


def test_gains_are_formatted_with_units() -> None:
    gains = [("k", 0.1), ("limit", None), ("n", 3.0)]
    assert format_gains(gains, {"k": "N"}) == "k 0.1 N, limit none, n 3"
