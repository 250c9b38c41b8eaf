import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication.claims import (
    GOALS,
    RIVALS,
    Claim,
    conditions_claim,
    density_claim,
    goal_counts,
    goal_outcome,
    goals,
    highest_of_maps,
    is_met,
    rival_claims,
    targets_claim,
    teams_claim,
    unseen_claim,
    worst_ratio,
)
from robocov_app.replication.contenders import TARGETS, TEAMS, UNTUNED, with_gains
from robocov_app.replication.outcomes import Comparison, Outcomes, Scenario
from robocov_app.replication.plan import FULL
from robocov_app.replication.results import Degradation
from robocov_app.replication.step_times import StepTimes

pytestmark = pytest.mark.usefixtures("few_resamples")

MAPS = tuple("abcdefghijkl")
OURS = with_gains("howard", {})
"""Stands for ours: goals are asked of any contender."""

RAPF, LLOYD = UNTUNED[1], UNTUNED[3]
LARGE, HUGE = FULL.beyond.large, FULL.beyond.huge


def outcomes(ours: float = 1.01, rapf: float = 1.05, lloyd: float = 1.08, **other: float) -> Outcomes:
    """Return what three contenders reached on twelve maps from two starts, J_ref being 2 m."""
    scenarios = tuple(Scenario(map_, start, 0) for map_ in MAPS for start in ("corner", "uniform"))
    full = np.ones(len(scenarios))
    values = {}
    for key, level in ((OURS.key, ours), (RAPF.key, rapf), (LLOYD.key, lloyd)):
        values[key, "final"] = 2.0 * level * full
        values[key, "gap"] = (level - 1.0) * full
        values[key, "contacts"] = other.get("contacts", 0.0) * full
        values[key, "settled"] = other.get("settled", 30.0) * full
    return Outcomes(scenarios, values)


def steps(ratio: float = 5.0, part: float = 0.5) -> dict[int, StepTimes]:
    return {
        LARGE: StepTimes(LARGE, 0.02, {"rapf": (0.001,) * 3, OURS.key: (0.001 * ratio,) * 3}),
        HUGE: StepTimes(HUGE, 0.02, {"rapf": (0.001,) * 3, OURS.key: (0.02 * part,) * 3}),
    }


def asked(what: Outcomes, times: dict[int, StepTimes] | None = None) -> dict[str, Claim]:
    found = goals(what, OURS, (RAPF, LLOYD, OURS), steps() if times is None else times, FULL)
    return {goal.key.removeprefix("goal-"): goal for goal in found}


UNSURE = "met; the interval reaches over the bound"


def test_all_goals_are_met_by_who_meets_them():
    found = asked(outcomes())
    assert set(found) == {
        *("gap", "every-map", "not-worse-rapf-default", "not-worse-lloyd", "contacts", "rest", "time"),
        *("step", "real-time"),
    }
    for name, goal in found.items():
        # that none of twelve maps shows a contact, or all of them rest, is no proof of either
        words, verdict = ("met", "holds") if name not in ("contacts", "rest") else (UNSURE, "undecided")
        assert (is_met(goal), goal_outcome(goal), goal.verdict, goal.part) == (True, words, verdict, GOALS)


@pytest.mark.parametrize(
    ("changed", "missed"),
    [
        ({"ours": 1.02}, {"gap"}),
        ({"ours": 1.04}, {"gap", "every-map"}),
        ({"ours": 1.065}, {"gap", "every-map", "not-worse-rapf-default"}),
        ({"contacts": 2.0}, {"contacts"}),
        ({"settled": 50.0}, {"time"}),
        ({"settled": np.nan}, {"rest", "time"}),
    ],
)
def test_what_is_missed_is_said_with_numbers(changed, missed):
    found = asked(outcomes(**changed))
    assert {name for name, goal in found.items() if not is_met(goal)} == missed
    for name in missed:
        assert goal_outcome(found[name]).startswith("missed: ") and " instead of at " in goal_outcome(
            found[name]
        )
        assert found[name].verdict == "does not hold"


def test_steps_are_judged_by_their_own_goals():
    found = asked(outcomes(), steps(ratio=12.0, part=1.5))
    assert goal_outcome(found["step"]) == "missed: 12 instead of at most 10"
    assert goal_outcome(found["real-time"]) == "missed: 1.5 instead of at most 1"
    assert "step" not in asked(outcomes(), {})


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, "holds partly"),  # twelve maps are too few to show that it touches nothing and rests
        ({"ours": 1.02}, "holds partly"),
        ({"contacts": 1.0}, "holds partly"),
        ({"settled": np.nan}, "holds partly"),
        ({"rapf": 1.0}, "holds partly"),
        ({"ours": 1.2, "contacts": 1.0, "settled": np.nan}, "does not hold"),
    ],
)
def test_on_maps_of_other_families_it_is_judged_once_more(changes, verdict):
    claim = unseen_claim(outcomes(**changes), OURS, (RAPF, LLOYD, OURS))
    assert (claim.key, claim.part, claim.runs, claim.maps) == ("goal-unseen", GOALS, 24, 12)
    assert [criterion.text for criterion in claim.criteria] == [
        "median of J/J_ref - 1",
        "runs with a contact",
        "runs that come to rest",
        f"median of J({OURS.label}) / J({RAPF.label}) at the end",
        f"median of J({OURS.label}) / J({LLOYD.label}) at the end",
    ]
    assert claim.verdict == verdict


def test_where_it_has_not_run_nothing_is_claimed():
    there = outcomes()
    nowhere = there.where(np.zeros(len(there.scenarios), dtype=bool))
    assert unseen_claim(nowhere, OURS, (RAPF, LLOYD, OURS)) is None


def test_on_one_bad_map_the_goal_for_every_map_is_missed():
    what = outcomes()
    what.values[OURS.key, "gap"][:2] = 0.2
    what.values[OURS.key, "final"][:2] = 2.4
    found = asked(what)
    assert is_met(found["gap"]) and not is_met(found["every-map"])
    assert "Highest on a; above it on 1 of 12 maps." in found["every-map"].explanation
    ratio = found["not-worse-lloyd"].criteria[0].interval
    assert ratio.estimate == pytest.approx(1.2 / 1.08)


def test_without_a_run_no_goal_is_judged():
    empty = outcomes().where(np.zeros(24, dtype=bool))
    assert set(asked(empty)) == {"step", "real-time"}
    assert asked(empty, {}) == {}
    assert goal_counts([]) == "Nothing was measured."


@given(st.lists(st.tuples(st.sampled_from("xyz"), st.floats(0.0, 2.0)), min_size=1, max_size=20))
def test_the_worst_median_is_that_of_the_worst_map(rows):
    maps, values = [name for name, _ in rows], np.array([value for _, value in rows])
    found = highest_of_maps(lambda drawn: np.median(values[drawn], axis=-1), maps)
    names = np.array(maps)
    assert found.estimate == pytest.approx(max(np.median(values[names == name]) for name in set(maps)))
    assert min(values) - 1e-12 <= found.low <= found.high <= max(values) + 1e-12
    scenarios = tuple(Scenario(name, "corner", k) for k, name in enumerate(maps))
    ratio = worst_ratio(Comparison(Outcomes(scenarios, {}), "x", values + 1.0, values + 1.0))
    assert (ratio.low, ratio.estimate, ratio.high) == (1.0, 1.0, 1.0)


def test_ours_is_compared_pair_by_pair_with_everybody():
    rival = with_gains("geodesic-lloyd", {})
    what = outcomes()
    values = {**what.values, (rival.key, "final"): np.full(24, 2.01)}
    found = {
        each.key: each
        for each in rival_claims(Outcomes(what.scenarios, values), OURS, (RAPF, LLOYD, rival, OURS))
    }
    better = found["beyond-howard-lloyd"]
    assert (better.verdict, better.runs, better.maps, better.part) == ("holds", 48, 12, RIVALS)
    assert better.criteria[0].interval.estimate == pytest.approx(1.01 / 1.08)
    worse = found["beyond-howard-geodesic-lloyd"]
    assert worse.verdict == "does not hold" and worse.claim.endswith("which goes by the whole map.")
    closed = found["beyond-howard-closes"]
    assert closed.criteria[0].interval.estimate == pytest.approx(1.0 - 0.01 / 0.05)
    assert closed.verdict == "holds"
    unmet = rival_claims(what, OURS, (with_gains("poduri", {}),))
    assert [each.verdict for each in unmet] == ["undecided"]


def level(what: dict[str, float], measure: str = "final") -> Outcomes:
    scenarios = tuple(Scenario(map_, "corner", 0) for map_ in MAPS)
    return Outcomes(scenarios, {(key, measure): np.full(len(MAPS), value) for key, value in what.items()})


def test_targets_make_a_difference_or_none():
    same = targets_claim(level({"centroid": 1.0, "median": 1.01, "sensing": 0.99}))
    assert same.verdict == "holds" and len(same.criteria) == len(TARGETS) - 1
    assert targets_claim(level({"centroid": 1.0, "median": 1.1, "sensing": 1.0})).verdict == "holds partly"
    assert targets_claim(level({})).verdict == "undecided"


def test_knowing_the_density_helps_or_does_not():
    for known, verdict in ((0.8, "holds"), (0.97, "holds partly"), (1.2, "does not hold")):
        assert density_claim(level({"known": known, "ignored": 1.0})).verdict == verdict


@pytest.mark.parametrize("controller", ["rapf", "lloyd"])
def test_cells_by_time_help_or_do_not(controller):
    keys = [law.key for law in TEAMS if law.controller == controller]
    assert keys == [f"{controller}-distance", f"{controller}-time"]
    better, worse = (
        teams_claim(level(dict(zip(keys, times, strict=True)), "time"), controller)
        for times in ((2.0, 1.5), (1.5, 2.0))
    )
    assert better.verdict == "holds" and "2 s with cells by distance, 1.5 s by time" in better.explanation
    assert worse.verdict == "does not hold"


def test_messages_are_borne_or_not():
    def found(loss: float, delay: float) -> list[Degradation]:
        return [
            Degradation(axis, value, "rapf", "RAPF", Interval(ratio, ratio, ratio), 9)
            for axis, value, ratio in (("loss", 0.6, loss), ("delay", 1.0, delay))
        ]

    assert conditions_claim(found(1.01, 1.02), 12).verdict == "holds"
    assert conditions_claim(found(1.01, 1.5), 12).verdict == "holds partly"
    assert conditions_claim(found(1.2, 1.5), 12).verdict == "does not hold"
    assert "1.5, with delay 1" in conditions_claim(found(1.2, 1.5), 12).explanation
    assert conditions_claim([], 12).verdict == "undecided"
