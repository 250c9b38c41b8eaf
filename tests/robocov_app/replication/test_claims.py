"""Verdicts on the paper's claims from artificial outcomes, for which the right verdict is known."""

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval, adjust_p_values
from robocov_app.replication.claims import (
    Claim,
    Criterion,
    judge_paper_claims,
    summarize_verdicts,
    thresholds,
)
from robocov_app.replication.claims.claim import CriterionResult, derive_verdict
from robocov_app.replication.claims.convex_claims import judge_convex_final, judge_convex_spreading
from robocov_app.replication.claims.gain_claims import (
    compute_regrets,
    judge_gains_choice,
    judge_gains_every,
    judge_gains_result,
    select_common_instances,
)
from robocov_app.replication.claims.nonconvex_claims import (
    judge_against_lloyd,
    judge_against_rpf,
    judge_gap,
    judge_lloyd_unusable,
)
from robocov_app.replication.claims.registration import load_registration
from robocov_app.replication.claims.start_claims import judge_starts_cost, judge_starts_placement
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.results.outcomes import (
    GainOutcomes,
    Outcomes,
    ProblemInstance,
    compute_matched_distance,
)

pytestmark = pytest.mark.usefixtures("few_resamples")

STARTS = ("corner", "centre", "uniform")
TOO_FEW_MAPS = 11
ENOUGH_MAPS = 30


def build_instances(maps: int, seeds: int = 2) -> tuple[ProblemInstance, ...]:
    return tuple(
        ProblemInstance(f"map {m}", start, seed)
        for m in range(maps)
        for start in STARTS
        for seed in range(seeds)
    )


def build_outcomes(
    maps: int = ENOUGH_MAPS, measure: str = "final", **levels: float | list[float]
) -> Outcomes:
    """Build outcomes in which the cost of each contender is its level times the size of the map.

    A list has a level for each kind of start. Underscores in the keys of contenders stand for hyphens.
    """
    instances = build_instances(maps)
    rng = np.random.default_rng(5)
    map_sizes = np.array([1.0 + get_map_number(instance) for instance in instances])
    start_indices = [STARTS.index(instance.start) for instance in instances]
    values = {}
    for key, level in levels.items():
        levels_by_start = np.broadcast_to(np.asarray(level, dtype=float), len(STARTS))
        noise = 1.0 + 0.001 * rng.standard_normal(len(instances))
        values[key.replace("_", "-"), measure] = levels_by_start[start_indices] * noise * map_sizes
    return Outcomes(instances, values)


def get_map_number(instance: ProblemInstance) -> int:
    return int(instance.map.split()[1])


ORDERED_VERDICTS = ("does not hold", "undecided", "holds partly", "holds")
"""From the worst to the best."""
CRITERION_RESULTS = tuple(
    CriterionResult(is_met, p_value, refutation_p_value)
    for is_met, p_value, refutation_p_value in product(
        (False, None, True), (0.3, 0.002, 0.0002), (0.0002, 0.3)
    )
)
"""All combinations of refuted, open and met with some p-values. Each of the three gets better."""


def is_at_least_as_good(first, second):
    """Return whether the result of a criterion is at least as good as another one."""
    order = (False, None, True)
    return (
        order.index(first.is_met) >= order.index(second.is_met)
        and first.p_value <= second.p_value
        and first.refutation_p_value >= second.refutation_p_value
    )


class TestVerdicts:
    @pytest.mark.parametrize(
        ("bounds", "interval", "met"),
        [
            ((0.0, 1.0), (0.2, 0.8), True),
            ((0.0, 1.0), (0.0, 1.0), True),
            ((0.0, 1.0), (1.1, 1.2), False),
            ((0.0, 1.0), (-2.0, -0.1), False),
            ((0.0, 1.0), (0.9, 1.1), None),
            ((0.0, 1.0), (np.nan, np.nan), None),
            ((-np.inf, 1.0), (-9.0, 0.5), True),
        ],
    )
    def test_a_criterion_is_met_if_its_interval_is_within_the_bounds(self, bounds, interval, met):
        low, high = interval
        assert Criterion("x", Interval((low + high) / 2, low, high), *bounds).is_met is met

    @pytest.mark.parametrize(
        ("kinds", "verdict"),
        [
            (("met", "met"), "holds"),
            (("met",), "holds"),
            (("met", "refuted"), "holds partly"),
            (("open", "met"), "holds partly"),
            (("refuted", "refuted"), "does not hold"),
            (("open", "refuted"), "does not hold"),
            (("open", "open"), "undecided"),
            ((), "undecided"),
        ],
    )
    def test_the_verdict_follows_from_all_criteria(self, kinds, verdict):
        intervals = {"met": (0.1, 0.2), "refuted": (2.0, 3.0), "open": (0.5, 1.5)}
        criteria = tuple(Criterion("x", Interval(1.0, *intervals[kind]), 0.0, 1.0) for kind in kinds)
        assert Claim("k", 1, "c", "", criteria, runs=50, maps=20).verdict == verdict
        assert Claim("k", 1, "c", "", criteria, runs=50, maps=11).verdict == "undecided"

    @pytest.mark.parametrize(("adjusted", "verdict"), [(None, "holds"), (0.05, "holds"), (0.06, "undecided")])
    def test_a_claim_holds_by_its_adjusted_p_value(self, adjusted, verdict):
        criteria = tuple(
            Criterion("x", Interval(0.5, 0.4, 0.6, np.array(samples)), high=1.0)
            for samples in ([0.5, 0.5, 0.5], [0.5, 2.0, 0.5])
        )
        claim = Claim("k", 1, "c", "", criteria, 50, 20, adjusted_p_value=adjusted, family_size=2)
        assert (claim.verdict, claim.p_value) == (verdict, 0.5)
        assert claim.p_value_text == ("p = 0.5" if adjusted is None else f"p = 0.5, Holm-adjusted {adjusted}")

    @pytest.mark.parametrize(
        ("family_size", "verdicts"),
        [(1, ("holds partly", "does not hold")), (40, ("undecided", "undecided"))],
    )
    def test_single_criteria_are_adjusted_for_the_number_of_claims(self, family_size, verdicts):
        samples = np.full(100, 0.5)  # The p-values are 1 / 101.
        met = Criterion("x", Interval(0.5, 0.4, 0.6, samples), high=1.0)
        refuted = Criterion("x", Interval(0.5, 0.4, 0.6, samples), low=1.0)
        assert refuted.refutation_p_value == met.p_value == pytest.approx(1 / 101)
        for criteria, verdict in zip(((met, refuted), (refuted,)), verdicts, strict=True):
            claim = Claim("k", 1, "c", "", criteria, 50, 20, adjusted_p_value=1.0, family_size=family_size)
            assert claim.verdict == verdict

    @pytest.mark.parametrize(
        ("p_values", "verdict"), [((0.001, 0.01), "holds partly"), ((0.002, 0.01), "undecided")]
    )
    def test_a_claim_that_meets_all_criteria_may_hold_partly(self, p_values, verdict):
        results = [CriterionResult(True, p_value, 1.0) for p_value in p_values]
        assert derive_verdict(results, adjusted_p_value=0.06, family_size=40) == verdict
        assert derive_verdict(results, adjusted_p_value=0.05, family_size=40) == "holds"

    @pytest.mark.parametrize("family_size", [1, 2, 40])
    def test_better_results_never_give_a_worse_verdict(self, family_size):
        # Other claims with significant p-values come first in Holm's method, those with a p-value of 1 last.
        other_p_values = {f"other {k}": 1e-5 if k < 25 else 1.0 for k in range(family_size - 1)}

        def rank_verdict(*results):
            p_values = {**other_p_values, "claim": max(result.p_value for result in results)}
            adjusted_p_value = None if family_size == 1 else adjust_p_values(p_values)["claim"]
            return ORDERED_VERDICTS.index(derive_verdict(results, adjusted_p_value, family_size))

        ranks = {pair: rank_verdict(*pair) for pair in product(CRITERION_RESULTS, repeat=2)}
        assert set(ranks.values()) == set(range(len(ORDERED_VERDICTS)))
        for (first, second), rank in ranks.items():
            for better in CRITERION_RESULTS:
                if is_at_least_as_good(better, first):
                    assert ranks[better, second] >= rank
                if is_at_least_as_good(better, second):
                    assert ranks[first, better] >= rank

    @pytest.fixture
    def paper_claims(self):
        """The paper's claims by key; the best gains have no runs."""
        outcomes = build_outcomes(rapf_shared=0.7, rpf_shared=1.0, lloyd=1.0)
        gains = {"rapf": build_gain_outcomes(0.02), "rpf": build_gain_outcomes(0.9)}
        return {claim.key: claim for claim in judge_paper_claims(outcomes, outcomes, outcomes, gains)}

    def test_all_claims_of_the_paper_are_registered(self, paper_claims):
        assert tuple(paper_claims) == load_registration().claims

    def test_p_values_are_adjusted_for_all_claims_of_the_paper(self, paper_claims):
        assert {claim.family_size for claim in paper_claims.values()} == {len(paper_claims)}
        # 200 samples cannot give a smaller p-value. Only that of a binomial test is smaller.
        assert paper_claims["gains-result"].p_value == pytest.approx(1 / 201)
        assert paper_claims["gains-result"].adjusted_p_value == pytest.approx((len(paper_claims) - 1) / 201)
        assert paper_claims["nonconvex-final-best"].adjusted_p_value == 1.0

    def test_the_registered_thresholds_are_those_of_the_code(self):
        for name, value in load_registration().thresholds.items():
            assert getattr(thresholds, name) == pytest.approx(value, abs=1e-12), name

    def test_claims_are_written_as_json(self):
        criterion = Criterion("ratio", Interval(0.9, 0.8, 0.95), high=1.0)
        content = Claim("k", 2, "It is lower.", "VI", (criterion,), 40, 12, "Why.").to_json()
        assert content["key"] == "k"
        assert content["claim"] == "It is lower."
        assert content["verdict"] == "holds"
        assert content["estimate"] == 0.9
        assert content["interval"] == [0.8, 0.95]
        assert content["runs"] == 40
        assert content["criteria"][0]["met"] is True

    @pytest.mark.parametrize(
        ("value", "unit", "text"),
        [
            (0.643, "", "0.643"),
            (0.5, "%", "50%"),
            (0.052, "%", "5.2%"),
            (0.9999, "%", "100%"),
            (-0.031, "%", "−3.1%"),
            (1.234, "m", "1.23 m"),
            (np.inf, "m", "–"),
        ],
    )
    def test_amounts_are_formatted_with_three_digits_and_their_unit(self, value, unit, text):
        assert format_amount(value, unit) == text

    @pytest.mark.parametrize(
        ("low", "high", "text"),
        [(-np.inf, 0.05, "at most 5%"), (0.9, np.inf, "at least 90%"), (0.1, 0.2, "between 10% and 20%")],
    )
    def test_the_range_of_a_criterion_is_described(self, low, high, text):
        assert Criterion("x", Interval(0.0, 0.0, 0.0), low, high, "%").range_text == text


class TestConvex:
    @pytest.mark.parametrize(
        ("level", "verdict"), [(1.004, "holds"), (0.97, "holds partly"), (1.2, "does not hold")]
    )
    def test_the_final_cost_is_compared_with_lloyds(self, level, verdict):
        assert judge_convex_final(build_outcomes(rapf_shared=level, lloyd=1.0)).verdict == verdict

    @pytest.mark.parametrize(("level", "verdict"), [(0.9, "holds"), (1.02, "does not hold")])
    def test_the_early_cost_is_compared_with_lloyds(self, level, verdict):
        outcomes = build_outcomes(measure="early", rapf_shared=level, lloyd=1.0)
        assert judge_convex_spreading(outcomes).verdict == verdict

    def test_spreading_is_undecided_if_equally_many_maps_are_won_and_lost(self):
        outcomes = build_outcomes(measure="early", lloyd=1.0)
        is_odd = np.array([get_map_number(instance) % 2 for instance in outcomes.instances])
        rapf = outcomes.values["lloyd", "early"] * np.where(is_odd, 1.1, 1 / 1.1)
        values = {**outcomes.values, ("rapf-shared", "early"): rapf}
        assert judge_convex_spreading(Outcomes(outcomes.instances, values)).verdict == "undecided"

    def test_only_clustered_starts_count_for_spreading(self):
        outcomes = build_outcomes(measure="early", rapf_shared=[0.9, 0.9, 5.0], lloyd=1.0)
        claim = judge_convex_spreading(outcomes)
        assert claim.verdict == "holds"
        assert claim.runs == 2 * ENOUGH_MAPS * 2 * 2


class TestNonConvex:
    @pytest.mark.parametrize(
        ("level", "verdict", "gains", "period"),
        [
            (0.7, "holds", "shared", "final"),
            (0.97, "holds partly", "best", "final"),
            (1.1, "does not hold", "shared", "motion"),
            ([0.6, 0.6, 1.2], "holds partly", "best", "motion"),
        ],
    )
    def test_rapf_is_compared_with_rpf(self, gains, period, level, verdict):
        measure = {"final": "final", "motion": "first_minute"}[period]
        levels = {f"rapf_{gains}": level, f"rpf_{gains}": 1.0}
        claim = judge_against_rpf(build_outcomes(measure=measure, **levels), gains, period)
        assert claim.verdict == verdict
        assert claim.key == f"nonconvex-{period}-{gains}"

    def test_the_explanation_describes_lost_runs(self):
        claim = judge_against_rpf(
            build_outcomes(rapf_shared=[0.6, 0.7, 1.2], rpf_shared=1.0), "shared", "final"
        )
        assert "corner 0.6, center 0.7, uniform 1.2" in claim.explanation
        assert f"RAPF loses {ENOUGH_MAPS * 2} of {ENOUGH_MAPS * 6}" in claim.explanation
        assert "start uniform" in claim.explanation

    @pytest.mark.parametrize(
        ("level", "verdict"), [(0.8, "holds"), (0.99, "holds partly"), (1.1, "does not hold")]
    )
    def test_rapf_is_compared_with_lloyd(self, level, verdict):
        assert judge_against_lloyd(build_outcomes(rapf_shared=level, lloyd=1.0)).verdict == verdict

    def test_claims_on_few_maps_are_undecided(self):
        claim = judge_against_rpf(
            build_outcomes(TOO_FEW_MAPS, rapf_shared=0.5, rpf_shared=1.0), "shared", "final"
        )
        assert (claim.verdict, claim.maps) == ("undecided", TOO_FEW_MAPS)

    def test_failed_runs_are_left_out_in_pairs(self):
        outcomes = build_outcomes(rapf_shared=0.5, rpf_shared=1.0)
        outcomes.values["rapf-shared", "final"][3] = np.nan
        outcomes.values["rpf-shared", "final"][[3, 7]] = np.nan
        claim = judge_against_rpf(outcomes, "shared", "final")
        assert claim.runs == 2 * (ENOUGH_MAPS * 6 - 2)
        assert claim.criteria[0].interval.estimate == pytest.approx(0.5, rel=0.01)


class TestStarts:
    @pytest.mark.parametrize(
        ("rapf", "rpf", "verdict"),
        [
            ([1.0, 1.02, 0.98], [1.0, 1.5, 2.0], "holds"),
            ([1.0, 1.02, 0.98], [1.0, 1.02, 0.98], "holds partly"),
            ([1.0, 1.5, 2.0], [1.0, 1.5, 2.0], "holds partly"),
            ([1.0, 1.5, 2.0], [1.0, 1.01, 1.0], "does not hold"),
        ],
    )
    def test_the_variation_of_the_cost_is_compared(self, rapf, rpf, verdict):
        assert judge_starts_cost(build_outcomes(rapf_shared=rapf, rpf_shared=rpf)).verdict == verdict

    @pytest.mark.parametrize(
        ("rapf_shift", "rpf_shift", "verdict"),
        [(0.1, 3.0, "holds"), (2.0, 3.5, "holds partly"), (3.5, 2.0, "does not hold")],
    )
    def test_the_shift_of_final_positions_is_compared(self, rapf_shift, rpf_shift, verdict):
        outcomes = build_outcomes(rapf_shared=1.0, rpf_shared=1.0)
        values = dict(outcomes.values)
        rng = np.random.default_rng(1)
        row = np.stack([4.0 * np.arange(6.0), np.zeros(6)], axis=1)
        start_indices = np.array([STARTS.index(start) for start in outcomes.starts], dtype=float)
        for key, shift in (("rapf-shared", rapf_shift), ("rpf-shared", rpf_shift)):
            # The final positions of each kind of start are shifted upwards from those of the previous one.
            offsets = (shift * start_indices)[:, None, None] * [0.0, 1.0]
            values[key, "placement"] = row + offsets + 0.01 * rng.random((len(start_indices), 6, 2))
        length_scale_by_map = dict.fromkeys(outcomes.maps, 4.0)
        claim = judge_starts_placement(Outcomes(outcomes.instances, values, length_scale_by_map))
        assert claim.verdict == verdict
        assert claim.criteria[0].interval.estimate == pytest.approx(rapf_shift / 4.0, rel=0.1)


class TestLloydAndGaps:
    @pytest.mark.parametrize(
        ("clearance", "blocked", "gap", "verdict"),
        [
            (0.0, 0.5, 0.5, "holds"),
            (0.0, 0.05, 0.05, "holds partly"),
            (0.2, 0.5, 0.05, "holds partly"),
            (0.2, 0.05, 0.05, "does not hold"),
        ],
    )
    def test_lloyd_is_unusable_if_it_touches_walls_and_is_blocked(self, clearance, blocked, gap, verdict):
        instances = build_instances(ENOUGH_MAPS, 4)
        values = {
            ("lloyd", "clearance"): np.full(len(instances), clearance),
            ("lloyd", "blocked"): np.full(len(instances), blocked),
            ("lloyd", "gap"): np.full(len(instances), gap),
            ("rapf-shared", "clearance"): np.full(len(instances), 0.2),
            ("rapf-shared", "blocked"): np.full(len(instances), 0.25),
        }
        claim = judge_lloyd_unusable(Outcomes(instances, values))
        assert claim.verdict == verdict
        assert "RAPF, shared gains: walls touched in 0%, 25% of the robots blocked." in claim.explanation

    @pytest.mark.parametrize(
        ("controller", "gains", "gap", "verdict"),
        [
            ("rapf", "shared", 0.05, "holds"),
            ("rapf", "best", 0.2, "does not hold"),
            ("rpf", "shared", 0.7, "holds"),
            ("rpf", "default", 0.1, "does not hold"),
            ("lloyd", None, 0.08, "holds"),
        ],
    )
    def test_the_gap_is_compared_with_its_bound(self, controller, gains, gap, verdict):
        instances = build_instances(ENOUGH_MAPS)
        rng = np.random.default_rng(0)
        key = f"{controller}-{gains}" if gains else controller
        values = {(key, "gap"): gap + 0.01 * rng.standard_normal(len(instances))}
        claim = judge_gap(Outcomes(instances, values), controller, gains)
        assert (claim.verdict, claim.key) == (verdict, f"gap-{key}")

    def test_claims_at_limited_ranges_have_their_own_keys_and_texts(self):
        claim = judge_against_rpf(
            build_outcomes(rapf_shared=0.5, rpf_shared=1.0), "shared", "final", limited=True
        )
        assert claim.key == "limited-nonconvex-final-shared"
        assert (
            claim.text == "At limited ranges, in a non-convex environment RAPF ends at a lower cost than RPF."
        )


def build_gain_outcomes(
    spread: float, maps: int = ENOUGH_MAPS, is_map_dependent: bool = False
) -> GainOutcomes:
    """Build outcomes of nine sets of gains; the fifth is the best everywhere, or another one on each map."""
    instances = build_instances(maps, 1)
    gains = tuple(
        {"k_rep": k_rep, "rho_0": value, "k_att": value}
        for k_rep in (0.1, 1.0, 10.0)
        for value in (1.0, 3.0, 30.0)
    )
    best = np.full(len(instances), 4)
    if is_map_dependent:
        best = np.array([get_map_number(instance) % 9 for instance in instances])
    # The cost grows from the best set to the neighboring sets, and so on.
    distances = np.abs(np.arange(9)[:, None] - best) / 8.0
    noise = 1e-4 * np.random.default_rng(2).random((9, len(instances)))
    return GainOutcomes(instances, gains, 1.0 + spread * distances + noise)


class TestGains:
    @pytest.mark.parametrize(
        ("worst_ratio", "verdict"), [(0.9, "holds"), (1.0, "undecided"), (1.1, "does not hold")]
    )
    def test_every_set_of_the_grid_counts(self, worst_ratio, verdict):
        instances = build_instances(ENOUGH_MAPS, 1)
        potentials = [{"k_rep": k_rep, "rho_0": 2.0} for k_rep in (0.1, 1.0)]
        rapf_gains = tuple(potential | {"k_att": k_att} for k_att in (1.0, 3.0) for potential in potentials)
        noise = 1.0 + 0.01 * np.random.default_rng(3).standard_normal((4, len(instances)))
        ratios = np.array([0.5, 0.6, worst_ratio, 0.7])[:, None] * noise
        rpf = GainOutcomes(instances, tuple(potentials), np.full((2, len(instances)), 2.0))
        claim = judge_gains_every(GainOutcomes(instances, rapf_gains, 2.0 * ratios), rpf)
        assert claim.verdict == verdict
        assert claim.criteria[0].interval.estimate == pytest.approx(worst_ratio, rel=0.01)
        assert "(k_rep 0.1, rho_0 2, k_att 3)" in claim.explanation

    @pytest.mark.parametrize(
        ("rapf", "rpf", "verdict"),
        [
            (0.02, 0.9, "holds"),
            (0.02, 0.05, "holds partly"),
            (0.5, 0.9, "holds partly"),
            (0.9, 0.05, "does not hold"),
        ],
    )
    def test_result(self, rapf, rpf, verdict):
        claim = judge_gains_result(build_gain_outcomes(rapf), build_gain_outcomes(rpf))
        assert claim.verdict == verdict
        assert claim.runs == 2 * 9 * ENOUGH_MAPS * 3

    @pytest.mark.parametrize(
        ("rapf", "rpf", "verdict"),
        [(False, True, "holds"), (False, False, "holds partly"), (True, False, "does not hold")],
    )
    def test_choice(self, rapf, rpf, verdict):
        claim = judge_gains_choice(
            build_gain_outcomes(0.9, is_map_dependent=rapf), build_gain_outcomes(0.9, is_map_dependent=rpf)
        )
        assert claim.verdict == verdict

    def test_the_regret_is_zero_if_one_set_is_best_everywhere(self):
        regrets, maps = compute_regrets(build_gain_outcomes(0.9))
        assert regrets == pytest.approx(np.zeros(ENOUGH_MAPS * 3))
        assert len(set(maps)) == ENOUGH_MAPS

    def test_the_mean_regret_is_zero_if_gains_make_no_difference(self):
        instances = build_instances(40, 1)
        noise = 1.0 + 0.05 * np.random.default_rng(4).standard_normal((9, len(instances)))
        gains = tuple({"k": float(k)} for k in range(9))
        regrets, _ = compute_regrets(GainOutcomes(instances, gains, noise))
        assert abs(regrets.mean()) < 3 * regrets.std() / np.sqrt(len(regrets))

    def test_instances_with_a_failed_run_are_left_out(self):
        rapf = build_gain_outcomes(0.02)
        rapf.relative_costs[2, 5] = np.nan
        claim = judge_gains_result(*select_common_instances(rapf, build_gain_outcomes(0.9)))
        assert claim.runs == 2 * 9 * (ENOUGH_MAPS * 3 - 1)
        assert rapf.find_best() == 4


@pytest.mark.parametrize(
    "judge",
    [
        judge_convex_final,
        judge_convex_spreading,
        lambda outcomes: judge_against_rpf(outcomes, "best", "motion"),
        judge_against_lloyd,
        judge_starts_cost,
        judge_starts_placement,
        judge_lloyd_unusable,
        lambda outcomes: judge_gap(outcomes, "lloyd"),
    ],
)
def test_claims_without_runs_are_undecided(judge):
    claim = judge(Outcomes((), {}))
    assert claim.verdict == "undecided"
    assert claim.runs == 0
    assert claim.to_json()["estimate"] is None


@pytest.mark.parametrize("judge", [judge_gains_result, judge_gains_choice, judge_gains_every])
def test_claims_on_gains_without_runs_are_undecided(judge):
    outcomes = GainOutcomes((), ({"k_rep": 1.0},), np.empty((1, 0)))
    assert judge(outcomes, outcomes).verdict == "undecided"


positions = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=5)


class TestMatchedDistance:
    @given(st.data())
    def test_it_is_the_minimum_over_all_permutations(self, data):
        first = np.array(data.draw(positions))
        second = np.array(
            data.draw(st.lists(st.tuples(*[st.floats(-9, 9)] * 2), min_size=len(first), max_size=len(first)))
        )
        distances = [
            np.linalg.norm(first - second[list(order)], axis=1).mean()
            for order in permutations(range(len(first)))
        ]
        assert compute_matched_distance(first, second) == pytest.approx(min(distances), abs=1e-9)

    @given(positions, st.randoms())
    def test_it_does_not_depend_on_the_order_of_robots(self, points, random):
        first = np.array(points)
        second = first.tolist()
        random.shuffle(second)
        assert compute_matched_distance(first, np.array(second)) == pytest.approx(0.0, abs=1e-9)

    def test_only_pairs_with_different_starts_count(self):
        x = [0.0, 9.0, 1.0, np.nan, 0.0, 9.0]
        starts = (("m", "a"), ("m", "a"), ("m", "b"), ("m", "b"), ("n", "a"), ("o", "b"))
        outcomes = Outcomes(
            tuple(ProblemInstance(map_name, start, k) for k, (map_name, start) in enumerate(starts)),
            {("lloyd", "placement"): np.stack([x, np.zeros(6)], axis=1)[:, None]},
            dict.fromkeys("mno", 3.0),
        )
        # The distances on map m are 1 m and 8 m, their mean 4.5 m.
        assert outcomes.compute_placement_spreads("lloyd") == {"m": pytest.approx(1.5)}
        assert outcomes.compute_placement_spreads("rapf") == {}


def test_the_summary_counts_verdicts():
    def build_claim(*interval):
        criterion = Criterion("", Interval(*interval), high=1.0)
        return Claim("k", 1, "", "", (criterion,), 12, 12)

    holds = build_claim(0.5, 0.4, 0.6)
    fails = build_claim(2.0, 1.9, 2.1)
    undecided = build_claim(1.0, 0.9, 1.1)
    assert summarize_verdicts([holds, holds, undecided]) == "Of 3 claims, 2 hold, 1 is undecided."
    assert summarize_verdicts([holds, fails, undecided, undecided]) == (
        "Of 4 claims, 1 holds, 1 does not hold, 2 are undecided."
    )
