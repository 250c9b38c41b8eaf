"""Each claim on artificial outcomes whose truth is known: it holds, partly, not at all, or is undecided."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication.claims import (
    Claim,
    Criterion,
    judge_paper_claims,
    summarize_verdicts,
    thresholds,
)
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
FEW = 11
MANY = 30


def build_instances(maps: int, seeds: int = 2) -> tuple[ProblemInstance, ...]:
    return tuple(
        ProblemInstance(f"map {m}", start, seed)
        for m in range(maps)
        for start in STARTS
        for seed in range(seeds)
    )


def build_outcomes(maps: int = MANY, measure: str = "final", **levels: float | list[float]) -> Outcomes:
    """Build outcomes in which the cost of each contender is its level times the size of the map."""
    instances = build_instances(maps)
    rng = np.random.default_rng(5)
    size = np.array([1.0 + int(s.map.split()[1]) for s in instances])
    values = {}
    for law, level in levels.items():
        by_start = np.broadcast_to(np.asarray(level, dtype=float), 3)
        of_start = np.array([by_start[STARTS.index(s.start)] for s in instances])
        noise = 1.0 + 0.001 * rng.standard_normal(len(instances))
        values[law.replace("_", "-"), measure] = of_start * noise * size
    return Outcomes(instances, values)


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
    def test_a_criterion(self, bounds, interval, met):
        low, high = interval
        assert Criterion("x", Interval((low + high) / 2, low, high), *bounds).is_met is met

    @pytest.mark.parametrize(
        ("outcomes", "verdict"),
        [
            ("yes yes", "holds"),
            ("yes", "holds"),
            ("yes no", "holds partly"),
            ("open yes", "holds partly"),
            ("no no", "does not hold"),
            ("open no", "does not hold"),
            ("open open", "undecided"),
            ("", "undecided"),
        ],
    )
    def test_the_verdict_follows_from_all_criteria(self, outcomes, verdict):
        interval = {"yes": (0.1, 0.2), "no": (2.0, 3.0), "open": (0.5, 1.5)}
        criteria = tuple(
            Criterion("x", Interval(1.0, *interval[word]), 0.0, 1.0) for word in outcomes.split()
        )
        assert Claim("k", 1, "c", "", criteria, runs=50, maps=20).verdict == verdict
        assert Claim("k", 1, "c", "", criteria, runs=50, maps=11).verdict == "undecided"

    @pytest.mark.parametrize(("adjusted", "verdict"), [(None, "holds"), (0.05, "holds"), (0.06, "undecided")])
    def test_a_claim_holds_by_its_adjusted_p_value(self, adjusted, verdict):
        criteria = tuple(
            Criterion("x", Interval(0.5, 0.4, 0.6, np.array(drawn)), high=1.0)
            for drawn in ([0.5, 0.5, 0.5], [0.5, 2.0, 0.5])
        )
        claim = Claim("k", 1, "c", "", criteria, 50, 20, adjusted_p_value=adjusted)
        assert (claim.verdict, claim.p_value) == (verdict, 0.5)
        assert claim.p_value_text == ("p = 0.5" if adjusted is None else f"p = 0.5, Holm-adjusted {adjusted}")

    @pytest.mark.parametrize(
        ("family_size", "verdicts"),
        [(1, ("holds partly", "does not hold")), (40, ("undecided", "undecided"))],
    )
    def test_single_criteria_are_adjusted_for_the_number_of_claims(self, family_size, verdicts):
        samples = np.full(100, 0.5)  # the p-values are 1/101
        met = Criterion("x", Interval(0.5, 0.4, 0.6, samples), high=1.0)
        refuted = Criterion("x", Interval(0.5, 0.4, 0.6, samples), low=1.0)
        assert refuted.refutation_p_value == met.p_value == pytest.approx(1 / 101)
        for criteria, verdict in zip(((met, refuted), (refuted,)), verdicts, strict=True):
            claim = Claim("k", 1, "c", "", criteria, 50, 20, adjusted_p_value=1.0, family_size=family_size)
            assert claim.verdict == verdict

    def test_all_claims_of_the_paper_are_registered_and_adjusted_together(self):
        outcomes = build_outcomes(rapf_shared=0.7, rpf_shared=1.0, lloyd=1.0)
        gains = {"rapf": build_gain_outcomes(0.02), "rpf": build_gain_outcomes(0.9)}
        found = {claim.key: claim for claim in judge_paper_claims(outcomes, outcomes, outcomes, gains)}
        assert tuple(found) == load_registration().claims
        assert {claim.family_size for claim in found.values()} == {len(found)}
        # the p-value is the smallest of 200 samples; only that of a binomial test is smaller
        assert found["gains-result"].p_value == pytest.approx(1 / 201)
        assert found["gains-result"].adjusted_p_value == pytest.approx((len(found) - 1) / 201)
        assert found["nonconvex-final-best"].adjusted_p_value == 1.0  # without a run

    def test_the_registered_thresholds_are_those_of_the_code(self):
        for name, value in load_registration().thresholds.items():
            assert getattr(thresholds, name) == pytest.approx(value, abs=1e-12), name

    def test_json_has_the_promised_keys(self):
        criterion = Criterion("ratio", Interval(0.9, 0.8, 0.95), high=1.0)
        found = Claim("k", 2, "It is lower.", "VI", (criterion,), 40, 12, "Why.").to_json()
        assert found["claim"] == "It is lower."
        assert (found["verdict"], found["estimate"], found["interval"]) == ("holds", 0.9, [0.8, 0.95])
        assert (found["runs"], found["key"], found["criteria"][0]["met"]) == (40, "k", True)

    @pytest.mark.parametrize(
        ("value", "unit", "text"),
        [
            (0.643, "", "0.643"),
            (0.5, "%", "50 %"),
            (0.052, "%", "5.2 %"),
            (0.9999, "%", "100 %"),
            (-0.031, "%", "−3.1 %"),
            (1.234, "m", "1.23 m"),
            (np.inf, "m", "–"),
        ],
    )
    def test_amounts(self, value, unit, text):
        assert format_amount(value, unit) == text

    @pytest.mark.parametrize(
        ("low", "high", "text"),
        [(-np.inf, 0.05, "at most 5 %"), (0.9, np.inf, "at least 90 %"), (0.1, 0.2, "between 10 % and 20 %")],
    )
    def test_the_range_as_text(self, low, high, text):
        assert Criterion("x", Interval(0.0, 0.0, 0.0), low, high, "%").range_text == text


class TestConvex:
    @pytest.mark.parametrize(
        ("level", "verdict"), [(1.004, "holds"), (0.97, "holds partly"), (1.2, "does not hold")]
    )
    def test_final_cost(self, level, verdict):
        assert judge_convex_final(build_outcomes(rapf_shared=level, lloyd=1.0)).verdict == verdict

    @pytest.mark.parametrize(
        ("level", "verdict"), [(0.9, "holds"), (1.02, "does not hold"), (1.0, "undecided")]
    )
    def test_spreading(self, level, verdict):
        found = build_outcomes(measure="early", rapf_shared=level, lloyd=1.0)
        if verdict == "undecided":  # wins on half of the maps, by as much as it loses on the others
            values = dict(found.values)
            odd = np.array([int(map_.split()[1]) % 2 for map_ in found.maps])
            values["rapf-shared", "early"] = values["lloyd", "early"] * np.where(odd, 1.1, 1 / 1.1)
            found = Outcomes(found.instances, values)
        assert judge_convex_spreading(found).verdict == verdict

    def test_only_starts_close_together_count(self):
        found = build_outcomes(measure="early", rapf_shared=[0.9, 0.9, 5.0], lloyd=1.0)
        claim = judge_convex_spreading(found)
        assert claim.verdict == "holds"
        assert claim.runs == 2 * MANY * 2 * 2


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
    def test_against_rpf(self, gains, period, level, verdict):
        measure = {"final": "final", "motion": "first_minute"}[period]
        laws = {f"rapf_{gains}": level, f"rpf_{gains}": 1.0}
        claim = judge_against_rpf(build_outcomes(measure=measure, **laws), gains, period)
        assert claim.verdict == verdict
        assert claim.key == f"nonconvex-{period}-{gains}"

    def test_losses_are_described(self):
        claim = judge_against_rpf(
            build_outcomes(rapf_shared=[0.6, 0.7, 1.2], rpf_shared=1.0), "shared", "final"
        )
        assert "corner 0.6, center 0.7, uniform 1.2" in claim.explanation
        assert f"RAPF loses {MANY * 2} of {MANY * 6}" in claim.explanation
        assert "start uniform" in claim.explanation

    @pytest.mark.parametrize(
        ("level", "verdict"), [(0.8, "holds"), (0.99, "holds partly"), (1.1, "does not hold")]
    )
    def test_against_lloyd(self, level, verdict):
        assert judge_against_lloyd(build_outcomes(rapf_shared=level, lloyd=1.0)).verdict == verdict

    def test_few_maps_decide_nothing(self):
        claim = judge_against_rpf(build_outcomes(FEW, rapf_shared=0.5, rpf_shared=1.0), "shared", "final")
        assert (claim.verdict, claim.maps) == ("undecided", FEW)

    def test_runs_that_failed_drop_out_in_pairs(self):
        whole = build_outcomes(rapf_shared=0.5, rpf_shared=1.0)
        whole.values["rapf-shared", "final"][3] = np.nan
        whole.values["rpf-shared", "final"][[3, 7]] = np.nan
        claim = judge_against_rpf(whole, "shared", "final")
        assert claim.runs == 2 * (MANY * 6 - 2)
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
    def test_cost(self, rapf, rpf, verdict):
        assert judge_starts_cost(build_outcomes(rapf_shared=rapf, rpf_shared=rpf)).verdict == verdict

    @pytest.mark.parametrize(
        ("ours", "theirs", "verdict"),
        [(0.1, 3.0, "holds"), (2.0, 3.5, "holds partly"), (3.5, 2.0, "does not hold")],
    )
    def test_placement(self, ours, theirs, verdict):
        found = build_outcomes(rapf_shared=1.0, rpf_shared=1.0)
        rng = np.random.default_rng(1)
        shift = np.array([STARTS.index(start) for start in found.starts], dtype=float)
        base = np.stack([4.0 * np.arange(6.0), np.zeros(6)], axis=1)
        places = {
            (law, "placement"): base[None]
            + (reach * shift)[:, None, None] * [0.0, 1.0]
            + 0.01 * rng.random((len(shift), 6, 2))
            for law, reach in (("rapf-shared", ours), ("rpf-shared", theirs))
        }
        shares = dict.fromkeys(found.maps, 4.0)
        claim = judge_starts_placement(Outcomes(found.instances, {**found.values, **places}, shares))
        assert claim.verdict == verdict
        assert claim.criteria[0].interval.estimate == pytest.approx(ours / 4.0, rel=0.1)


class TestStuckAndGap:
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
        instances = build_instances(MANY, 4)
        values = {
            ("lloyd", "clearance"): np.full(len(instances), clearance),
            ("lloyd", "blocked"): np.full(len(instances), blocked),
            ("lloyd", "gap"): np.full(len(instances), gap),
            ("rapf-shared", "clearance"): np.full(len(instances), 0.2),
            ("rapf-shared", "blocked"): np.full(len(instances), 0.25),
        }
        claim = judge_lloyd_unusable(Outcomes(instances, values))
        assert claim.verdict == verdict
        assert "RAPF, shared gains: walls touched in 0 %, 25 % of the robots blocked." in claim.explanation

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
    def test_gap(self, controller, gains, gap, verdict):
        instances = build_instances(MANY)
        rng = np.random.default_rng(0)
        key = f"{controller}-{gains}" if gains else controller
        values = {(key, "gap"): gap + 0.01 * rng.standard_normal(len(instances))}
        claim = judge_gap(Outcomes(instances, values), controller, gains)
        assert (claim.verdict, claim.key) == (verdict, f"gap-{key}")

    def test_claims_at_limited_ranges_have_keys_and_texts_of_their_own(self):
        claim = judge_against_rpf(
            build_outcomes(rapf_shared=0.5, rpf_shared=1.0), "shared", "final", limited=True
        )
        assert claim.key == "limited-nonconvex-final-shared"
        assert (
            claim.text == "At limited ranges, in a non-convex environment RAPF ends at a lower cost than RPF."
        )


def build_gain_outcomes(spread: float, maps: int = MANY, is_map_dependent: bool = False) -> GainOutcomes:
    """Build outcomes of nine sets of gains; the fifth is the best everywhere, or another one on each map."""
    instances = build_instances(maps, 1)
    gains = tuple({"k_rep": a, "rho_0": b, "k_att": b} for a in (0.1, 1.0, 10.0) for b in (1.0, 3.0, 30.0))
    rng = np.random.default_rng(2)
    best = [int(s.map.split()[1]) % 9 if is_map_dependent else 4 for s in instances]
    worse = np.abs(np.arange(9)[:, None] - np.array(best)[None]) / 8.0
    return GainOutcomes(instances, gains, 1.0 + spread * worse + 1e-4 * rng.random((9, len(instances))))


class TestGains:
    @pytest.mark.parametrize(
        ("worst_ratio", "verdict"), [(0.9, "holds"), (1.0, "undecided"), (1.1, "does not hold")]
    )
    def test_every_set_of_the_grid_counts(self, worst_ratio, verdict):
        instances = build_instances(MANY, 1)
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
        assert claim.runs == 2 * 9 * MANY * 3

    @pytest.mark.parametrize(
        ("rapf", "rpf", "verdict"),
        [(False, True, "holds"), (False, False, "holds partly"), (True, False, "does not hold")],
    )
    def test_choice(self, rapf, rpf, verdict):
        claim = judge_gains_choice(
            build_gain_outcomes(0.9, is_map_dependent=rapf), build_gain_outcomes(0.9, is_map_dependent=rpf)
        )
        assert claim.verdict == verdict

    def test_regret_is_nothing_where_one_set_is_best_everywhere(self):
        found, maps = compute_regrets(build_gain_outcomes(0.9))
        assert found == pytest.approx(np.zeros(MANY * 3))
        assert len(set(maps)) == MANY

    def test_regret_does_not_favor_gains_chosen_by_chance(self):
        """Where gains make no difference, knowing the map is worth nothing: the mean regret is zero."""
        instances = build_instances(40, 1)
        noise = 1.0 + 0.05 * np.random.default_rng(4).standard_normal((9, len(instances)))
        found, _ = compute_regrets(GainOutcomes(instances, tuple({"k": float(k)} for k in range(9)), noise))
        assert abs(found.mean()) < 3 * found.std() / np.sqrt(len(found))

    def test_instances_with_a_failed_run_do_not_count(self):
        broken = build_gain_outcomes(0.02)
        broken.excess[2, 5] = np.nan
        claim = judge_gains_result(*select_common_instances(broken, build_gain_outcomes(0.9)))
        assert claim.runs == 2 * 9 * (MANY * 3 - 1)
        assert broken.find_best() == 4


@pytest.mark.parametrize(
    "claim",
    [
        judge_convex_final,
        judge_convex_spreading,
        lambda o: judge_against_rpf(o, "best", "motion"),
        judge_against_lloyd,
        judge_starts_cost,
        judge_starts_placement,
        judge_lloyd_unusable,
        lambda o: judge_gap(o, "lloyd"),
    ],
)
def test_without_any_run_claims_are_undecided(claim):
    found = claim(Outcomes((), {}))
    assert (found.verdict, found.runs, found.to_json()["estimate"]) == ("undecided", 0, None)
    nothing = GainOutcomes((), ({"k_rep": 1.0},), np.empty((1, 0)))
    assert (
        judge_gains_result(nothing, nothing).verdict
        == judge_gains_choice(nothing, nothing).verdict
        == judge_gains_every(nothing, nothing).verdict
        == "undecided"
    )


places = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=1, max_size=5)


class TestMatchedDistance:
    @given(st.data())
    def test_is_the_minimum_over_all_permutations(self, data):
        first = np.array(data.draw(places))
        second = np.array(
            data.draw(st.lists(st.tuples(*[st.floats(-9, 9)] * 2), min_size=len(first), max_size=len(first)))
        )
        least = min(
            np.hypot(*(first - second[list(order)]).T).mean() for order in permutations(range(len(first)))
        )
        assert compute_matched_distance(first, second) == pytest.approx(least, abs=1e-9)

    @given(places, st.randoms())
    def test_does_not_depend_on_the_order_of_robots(self, positions, random):
        first = np.array(positions)
        second = first.copy().tolist()
        random.shuffle(second)
        assert compute_matched_distance(first, np.array(second)) == pytest.approx(0.0, abs=1e-9)

    def test_only_pairs_of_different_starts_count(self):
        ends = np.array([[[0.0, 0.0]], [[9.0, 0.0]], [[1.0, 0.0]], [[np.nan, 0.0]]])
        starts = (("m", "a"), ("m", "a"), ("m", "b"), ("m", "b"), ("n", "a"), ("o", "b"))
        found = Outcomes(
            tuple(ProblemInstance(name, start, k) for k, (name, start) in enumerate(starts)),
            {("lloyd", "placement"): np.concatenate([ends, ends[:2]])},
            dict.fromkeys("mno", 3.0),
        )
        assert found.compute_placement_spreads("lloyd") == {"m": pytest.approx(1.5)}
        assert found.compute_placement_spreads("rapf") == {}


def test_the_summary_counts_verdicts():
    def build_claims(*verdicts):
        kinds = {
            "holds": Interval(0.5, 0.4, 0.6),
            "not": Interval(2.0, 1.9, 2.1),
            "open": Interval(1.0, 0.9, 1.1),
        }
        return [Claim("k", 1, "", "", (Criterion("", kinds[word], high=1.0),), 12, 12) for word in verdicts]

    assert summarize_verdicts(build_claims("holds", "holds", "open")) == "Of 3 claims 2 hold, 1 is undecided."
    assert summarize_verdicts(build_claims("holds", "not", "open", "open")) == (
        "Of 4 claims 1 holds, 1 does not hold, 2 are undecided."
    )
