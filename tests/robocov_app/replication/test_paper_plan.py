from dataclasses import replace

import pytest
from tiny_paper import TINY

from robocov.mapfile import load_map
from robocov_app.replication import plan as planned
from robocov_app.replication.contenders import LLOYD, RAPF_SHARED, RPF_SHARED, best
from robocov_app.replication.maps import KINDS
from robocov_app.replication.plan import FULL, QUICK
from robocov_app.sweep.study import tasks_of

BEST = {
    "rapf": best("rapf", {"k_rep": 0.3, "rho_0": 3.0, "k_att": 30.0, "attraction_limit": None}),
    "rpf": best("rpf", {"k_rep": 10.0, "rho_0": 6.0}),
}

both = pytest.mark.parametrize(
    "plan", [pytest.param(FULL, marks=pytest.mark.slow), QUICK], ids=["full", "quick"]
)


@both
def test_gains_are_tuned_on_other_maps_and_starts_than_they_are_tested_on(plan):
    assert not set(plan.tuning) & set(plan.generated)
    assert plan.tuning_seed not in plan.seeds
    tuned, tested = planned.tuning_maps(plan), planned.claim_maps(plan)
    assert not {each.environment.obstacles for each in tuned} & {
        each.environment.obstacles for each in tested
    }
    # the best gains have something to be chosen from
    assert len(plan.tuning) >= 5 and len(plan.tuning_starts) >= 2


@pytest.mark.slow
def test_the_full_study_is_as_large_as_it_is_said_to_be():
    assert len(planned.claim_maps(FULL)) == 33
    assert len(FULL.generated) >= 20
    assert len(planned.convex_maps(FULL)) == 8
    study = planned.claims_study(FULL, BEST)
    assert study.starts == KINDS
    assert len(study) == 33 * 3 * 4 * 6
    assert len(planned.gains_study(FULL)) == 6 * 3 * (20 + 80)


def test_every_law_moves_under_the_same_limits_from_the_same_places():
    study = planned.claims_study(TINY, BEST)
    tasks = list(tasks_of(study))
    assert len({tuple(task.team.items()) for task in tasks}) == 1
    assert len({(task.duration, task.dt, task.lattice) for task in tasks}) == 1
    scenarios = {(task.map, task.start, task.seed) for task in tasks}
    for scenario in scenarios:
        laws = [task for task in tasks if (task.map, task.start, task.seed) == scenario]
        assert len(laws) == 6
        assert len({task.document for task in laws}) == 1


def test_shared_gains_are_shared_and_the_papers_formula_is_not_limited():
    rapf, rpf = planned.complete_gains(RAPF_SHARED), planned.complete_gains(RPF_SHARED)
    assert {name: rapf[name] for name in rpf} == rpf
    assert rapf["attraction_limit"] is None
    grids = planned.gain_sets(FULL)
    assert all(gains["attraction_limit"] is None for gains in grids["rapf"])
    potentials = {(gains["k_rep"], gains["rho_0"]) for gains in grids["rapf"]}
    assert potentials == {(gains["k_rep"], gains["rho_0"]) for gains in grids["rpf"]}
    # no sensor cuts a repulsion off
    assert FULL.team["sensing_range"] >= max(FULL.rho_0)
    assert QUICK.team["sensing_range"] >= max(QUICK.rho_0)


def test_best_gains_that_are_the_shared_ones_are_run_once():
    same = {"rapf": best("rapf", RAPF_SHARED.gains), "rpf": best("rpf", RPF_SHARED.gains)}
    study = planned.claims_study(TINY, same)
    assert len(study) == 2 * 3 * 4
    laws = planned.distinct((RAPF_SHARED, LLOYD, same["rapf"]))
    assert [controller for controller, _ in laws] == ["rapf", "lloyd"]


def test_figures_4_and_6_begin_in_the_same_places_and_8_elsewhere():
    first, second = load_map("blocks-a"), load_map("blocks-b")
    assert first.starts["paper"] == second.starts["paper"] != second.starts["other"]
    studies = planned.figure_studies(TINY)
    assert studies["figures-a"].starts == ("paper",)
    assert studies["figures-b"].starts == ("paper", "other")
    assert {len(study) for study in studies.values()} == {2, 4}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*QUICK.generated, *QUICK.tuning])
def test_generated_maps_are_as_they_are_described(seed):
    environment = planned.generated_test_map(seed)
    assert environment == planned.generated_test_map(seed)
    assert tuple(environment.starts) == KINDS
    assert 4 <= len(environment.obstacles) <= 8
    assert 0.155 <= 1.0 - environment.free_area / environment.area <= 0.255
    assert len(environment.free.geoms) == 1
    assert environment.region.bounds == (0.0, 0.0, 10.0, 10.0)


def test_the_quick_study_is_a_small_part():
    assert len(planned.claims_study(QUICK, BEST)) + len(planned.gains_study(QUICK)) < 300
    assert replace(QUICK, name="full") != FULL
