import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication.claims.claim import GOALS, RIVALS, Claim
from robocov_app.replication.claims.extensions import (
    judge_conditions,
    judge_density,
    judge_targets,
    judge_teams,
)
from robocov_app.replication.claims.goals import (
    describe_goal,
    estimate_maximum_over_maps,
    estimate_worst_ratio,
    is_goal_met,
    judge_goals,
    judge_unseen,
    summarize_goals,
)
from robocov_app.replication.claims.rivals import judge_rivals
from robocov_app.replication.design.contenders import TARGETS, TEAMS, UNTUNED, build_contender
from robocov_app.replication.design.plan import FULL
from robocov_app.replication.results.controller_speed import StepTimes
from robocov_app.replication.results.outcomes import Outcomes, PairedComparison, ProblemInstance
from robocov_app.replication.results.study_results import Degradation

pytestmark = pytest.mark.usefixtures("few_resamples")

MAPS = tuple("abcdefghijkl")
OURS = build_contender("howard", {})
"""A contender in place of ours: goals can be judged for any."""

RAPF = UNTUNED[1]
LLOYD = UNTUNED[4]
LARGE = FULL.beyond.large
HUGE = FULL.beyond.huge


def build_outcomes(ours: float = 1.005, rapf: float = 1.05, lloyd: float = 1.08, **other: float) -> Outcomes:
    """Build outcomes of three contenders on twelve maps from two starts, with J_ref = 2 m."""
    scenarios = tuple(ProblemInstance(map_, start, 0) for map_ in MAPS for start in ("corner", "uniform"))
    full = np.ones(len(scenarios))
    values = {}
    for key, level in ((OURS.key, ours), (RAPF.key, rapf), (LLOYD.key, lloyd)):
        values[key, "final"] = 2.0 * level * full
        values[key, "gap"] = (level - 1.0) * full
        values[key, "contacts"] = other.get("contacts", 0.0) * full
        values[key, "settled"] = other.get("settled", 30.0) * full
    return Outcomes(scenarios, values)


def build_step_times(ratio: float = 5.0, part: float = 0.5) -> dict[int, StepTimes]:
    return {
        LARGE: StepTimes(LARGE, 0.02, {"rapf": (0.001,) * 3, OURS.key: (0.001 * ratio,) * 3}),
        HUGE: StepTimes(HUGE, 0.02, {"rapf": (0.001,) * 3, OURS.key: (0.02 * part,) * 3}),
    }


def judge_all_goals(outcomes: Outcomes, times: dict[int, StepTimes] | None = None) -> dict[str, Claim]:
    found = judge_goals(
        outcomes, OURS, (RAPF, LLOYD, OURS), build_step_times() if times is None else times, FULL
    )
    return {goal.key.removeprefix("goal-"): goal for goal in found}


UNSURE = "met; the interval includes the bound"


def test_all_goals_are_met():
    found = judge_all_goals(build_outcomes())
    assert set(found) == {
        *("gap", "every-map", "not-worse-rapf-default", "not-worse-lloyd", "contacts", "rest", "time"),
        *("step", "real-time"),
    }
    for name, goal in found.items():
        # that none of twelve maps shows a contact, or all of them rest, is no proof of either
        is_sure = name not in ("contacts", "rest")
        assert is_goal_met(goal)
        assert describe_goal(goal) == ("met" if is_sure else UNSURE)
        assert goal.verdict == ("holds" if is_sure else "undecided")
        assert goal.question == GOALS


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        ({"ours": 1.02}, {"gap"}),
        ({"ours": 1.055}, {"gap", "every-map"}),
        ({"ours": 1.065}, {"gap", "every-map", "not-worse-rapf-default"}),
        ({"contacts": 2.0}, {"contacts"}),
        ({"settled": 50.0}, {"time"}),
        ({"settled": np.nan}, {"rest", "time"}),
    ],
)
def test_missed_goals_are_described_with_numbers(changed, missed):
    found = judge_all_goals(build_outcomes(**changed))
    assert {name for name, goal in found.items() if not is_goal_met(goal)} == missed
    for name in missed:
        assert describe_goal(found[name]).startswith("missed: ") and " instead of at " in describe_goal(
            found[name]
        )
        assert found[name].verdict == "does not hold"


def test_steps_are_judged_by_their_own_goals():
    found = judge_all_goals(build_outcomes(), build_step_times(ratio=12.0, part=1.5))
    assert describe_goal(found["step"]) == "missed: 12 instead of at most 10"
    assert describe_goal(found["real-time"]) == "missed: 1.5 instead of at most 1"
    assert "step" not in judge_all_goals(build_outcomes(), {})


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, "holds partly"),  # twelve maps are too few to show that it has no contacts and settles
        ({"ours": 1.02}, "holds partly"),
        ({"contacts": 1.0}, "holds partly"),
        ({"settled": np.nan}, "holds partly"),
        ({"rapf": 1.0}, "holds partly"),
        ({"ours": 1.2, "contacts": 1.0, "settled": np.nan}, "does not hold"),
    ],
)
def test_on_maps_of_other_families_it_is_judged_once_more(changes, verdict):
    claim = judge_unseen(build_outcomes(**changes), OURS, (RAPF, LLOYD, OURS))
    assert (claim.key, claim.question, claim.runs, claim.maps) == ("goal-unseen", GOALS, 24, 12)
    assert [criterion.measure for criterion in claim.criteria] == [
        "median of J/J_ref - 1",
        "runs with a contact",
        "runs that settle",
        f"median of J({OURS.label}) / J({RAPF.label}) at the end",
        f"median of J({OURS.label}) / J({LLOYD.label}) at the end",
    ]
    assert claim.verdict == verdict


def test_without_a_run_on_unseen_maps_there_is_no_claim():
    there = build_outcomes()
    nowhere = there.select(np.zeros(len(there.instances), dtype=bool))
    assert judge_unseen(nowhere, OURS, (RAPF, LLOYD, OURS)) is None


def test_on_one_bad_map_the_goal_for_every_map_is_missed():
    what = build_outcomes()
    what.values[OURS.key, "gap"][:2] = 0.2
    what.values[OURS.key, "final"][:2] = 2.4
    found = judge_all_goals(what)
    assert is_goal_met(found["gap"]) and not is_goal_met(found["every-map"])
    assert "Highest on a; above the bound on 1 of 12 maps." in found["every-map"].explanation
    ratio = found["not-worse-lloyd"].criteria[0].interval
    assert ratio.estimate == pytest.approx(1.2 / 1.08)


def test_without_a_run_no_goal_is_judged():
    empty = build_outcomes().select(np.zeros(24, dtype=bool))
    assert set(judge_all_goals(empty)) == {"step", "real-time"}
    assert judge_all_goals(empty, {}) == {}
    assert summarize_goals([]) == "Nothing was measured."


@given(st.lists(st.tuples(st.sampled_from("xyz"), st.floats(0.0, 2.0)), min_size=1, max_size=20))
def test_the_worst_median_is_that_of_the_worst_map(rows):
    maps = [name for name, _ in rows]
    values = np.array([value for _, value in rows])
    found = estimate_maximum_over_maps(lambda drawn: np.median(values[drawn], axis=-1), maps)
    names = np.array(maps)
    assert found.estimate == pytest.approx(max(np.median(values[names == name]) for name in set(maps)))
    assert min(values) - 1e-12 <= found.low <= found.high <= max(values) + 1e-12
    scenarios = tuple(ProblemInstance(name, "corner", k) for k, name in enumerate(maps))
    ratio = estimate_worst_ratio(PairedComparison(Outcomes(scenarios, {}), "x", values + 1.0, values + 1.0))
    assert (ratio.low, ratio.estimate, ratio.high) == (1.0, 1.0, 1.0)


def test_our_controller_is_compared_with_every_other_one():
    rival = build_contender("geodesic-lloyd", {})
    what = build_outcomes()
    values = {**what.values, (rival.key, "final"): np.full(24, 2.0)}
    found = {
        each.key: each
        for each in judge_rivals(Outcomes(what.instances, values), OURS, (RAPF, LLOYD, rival, OURS))
    }
    better = found["beyond-howard-lloyd"]
    assert (better.verdict, better.runs, better.maps, better.question) == ("holds", 48, 12, RIVALS)
    assert better.criteria[0].interval.estimate == pytest.approx(1.005 / 1.08)
    worse = found["beyond-howard-geodesic-lloyd"]
    assert worse.verdict == "does not hold" and worse.text.endswith("which uses the whole map.")
    closed = found["beyond-howard-closes"]
    assert closed.criteria[0].interval.estimate == pytest.approx(1.0 - 0.005 / 0.05)
    assert closed.verdict == "holds"
    unmet = judge_rivals(what, OURS, (build_contender("poduri", {}),))
    assert [each.verdict for each in unmet] == ["undecided"]


def build_level_outcomes(levels: dict[str, float], measure: str = "final") -> Outcomes:
    scenarios = tuple(ProblemInstance(map_, "corner", 0) for map_ in MAPS)
    return Outcomes(scenarios, {(key, measure): np.full(len(MAPS), value) for key, value in levels.items()})


def test_targets_make_a_difference_or_none():
    same = judge_targets(build_level_outcomes({"centroid": 1.0, "median": 1.01, "sensing": 0.99}))
    assert same.verdict == "holds" and len(same.criteria) == len(TARGETS) - 1
    assert (
        judge_targets(build_level_outcomes({"centroid": 1.0, "median": 1.1, "sensing": 1.0})).verdict
        == "holds partly"
    )
    assert judge_targets(build_level_outcomes({})).verdict == "undecided"


def test_knowing_the_density_helps_or_does_not():
    for known, verdict in ((0.8, "holds"), (0.97, "holds partly"), (1.2, "does not hold")):
        assert judge_density(build_level_outcomes({"known": known, "ignored": 1.0})).verdict == verdict


@pytest.mark.parametrize("controller", ["rapf", "lloyd"])
def test_cells_by_time_help_or_do_not(controller):
    keys = [law.key for law in TEAMS if law.controller == controller]
    assert keys == [f"{controller}-distance", f"{controller}-time"]
    by_distance, by_time = keys
    better = judge_teams(build_level_outcomes({by_distance: 2.0, by_time: 1.5}, "time"), controller)
    worse = judge_teams(build_level_outcomes({by_distance: 1.5, by_time: 2.0}, "time"), controller)
    assert better.verdict == "holds" and "2 s with cells by distance, 1.5 s by time" in better.explanation
    assert worse.verdict == "does not hold"


def test_lost_and_late_messages_are_tolerated_or_not():
    def find_values(loss: float, delay: float) -> list[Degradation]:
        return [
            Degradation(axis, value, "rapf", "RAPF", Interval(ratio, ratio, ratio), 9)
            for axis, value, ratio in (("loss", 0.6, loss), ("delay", 1.0, delay))
        ]

    assert judge_conditions(find_values(1.01, 1.02), 12).verdict == "holds"
    assert judge_conditions(find_values(1.01, 1.5), 12).verdict == "holds partly"
    assert judge_conditions(find_values(1.2, 1.5), 12).verdict == "does not hold"
    assert "1.5, with delay 1" in judge_conditions(find_values(1.2, 1.5), 12).explanation
    assert judge_conditions([], 12).verdict == "undecided"
