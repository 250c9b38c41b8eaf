"""Verdicts on the claims beyond the paper from artificial outcomes."""

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
OWN = build_contender("howard", {})
"""The contender whose goals are judged. Any controller will do."""
RAPF = UNTUNED[1]
LLOYD = UNTUNED[4]
CONTENDERS = (RAPF, LLOYD, OWN)
LARGE = FULL.beyond.large
HUGE = FULL.beyond.huge
REFERENCE_COST_M = 2.0


def build_outcomes(
    own: float = 1.005,
    rapf: float = 1.05,
    lloyd: float = 1.08,
    contacts: float = 0.0,
    settled: float = 30.0,
) -> Outcomes:
    """Build outcomes of three contenders on twelve maps, from two starts.

    Parameters
    ----------
    own, rapf, lloyd : float
        Costs relative to the reference.
    contacts, settled : float
        Number of contacts and settling time of every run.
    """
    instances = tuple(ProblemInstance(name, start, 0) for name in MAPS for start in ("corner", "uniform"))
    count = len(instances)
    values = {}
    for contender, ratio in ((OWN, own), (RAPF, rapf), (LLOYD, lloyd)):
        values[contender.key, "final"] = np.full(count, REFERENCE_COST_M * ratio)
        values[contender.key, "gap"] = np.full(count, ratio - 1.0)
        values[contender.key, "contacts"] = np.full(count, contacts)
        values[contender.key, "settled"] = np.full(count, settled)
    return Outcomes(instances, values)


def build_step_times(ratio: float = 5.0, real_time_factor: float = 0.5) -> dict[int, StepTimes]:
    """Build step times of our contender, relative to RAPF's and to the control period."""
    dt = 0.02
    rapf = (0.001,) * 3
    large = StepTimes(LARGE, dt, {"rapf": rapf, OWN.key: (0.001 * ratio,) * 3})
    huge = StepTimes(HUGE, dt, {"rapf": rapf, OWN.key: (dt * real_time_factor,) * 3})
    return {LARGE: large, HUGE: huge}


def judge_all_goals(outcomes: Outcomes, times: dict[int, StepTimes] | None = None) -> dict[str, Claim]:
    """Return the goals by their keys without "goal-"."""
    if times is None:
        times = build_step_times()
    goals = judge_goals(outcomes, OWN, CONTENDERS, times, FULL)
    return {goal.key.removeprefix("goal-"): goal for goal in goals}


def test_all_goals_are_met():
    goals = judge_all_goals(build_outcomes())
    assert set(goals) == {
        "gap",
        "every-map",
        "not-worse-rapf-default",
        "not-worse-lloyd",
        "contacts",
        "rest",
        "time",
        "step",
        "real-time",
    }
    assert all(is_goal_met(goal) for goal in goals.values())
    assert {goal.question for goal in goals.values()} == {GOALS}


def test_goals_about_all_runs_are_met_but_not_proven_by_twelve_maps():
    for name, goal in judge_all_goals(build_outcomes()).items():
        if name in ("contacts", "rest"):
            assert describe_goal(goal) == "met; the interval includes the bound"
            assert goal.verdict == "undecided"
        else:
            assert describe_goal(goal) == "met"
            assert goal.verdict == "holds"


@pytest.mark.parametrize(
    ("changes", "missed"),
    [
        ({"own": 1.02}, {"gap"}),
        ({"own": 1.055}, {"gap", "every-map"}),
        ({"own": 1.065}, {"gap", "every-map", "not-worse-rapf-default"}),
        ({"contacts": 2.0}, {"contacts"}),
        ({"settled": 50.0}, {"time"}),
        ({"settled": np.nan}, {"rest", "time"}),
    ],
)
def test_missed_goals_are_described_with_numbers(changes, missed):
    goals = judge_all_goals(build_outcomes(**changes))
    assert {name for name, goal in goals.items() if not is_goal_met(goal)} == missed
    for name in missed:
        description = describe_goal(goals[name])
        assert description.startswith("missed: ") and " instead of at " in description
        assert goals[name].verdict == "does not hold"


def test_a_comparison_counts_only_the_runs_that_both_contenders_have():
    outcomes = build_outcomes()
    outcomes.values[LLOYD.key, "final"][4:] = np.nan
    goals = judge_all_goals(outcomes)
    assert (goals["gap"].runs, goals["gap"].maps) == (24, 12)
    comparison = goals["not-worse-lloyd"]
    assert (comparison.runs, comparison.maps) == (4, 2)
    assert comparison.verdict == "undecided"


def test_slow_steps_miss_their_goals():
    goals = judge_all_goals(build_outcomes(), build_step_times(ratio=12.0, real_time_factor=1.5))
    assert describe_goal(goals["step"]) == "missed: 12 instead of at most 10"
    assert describe_goal(goals["real-time"]) == "missed: 1.5 instead of at most 1"


def test_without_step_times_there_is_no_goal_about_them():
    assert "step" not in judge_all_goals(build_outcomes(), {})


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, "holds partly"),  # Twelve maps are too few to prove that all runs settle without contacts.
        ({"own": 1.02}, "holds partly"),
        ({"contacts": 1.0}, "holds partly"),
        ({"settled": np.nan}, "holds partly"),
        ({"rapf": 1.0}, "holds partly"),
        ({"own": 1.2, "contacts": 1.0, "settled": np.nan}, "does not hold"),
    ],
)
def test_the_main_goals_are_judged_again_on_unseen_maps(changes, verdict):
    claim = judge_unseen(build_outcomes(**changes), OWN, CONTENDERS)
    assert claim is not None
    assert (claim.key, claim.question, claim.runs, claim.maps) == ("goal-unseen", GOALS, 24, 12)
    assert [criterion.measure for criterion in claim.criteria] == [
        "median gap",
        "runs with a contact",
        "runs that settle",
        f"median of J({OWN.label}) / J({RAPF.label}) at the end",
        f"median of J({OWN.label}) / J({LLOYD.label}) at the end",
    ]
    assert claim.verdict == verdict


def test_without_runs_on_unseen_maps_there_is_no_claim():
    assert judge_unseen(select_no_runs(build_outcomes()), OWN, CONTENDERS) is None


def select_no_runs(outcomes: Outcomes) -> Outcomes:
    return outcomes.select(np.zeros(len(outcomes.instances), dtype=bool))


def test_one_bad_map_misses_the_goal_for_every_map():
    outcomes = build_outcomes()
    outcomes.values[OWN.key, "gap"][:2] = 0.2
    outcomes.values[OWN.key, "final"][:2] = 2.4
    goals = judge_all_goals(outcomes)
    assert is_goal_met(goals["gap"]) and not is_goal_met(goals["every-map"])
    assert "Highest on a; above the bound on 1 of 12 maps." in goals["every-map"].explanation
    ratio = goals["not-worse-lloyd"].criteria[0].interval
    assert ratio.estimate == pytest.approx(1.2 / 1.08)


def test_without_runs_only_the_goals_about_step_times_are_judged():
    no_outcomes = select_no_runs(build_outcomes())
    assert set(judge_all_goals(no_outcomes)) == {"step", "real-time"}
    assert judge_all_goals(no_outcomes, {}) == {}


def test_without_goals_the_summary_says_so():
    assert summarize_goals([]) == "Nothing was measured."


@given(st.lists(st.tuples(st.sampled_from("xyz"), st.floats(0.0, 2.0)), min_size=1, max_size=20))
def test_the_maximum_over_maps_is_the_median_of_the_worst_map(rows):
    maps = np.array([name for name, _ in rows])
    values = np.array([value for _, value in rows])
    interval = estimate_maximum_over_maps(lambda sample: np.median(values[sample], axis=-1), maps.tolist())
    medians = [np.median(values[maps == name]) for name in set(maps)]
    assert interval.estimate == pytest.approx(max(medians))
    assert min(values) - 1e-12 <= interval.low <= interval.high <= max(values) + 1e-12


@given(st.lists(st.tuples(st.sampled_from("xyz"), st.floats(0.0, 2.0)), min_size=1, max_size=20))
def test_the_worst_ratio_of_equal_costs_is_one(rows):
    instances = tuple(ProblemInstance(name, "corner", k) for k, (name, _) in enumerate(rows))
    costs = np.array([1.0 + value for _, value in rows])
    ratio = estimate_worst_ratio(PairedComparison(Outcomes(instances, {}), "x", costs, costs))
    assert (ratio.low, ratio.estimate, ratio.high) == (1.0, 1.0, 1.0)


@pytest.fixture
def comparisons() -> dict[str, Claim]:
    """The claims about our contender and each other one, by key; Lloyd with the whole map is the best."""
    rival = build_contender("geodesic-lloyd", {})
    outcomes = build_outcomes()
    values = {**outcomes.values, (rival.key, "final"): np.full(24, REFERENCE_COST_M)}
    claims = judge_rivals(Outcomes(outcomes.instances, values), OWN, (RAPF, LLOYD, rival, OWN))
    return {claim.key: claim for claim in claims}


def test_our_controller_is_compared_with_a_worse_one(comparisons):
    claim = comparisons["beyond-howard-lloyd"]
    assert (claim.verdict, claim.runs, claim.maps, claim.question) == ("holds", 48, 12, RIVALS)
    assert claim.criteria[0].interval.estimate == pytest.approx(1.005 / 1.08)


def test_our_controller_is_compared_with_a_better_one(comparisons):
    claim = comparisons["beyond-howard-geodesic-lloyd"]
    assert claim.verdict == "does not hold"
    assert claim.text.endswith("which uses the whole map.")


def test_the_closed_part_of_rapfs_gap_is_estimated(comparisons):
    claim = comparisons["beyond-howard-closes"]
    assert claim.criteria[0].interval.estimate == pytest.approx(1.0 - 0.005 / 0.05)
    assert claim.verdict == "holds"


def test_the_comparison_with_a_controller_without_runs_is_undecided():
    claims = judge_rivals(build_outcomes(), OWN, (build_contender("poduri", {}),))
    assert [claim.verdict for claim in claims] == ["undecided"]


def build_level_outcomes(levels: dict[str, float], measure: str = "final") -> Outcomes:
    """Build outcomes with one run on each map, in which each contender has the same value everywhere."""
    instances = tuple(ProblemInstance(name, "corner", 0) for name in MAPS)
    return Outcomes(instances, {(key, measure): np.full(len(MAPS), value) for key, value in levels.items()})


@pytest.mark.parametrize(
    ("levels", "verdict"),
    [
        ({"centroid": 1.0, "median": 1.01, "sensing": 0.99}, "holds"),
        ({"centroid": 1.0, "median": 1.1, "sensing": 1.0}, "holds partly"),
        ({}, "undecided"),
    ],
)
def test_targets_are_compared_with_the_centroid(levels, verdict):
    claim = judge_targets(build_level_outcomes(levels))
    assert claim.verdict == verdict
    assert len(claim.criteria) == (len(TARGETS) - 1 if levels else 0)


@pytest.mark.parametrize(
    ("known", "verdict"), [(0.8, "holds"), (0.97, "holds partly"), (1.2, "does not hold")]
)
def test_runs_with_the_density_are_compared_with_runs_without_it(known, verdict):
    assert judge_density(build_level_outcomes({"known": known, "ignored": 1.0})).verdict == verdict


@pytest.mark.parametrize("controller", ["rapf", "lloyd"])
class TestTeams:
    def test_each_controller_has_both_kinds_of_cells(self, controller):
        keys = [contender.key for contender in TEAMS if contender.controller == controller]
        assert keys == [f"{controller}-distance", f"{controller}-time"]

    def test_cells_by_time_are_better(self, controller):
        levels = {f"{controller}-distance": 2.0, f"{controller}-time": 1.5}
        claim = judge_teams(build_level_outcomes(levels, "time"), controller)
        assert claim.verdict == "holds"
        assert "2 s with cells by distance, 1.5 s by time" in claim.explanation

    def test_cells_by_time_are_worse(self, controller):
        levels = {f"{controller}-distance": 1.5, f"{controller}-time": 2.0}
        assert judge_teams(build_level_outcomes(levels, "time"), controller).verdict == "does not hold"


def build_message_degradations(loss: float, delay: float) -> list[Degradation]:
    """Build the degradations of RAPF with lost messages and with late ones."""
    return [
        Degradation("loss", 0.6, "rapf", "RAPF", Interval(loss, loss, loss), 9),
        Degradation("delay", 1.0, "rapf", "RAPF", Interval(delay, delay, delay), 9),
    ]


@pytest.mark.parametrize(
    ("loss", "delay", "verdict"),
    [(1.01, 1.02, "holds"), (1.01, 1.5, "holds partly"), (1.2, 1.5, "does not hold")],
)
def test_lost_and_late_messages_are_tolerated_or_not(loss, delay, verdict):
    assert judge_conditions(build_message_degradations(loss, delay), 12).verdict == verdict


def test_the_explanation_names_the_degradation_with_late_messages():
    assert "1.5, with delay 1" in judge_conditions(build_message_degradations(1.2, 1.5), 12).explanation


def test_without_degradations_the_tolerance_is_undecided():
    assert judge_conditions([], 12).verdict == "undecided"
