"""Comparison of controllers in pairs of runs, and fair tuning of their gains."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from reported_results import build_result, build_run

from robocov_app.figures.statistics import Interval, bootstrap, estimate_mean
from robocov_app.report.analysis.comparisons import GroupComparison, compare_groups
from robocov_app.report.analysis.groups import TUNED_SUFFIX, RunGroup, choose_group_styles
from robocov_app.report.analysis.tuning import choose_compared_groups, choose_tuned_styles
from robocov_app.report.document import load_template
from robocov_app.report.results.result import ReportedRun


def render_method(comparisons: Sequence[GroupComparison], tuning_note: str = "") -> str:
    """Return the explanation of comparisons in a page."""
    template: Any = load_template("pairs.jinja").module
    return str(template.method(comparisons, tuning_note))


def compare(runs: list[ReportedRun]) -> list[GroupComparison]:
    """Compare the controllers of some runs."""
    return compare_groups(choose_compared_groups(build_result(runs)).groups)


def build_pairs(ratios: dict[str, float], seeds: int = 4, noise: float = 0.01) -> list[ReportedRun]:
    """Return runs of two controllers whose ratio depends on the map."""
    rng = np.random.default_rng(7)
    runs = []
    for map_name, ratio in ratios.items():
        for seed in range(seeds):
            for controller, factor in (("rapf", ratio), ("rpf", 1.0)):
                distance = 2.0 * factor * float(np.exp(rng.normal(0.0, noise)))
                runs.append(build_run(controller, seed, distance, map_name=map_name))
    return runs


def check_limits(ratio: Interval, effect: Interval) -> None:
    """Check that the limits of a ratio are those of an effect, its logarithm."""
    assert [ratio.low, ratio.high] == pytest.approx(np.exp([effect.low, effect.high]))


def test_pairs_share_map_team_start_and_seed() -> None:
    runs = [
        build_run("rapf", 0, 1.0),
        build_run("rpf", 0, 2.0),
        build_run("rapf", 1, 1.0),
        build_run("rpf", 1, 2.0, start="corner"),
        build_run("rapf", 2, 1.0, robots=5),
        build_run("rpf", 2, 2.0),
        build_run("rapf", 3, 3.0, map_name="museum"),
        build_run("rpf", 3, 2.0, map_name="museum"),
        build_run("rpf", 4, None),
        build_run("rapf", 4, 1.0),
        build_run("rapf", 5, 1.0, team=(("max_speed", 1.0),)),
        build_run("rpf", 5, 1.0, team=(("max_speed", 2.0),)),
    ]
    (comparison,) = compare(runs)
    rooms, museum = comparison.maps
    assert (rooms.map_name, museum.map_name) == ("rooms", "museum")
    assert rooms.first_distances.tolist() == [1.0]
    assert rooms.second_distances.tolist() == [2.0]
    assert museum.first_distances.tolist() == [3.0]
    assert museum.second_distances.tolist() == [2.0]
    assert comparison.pair_count == 2
    assert comparison.unpaired_count == 7
    assert "7 runs without a counterpart" in render_method([comparison])


def test_there_is_no_comparison_without_pairs() -> None:
    assert compare([build_run("rapf", 0), build_run("rpf", 1)]) == []
    assert compare([build_run("rapf", 0)]) == []
    assert compare([build_run(error="no")]) == []


def test_the_headline_counts_maps_with_different_verdicts() -> None:
    ratios = {"a": 0.8, "b": 0.85, "museum": 1.3, "c": 1.0, "d": 0.7}
    (comparison,) = compare(build_pairs(ratios))
    for pairs in comparison.maps:
        assert pairs.ratio.estimate == pytest.approx(ratios[pairs.map_name], rel=0.03)
    headline = comparison.format_headline()
    start = "RAPF against RPF: better on 3 of 5 maps, worse on 1, undecided on 1; ratio 0.9"
    assert headline.startswith(start)
    assert headline.endswith(" over 5 maps.")


def test_all_maps_have_the_same_weight() -> None:
    (comparison,) = compare(build_pairs({"a": 0.8, "b": 0.85, "museum": 1.3, "c": 1.0, "d": 0.7}))
    effects = [np.log(pairs.ratio.estimate) for pairs in comparison.maps]
    check_limits(comparison.ratio, bootstrap(effects, "mean"))


def test_too_few_maps_have_no_interval_in_the_headline() -> None:
    (comparison,) = compare(build_pairs({"a": 0.8, "b": 1.3}))
    assert comparison.format_headline().endswith("(2 maps, too few for an interval).")
    assert "2 maps are too few" in render_method([comparison])


def test_the_interval_on_one_map_is_over_its_seeds() -> None:
    (comparison,) = compare(build_pairs({"rooms": 0.8}, seeds=6))
    (pairs,) = comparison.maps
    effects = np.log(pairs.first_distances / pairs.second_distances)
    check_limits(pairs.ratio, estimate_mean(effects))
    assert comparison.ratio == pairs.ratio
    headline = comparison.format_headline()
    assert headline.startswith("RAPF against RPF: better, ratio 0.8")
    assert headline.endswith("over 6 pairs.")


def test_several_teams_from_the_same_seeds_do_not_make_the_interval_narrower() -> None:
    runs = build_pairs({"rooms": 0.8}, noise=0.3)
    runs_of_teams = [
        build_run(run.controller, run.seed or 0, run.final_distance, robots=robots)
        for run in runs
        for robots in (4, 6, 8)
    ]
    (comparison,) = compare(runs)
    (comparison_of_teams,) = compare(runs_of_teams)
    assert comparison_of_teams.pair_count == 3 * comparison.pair_count
    assert comparison_of_teams.ratio.low == pytest.approx(comparison.ratio.low)


@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_equal_pairs_are_undecided(ratio: float) -> None:
    rapf_runs = [build_run("rapf", seed, 2.0 * ratio) for seed in range(8)]
    rpf_runs = [build_run("rpf", seed, 2.0) for seed in range(8)]
    (comparison,) = compare([*rapf_runs, *rpf_runs])
    assert comparison.maps[0].verdict == "undecided"


def test_negligible_differences_are_undecided() -> None:
    rapf_runs = [build_run("rapf", seed, 2.0 - 1e-9 * seed - 1e-7) for seed in range(8)]
    rpf_runs = [build_run("rpf", seed, 2.0) for seed in range(8)]
    (comparison,) = compare([*rapf_runs, *rpf_runs])
    assert comparison.maps[0].verdict == "undecided"
    assert comparison.ratio.high < 1.0


def test_many_groups_are_compared_with_the_first() -> None:
    controllers = ["rapf", "rpf", "lloyd", "a", "b", "c"]
    runs = [build_run(controller, 0, 1.0 + k) for k, controller in enumerate(controllers)]
    comparisons = compare(runs)
    assert {comparison.first.controller for comparison in comparisons} == {"rapf"}
    assert [comparison.second.controller for comparison in comparisons] == controllers[1:]
    assert len(compare(runs[:4])) == 6


@pytest.mark.parametrize("maps", [1, 6])
def test_gains_are_chosen_and_compared_on_different_runs(maps: int) -> None:
    # The controllers are equal, and the gains have no effect, so that the best gains are best by chance.
    rng = np.random.default_rng(3)
    effects = []
    for _ in range(40):
        runs = []
        for map_number in range(maps):
            for seed in range(6):
                for controller, gain_sets in (("rapf", 12), ("rpf", 1)):
                    for value in range(gain_sets):
                        run = build_run(
                            controller,
                            seed,
                            float(rng.lognormal()),
                            map_name=f"m{map_number}",
                            gains=(("k", float(value)),),
                        )
                        runs.append(run)
        (comparison,) = compare(runs)
        effects.append(np.log(comparison.ratio.estimate))
    # If gains were chosen on the same runs, the mean would be about -.49 and -.18.
    assert abs(np.mean(effects)) < 3.0 * np.std(effects) / np.sqrt(len(effects))


def build_tuning_study() -> list[ReportedRun]:
    """Return runs on three maps of RPF, and of RAPF with three gains; the best of these fails often."""
    runs = []
    for map_number in range(3):
        map_name = f"m{map_number}"
        for seed in range(3):
            for value, distance in ((1.0, 1.0), (2.0, 1.5), (3.0, 4.0)):
                error = "no" if value == 1.0 and seed < 2 else None
                gains = (("k", value),)
                runs.append(build_run("rapf", seed, distance, map_name=map_name, gains=gains, error=error))
            runs.append(build_run("rpf", seed, 2.0, map_name=map_name))
    return runs


def test_the_note_lists_the_chosen_gains_and_failed_runs_count_as_the_worst() -> None:
    groups, note = choose_compared_groups(build_result(build_tuning_study()))
    assert [group.label for group in groups] == ["RAPF (tuned)", "RPF"]
    assert {dict(run.gains)["k"] for run in groups[0].runs} == {2.0}
    assert "on the other maps" in note
    assert "Chosen: RAPF k 2 on 3 of 3 maps." in note


def test_a_tuned_controller_has_the_style_of_its_gains_if_they_are_the_same_for_all_maps() -> None:
    result = build_result(build_tuning_study())
    styles = choose_group_styles(result)
    groups = choose_compared_groups(result).groups
    assert choose_tuned_styles(result, groups, styles) == {"RAPF (tuned)": styles["RAPF k 2"]}


def test_a_tuned_controller_with_different_gains_has_a_style_of_its_own() -> None:
    result = build_result(build_tuning_study())
    styles = choose_group_styles(result)
    runs = tuple(run for run in result.completed_runs if run.controller == "rapf")
    group = RunGroup("RAPF" + TUNED_SUFFIX, "rapf", None, runs)
    tuned_styles = choose_tuned_styles(result, [group], styles)
    assert tuned_styles[group.label] not in styles.values()


def test_gains_are_chosen_from_other_seeds_if_there_is_only_one_map() -> None:
    runs = [run for run in build_tuning_study() if run.map == "m0"]
    note = choose_compared_groups(build_result(runs)).note
    assert "lowest median from the others" in note


def test_starts_and_seeds_on_one_map_are_counted_as_cases() -> None:
    runs = [run for run in build_tuning_study() if run.map == "m0"]
    note = choose_compared_groups(build_result(runs)).note
    assert "Chosen: RAPF k 2 on 3 of 3 cases." in note


def test_the_note_says_how_many_sets_of_gains_it_does_not_list() -> None:
    """For seed s, the set of gains s is chosen: only for this set, its worst seed does not count."""
    distances = (9.0, 1.0, 1.0, 5.0, 5.0)
    runs = []
    for seed in range(5):
        for value in range(5):
            final = distances[(seed - value) % 5]
            runs.append(build_run("rapf", seed, final, gains=(("k", float(value)),)))
        runs.append(build_run("rpf", seed, 2.0))
    note = choose_compared_groups(build_result(runs)).note
    assert note.count(" of 5 cases") == 3
    assert note.endswith(", and 2 other sets.")


def test_gains_are_not_chosen_if_there_is_only_one_case() -> None:
    runs = [run for run in build_tuning_study() if (run.map, run.seed) == ("m0", 2)]
    note = choose_compared_groups(build_result(runs)).note
    assert "too few to choose gains fairly" in note


def test_sets_of_gains_of_a_single_controller_are_compared_with_each_other() -> None:
    runs = [
        build_run(seed=seed, final=1.0 + value + 0.1 * seed, gains=(("k", value),))
        for seed in range(3)
        for value in (1.0, 2.0)
    ]
    groups, note = choose_compared_groups(build_result(runs))
    assert [group.label for group in groups] == ["RAPF k 1", "RAPF k 2"]
    assert "none was chosen" in note
