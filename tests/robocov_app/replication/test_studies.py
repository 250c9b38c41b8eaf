"""The runs of the study: maps, starts, contenders and their gains."""

import numpy as np
import pytest
import shapely
from tiny_paper import TINY

from robocov.controllers import CONTROLLERS, get_gain_values, get_gains, make_controller
from robocov.environment import CircleObstacle, DiscStart, Environment, PolygonObstacle
from robocov.errors import StartError
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.figures.statistics import estimate_fraction
from robocov_app.replication.claims.registration import load_registration
from robocov_app.replication.claims.thresholds import ALPHA, MIN_MAPS, NEARLY_ALWAYS
from robocov_app.replication.design import studies, study_maps
from robocov_app.replication.design.contenders import (
    GAIN_GRIDS,
    LLOYD,
    OURS,
    PAPER,
    RAPF_SHARED,
    RPF_SHARED,
    UNTUNED,
    build_baselines,
    build_paper_contenders,
    collect_gain_sets,
)
from robocov_app.replication.design.plan import (
    CONVEX,
    CONVEX_KINDS,
    FULL,
    KINDS,
    NON_CONVEX,
    QUICK,
    TEAM,
    UNSEEN,
)
from robocov_app.replication.evidence import load_profile
from robocov_app.sweep.study.parameters import TEAM_PARAMETERS
from robocov_app.sweep.tasks import generate_tasks

BEST = {
    "rapf": {"k_rep": 0.3, "rho_0": 3.0, "k_att": 30.0, "attraction_limit": None},
    "rpf": {"k_rep": 10.0, "rho_0": 6.0},
}
PAPERS = build_paper_contenders(BEST)

# Tests in one process generate the maps only once.
in_one_process = pytest.mark.xdist_group("maps of the full study")
FULL_STUDY = pytest.param(FULL, marks=[pytest.mark.slow, in_one_process])
both = pytest.mark.parametrize("plan", [FULL_STUDY, QUICK], ids=["full", "quick"])


class TestMaps:
    @pytest.mark.parametrize("name", [*NON_CONVEX, *CONVEX])
    def test_every_kind_of_start_fits_on_every_map(self, name):
        environment = study_maps.load_study_map(name, CONVEX_KINDS).environment
        assert tuple(environment.starts) == CONVEX_KINDS
        for kind, spec in environment.starts.items():
            assert environment.start(kind).sample(6, seed=1).shape == (6, 2)
            if isinstance(spec, DiscStart):
                assert environment.free.contains(shapely.Point(spec.center).buffer(spec.radius - 0.01))

    def test_all_bundled_maps_except_for_three_are_used(self):
        convex = {name for name in list_bundled_maps() if load_map(name).blocked.is_empty}
        assert convex == set(CONVEX)
        assert set(list_bundled_maps()) - convex - set(NON_CONVEX) == {"campus", "forklifts", "hospital"}

    def test_clustered_starts_are_as_near_to_the_corner_and_middle_as_possible(self):
        ring = ((0, 0), (8, 0), (8, 6), (0, 6))
        pillar = Environment("pillar", ring, (CircleObstacle((4.0, 3.0), 1.0),))
        starts = study_maps.replace_starts(pillar).starts
        assert starts["corner"] == DiscStart((0.8, 0.8), 0.8)
        center = starts["centre"]
        assert isinstance(center, DiscStart)
        assert np.hypot(center.center[0] - 4.0, center.center[1] - 3.0) == pytest.approx(1.8, abs=0.02)

    def test_discs_of_starts_are_smaller_on_narrow_maps(self):
        for width, radius in ((1.3, 0.6), (1.0, 0.45)):
            alley = Environment("alley", ((0, 0), (9, 0), (9, width), (0, width)))
            spec = study_maps.replace_starts(alley).starts["corner"]
            assert isinstance(spec, DiscStart)
            assert spec.radius == radius

    def test_maps_without_space_for_a_start_are_rejected(self):
        block = PolygonObstacle(((0.5, 0.5), (8.5, 0.5), (8.5, 8.5), (0.5, 8.5)))
        ring = Environment("ring", ((0, 0), (9, 0), (9, 9), (0, 9)), (block,))
        with pytest.raises(StartError, match=r"map 'ring': no free disc of 0\.45 m radius"):
            study_maps.replace_starts(ring)
        with pytest.raises(StartError, match=r"map 'ring': no free disc of 0\.35 m radius"):
            study_maps.replace_starts(ring, ("tight",))

    @pytest.mark.parametrize("seed", range(6))
    def test_convex_regions_are_convex_large_and_the_same_every_time(self, seed):
        region = study_maps.generate_convex_region(seed).environment
        polygon = region.boundary_polygon
        assert polygon.is_valid and polygon.equals(polygon.convex_hull)
        assert polygon.area >= 40.0 and region.blocked.is_empty
        assert region == study_maps.generate_convex_region(seed).environment
        assert region.boundary != study_maps.generate_convex_region(seed + 1).environment.boundary
        assert not polygon.buffer(-1.8).is_empty  # It is no strip.

    @pytest.mark.parametrize("seed", [1, 2, 3, pytest.param(101, marks=pytest.mark.slow)])
    def test_generated_maps_have_the_described_properties(self, seed):
        each = study_maps.generate_study_map(seed)
        environment = each.environment
        assert (
            environment == study_maps.generate_study_map(seed).environment
            and each.name == f"generated-{seed}"
        )
        assert tuple(environment.starts) == KINDS
        assert 4 <= len(environment.obstacles) <= 8
        assert 0.155 <= 1.0 - environment.free_area / environment.area <= 0.255
        assert len(environment.free.geoms) == 1
        assert environment.region.bounds == (0.0, 0.0, 10.0, 10.0)

    def test_densities_are_reproducible(self):
        first = study_maps.build_density_maps(QUICK)[0]
        again = study_maps.build_density_maps(QUICK)[0]
        assert first.environment == again.environment
        density = first.environment.density
        assert density is not None and not density.is_uniform
        assert (density.lower_bound, density.upper_bound) == (1.0, 41.0)

    @both
    def test_gains_are_tuned_on_separate_maps_and_starts(self, plan):
        assert not set(plan.tuning) & set(plan.generated)
        assert not set(plan.tuning_families) & {*plan.families, *plan.beyond.unseen}
        assert not set(plan.families) & set(plan.beyond.unseen)
        assert plan.tuning_seed not in (*plan.seeds, *plan.limited_seeds)
        tuning_maps = study_maps.build_tuning_maps(plan)
        tuning_obstacles = {study_map.environment.obstacles for study_map in tuning_maps}
        claim_maps = study_maps.build_claim_maps(plan)
        claim_obstacles = {study_map.environment.obstacles for study_map in claim_maps}
        assert not tuning_obstacles & claim_obstacles
        # Claims on gains are judged on these maps, and regrets need two starts.
        assert len(tuning_maps) >= MIN_MAPS and len(plan.tuning_starts) >= 2

    @both
    def test_every_claim_of_the_paper_has_enough_maps(self, plan):
        claim_maps = study_maps.build_claim_maps(plan)
        assert len(claim_maps) >= MIN_MAPS
        kinds = {study_maps.get_map_kind(study_map.name) for study_map in claim_maps}
        assert kinds == {"bundled", "polygons", "blocks", "rooms", "caves"}
        assert len(study_maps.build_convex_maps(plan)) >= MIN_MAPS

    def test_nearly_always_can_be_shown_on_the_maps_of_the_full_study(self):
        claims = len(load_registration().claims)
        for count in (len(study_maps.build_claim_maps(FULL)), len(CONVEX) + len(FULL.convex_generated)):
            lows = []
            p_values = []
            for exceptions in range(6):
                fraction = estimate_fraction(np.arange(count) >= exceptions, range(count))
                lows.append(fraction.low)
                p_values.append(claims * fraction.compute_p_value(NEARLY_ALWAYS, np.inf))
            assert [low >= NEARLY_ALWAYS for low in lows] == [True] * 5 + [False]
            assert [p <= ALPHA for p in p_values] == [True] * 2 + [False] * 4

    @pytest.mark.slow
    @in_one_process
    def test_unseen_maps_are_of_other_families(self):
        unseen = {each.name: each.environment for each in study_maps.build_unseen_maps(FULL)}
        assert list(unseen)[:4] == ["blocks-301", "blocks-302", "blocks-303", "rooms-301"]
        kinds = {name: each.extra["generator"]["kind"] for name, each in unseen.items()}
        assert all(name.startswith(f"{kind}-") and kind in UNSEEN for name, kind in kinds.items())
        assert len(set(unseen.values())) == len(unseen) == MIN_MAPS
        assert all(tuple(each.starts) == KINDS for each in unseen.values())
        contest = studies.build_beyond_contests(FULL, {}, UNTUNED)["unseen"]
        assert [contender.key for contender in contest.contenders] == [OURS[0], "rapf-default", "lloyd"]
        assert len(contest.study) == len(unseen) * 3 * 3
        tuned = studies.build_beyond_contests(FULL, {}, PAPERS)["unseen"]
        assert [contender.key for contender in tuned.contenders] == [OURS[0], "rapf-best", "lloyd"]
        assert "unseen" not in studies.build_beyond_contests(QUICK, {}, PAPERS)


class TestPaper:
    @pytest.mark.slow
    @in_one_process
    def test_the_full_study_has_the_documented_size(self):
        assert len(study_maps.build_claim_maps(FULL)) == len(study_maps.build_convex_maps(FULL)) == 100
        study = studies.build_claims_contest(FULL, PAPERS).study
        assert study.starts == KINDS
        assert len(study) == 100 * 3 * 4 * 7
        limited = studies.build_limited_contest(FULL, PAPERS).study
        assert len(limited) == 100 * 3 * 7 and limited.maps == study.maps
        assert len(studies.build_gains_study(FULL)) == 12 * 2 * (20 + 80)

    def test_all_contenders_have_equal_teams_and_starts(self):
        tasks = list(generate_tasks(studies.build_claims_contest(TINY, PAPERS).study))
        assert len({(task.duration, task.dt, task.lattice, str(task.team)) for task in tasks}) == 1
        scenarios = {(task.map, task.start, task.seed) for task in tasks}
        for scenario in scenarios:
            own_tasks = [task for task in tasks if (task.map, task.start, task.seed) == scenario]
            assert len(own_tasks) == 7
            assert len({task.document for task in own_tasks}) == 1

    def test_rapf_and_rpf_share_gains_and_attractions_are_not_limited(self):
        rapf = RAPF_SHARED.all_gains
        rpf = RPF_SHARED.all_gains
        assert {name: rapf[name] for name in rpf} == rpf
        assert rapf["attraction_limit"] is None
        grids = studies.list_gain_sets(FULL)
        assert all(gains["attraction_limit"] is None for gains in grids["rapf"])
        potentials = {(gains["k_rep"], gains["rho_0"]) for gains in grids["rapf"]}
        assert potentials == {(gains["k_rep"], gains["rho_0"]) for gains in grids["rpf"]}
        # The sensing range does not cut off a repulsion.
        assert TEAM["sensing_range"] >= max(*FULL.rho_0, *QUICK.rho_0)
        assert set(TEAM) <= set(TEAM_PARAMETERS)

    def test_best_gains_equal_to_the_shared_ones_run_once(self):
        same = build_paper_contenders({"rapf": RAPF_SHARED.gains, "rpf": RPF_SHARED.gains})
        assert len(studies.build_claims_contest(TINY, same).study) == 2 * 3 * 5
        assert {
            name: len(sets) for name, sets in collect_gain_sets((RAPF_SHARED, LLOYD, same[1])).items()
        } == {
            "rapf": 1,
            "lloyd": 1,
        }

    def test_figures_4_and_6_have_equal_starts_and_figure_8_another(self):
        first = load_map("blocks-a")
        second = load_map("blocks-b")
        assert first.starts["paper"] == second.starts["paper"] != second.starts["other"]
        found = studies.build_figure_studies(TINY)
        assert found["figures-a"].starts == ("paper",)
        assert found["figures-b"].starts == ("paper", "other")
        assert {len(study) for study in found.values()} == {2, 4}

    def test_figures_are_repeated_at_limited_ranges_and_with_half_the_control_period(self):
        found = studies.build_figure_studies(TINY)
        limited = next(iter(generate_tasks(found["figures-b-limited"])))
        assert (limited.team["communication_range"], limited.team["sensing_range"]) == (4.0, 2.0)
        (half,) = {task.dt for task in generate_tasks(found["figures-a-half-step"])}
        assert half == TINY.dt / 2.0

    def test_figures_4_to_8_are_repeated_with_the_best_gains_from_equal_starts(self):
        shared = studies.build_figure_studies(TINY)
        best = studies.build_best_figure_studies(TINY, PAPERS)
        assert list(best) == ["figures-a-best", "figures-b-best"]
        for name, study in best.items():
            tasks = list(generate_tasks(study))
            assert all(BEST[task.controller].items() <= task.gains.items() for task in tasks)
            shared_tasks = generate_tasks(shared[name.removesuffix("-best")])
            expected = [(task.document, task.start, task.seed, task.controller) for task in shared_tasks]
            assert [(task.document, task.start, task.seed, task.controller) for task in tasks] == expected

    def test_the_quick_study_is_small(self):
        size = len(studies.build_claims_contest(QUICK, PAPERS).study) + len(studies.build_gains_study(QUICK))
        assert size < 600
        beyond = [each.study for each in studies.build_beyond_contests(QUICK, {}, UNTUNED).values()]
        beyond += studies.build_conditions_studies(QUICK).values()
        assert sum(study.duration * len(study) for study in beyond) < 5500.0


def select_baseline_contests(plan):
    """Return the sweeps of the baselines and of our own controllers."""
    contests = studies.build_beyond_contests(plan, {}, UNTUNED)
    return {name: each for name, each in contests.items() if name == "rivals" or name.startswith("ours-")}


class TestBeyond:
    @both
    def test_every_registered_controller_runs_once(self, plan):
        contests = select_baseline_contests(plan).values()
        others = [contender.key for contest in contests for contender in contest.contenders]
        assert len(others) == len(set(others))
        assert {*others, *PAPER} == set(CONTROLLERS)

    @both
    def test_baselines_start_where_the_papers_controllers_start(self, plan):
        papers = list(generate_tasks(studies.build_claims_contest(plan, PAPERS).study))
        places = {(task.document, task.start, task.seed) for task in papers}
        limits = {(task.duration, task.dt, task.lattice, str(task.team)) for task in papers}
        for each in select_baseline_contests(plan).values():
            for task in generate_tasks(each.study):
                assert (task.document, task.start, task.seed) in places
                assert {(task.duration, task.dt, task.lattice, str(task.team))} == limits

    @pytest.mark.slow
    @in_one_process
    def test_our_controller_runs_as_often_as_rapf_in_the_full_study(self):
        assert FULL.beyond.own_seeds == FULL.seeds
        assert min(len(FULL.beyond.maps), len(FULL.beyond.conditions_maps)) >= MIN_MAPS
        assert len(study_maps.build_baseline_maps(FULL)) == 33
        for name, each in select_baseline_contests(FULL).items():
            seeds = len(FULL.seeds) if name == f"ours-{OURS[0]}" else 1
            assert len(each.study) == 33 * 3 * seeds * len(each.contenders)

    def test_runs_with_and_without_the_density_have_equal_starts(self):
        contests = studies.build_beyond_contests(QUICK, {}, UNTUNED)
        known = generate_tasks(contests["density"].study)
        ignored = generate_tasks(contests["density-ignored"].study)
        for one, other in zip(known, ignored, strict=True):
            assert (one.map, one.start, one.seed) == (other.map, other.start, other.seed)
            assert one.document != other.document

    def test_contenders_of_mixed_teams_differ_only_in_their_cells(self):
        tasks = list(generate_tasks(studies.build_beyond_contests(QUICK, {}, UNTUNED)["teams"].study))
        by_distance = [task for task in tasks if task.gains["cells"] == "distance"]
        by_time = [task for task in tasks if task.gains["cells"] == "time"]
        assert len(by_distance) == len(by_time) > 0
        for one, other in zip(by_distance, by_time, strict=True):
            assert {**one.gains, "cells": "time"} == other.gains
            assert (one.team, one.map, one.start) == (other.team, other.map, other.start)

    def test_each_sweep_has_one_disturbance(self):
        found = {
            name: list(generate_tasks(study))
            for name, study in studies.build_conditions_studies(TINY).items()
        }
        names = "ideal", *(name.replace("_", "-") for name in studies.AXES)
        parts = "conditions", "conditions-others"
        assert set(found) == {f"{part}-{name}" for part in parts for name in names}
        for name in names:
            assert {task.controller for part in parts for task in found[f"{part}-{name}"]} == set(CONTROLLERS)
        assert all(task.team["message_rate"] == 2.0 for tasks in found.values() for task in tasks)
        assert {task.team["communication_range"] for task in found["conditions-communication-range"]} == {4.0}
        assert {task.team["communication_range"] for task in found["conditions-loss"]} == {None}
        assert {task.team["loss"] for task in found["conditions-loss"]} == {0.6}
        assert "loss" not in found["conditions-failure-rate"][0].team
        full = studies.build_conditions_studies(FULL)
        assert len(full["conditions-loss"]) == 3 * 2 * 12 * 3 and full["conditions-others-loss"].seeds == (0,)
        assert len(full["conditions-others-loss"]) == len(CONTROLLERS) * 12 - 2 * 12
        assert all(values[0] in (None, 0.0) for values in studies.AXES.values())

    @pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {*PAPER, *OURS}))
    def test_the_grid_of_every_baseline_contains_its_defaults(self, name):
        known = get_gains(CONTROLLERS[name])
        usual = get_gain_values(make_controller(name))
        sets = [
            {**usual, **{gain: known[gain].validate(value, "grid") for gain, value in gains.items()}}
            for gains in GAIN_GRIDS[name]
        ]
        assert usual in sets
        assert len(sets) > 2 and all(each not in sets[:k] for k, each in enumerate(sets))
        # All sets name the same gains, so that changed defaults do not change some of them.
        assert len({tuple(gains) for gains in GAIN_GRIDS[name]}) == 1
        assert 1 <= len(GAIN_GRIDS[name][0]) <= 3

    @pytest.mark.slow
    @in_one_process
    def test_baselines_are_tuned_on_separate_maps_in_the_full_study(self):
        study = studies.build_baseline_gains_study(FULL)
        assert study is not None
        assert (
            set(study.controllers)
            == set(GAIN_GRIDS)
            == {contender.controller for contender in build_baselines({})}
        )
        assert len(study) == 4 * 2 * sum(len(grid) for grid in GAIN_GRIDS.values())
        tested = {each.environment.obstacles for each in study_maps.build_claim_maps(FULL)}
        assert not tested & {each.environment.obstacles for each in study.maps}
        assert set(FULL.beyond.tuning) <= set(FULL.tuning)
        assert (study.seeds, study.starts) == ((FULL.tuning_seed,), ("corner", "uniform"))
        assert studies.build_baseline_gains_study(QUICK) is None

    def test_baselines_have_their_best_gains(self):
        tuned = {"range-limited": {"interaction_range": 9.0}}
        for each in build_baselines(tuned):
            assert each.gains == tuned.get(each.controller, {})

    def test_every_built_in_controller_has_a_profile(self):
        for name in CONTROLLERS:
            profile = load_profile(name)
            assert profile.short_source != "–"
            assert profile.source.endswith(".")
            assert profile.behavior.endswith(".")
        assert load_profile("geodesic-lloyd").information == "whole map"
        assert load_profile("rapf").information == "own"
        assert "not from its text" in load_profile("howard").source
        assert "not from its text" not in load_profile("rapf").source
