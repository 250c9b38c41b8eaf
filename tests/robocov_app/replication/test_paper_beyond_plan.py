import pytest
from tiny_paper import TINY

from robocov.controllers import CONTROLLERS
from robocov_app.replication import beyond_studies
from robocov_app.replication.accounts import _KNOWN, account_of
from robocov_app.replication.beyond_plan import IN_CLAIMS, OURS
from robocov_app.replication.contenders import best
from robocov_app.replication.plan import FULL, QUICK, claim_maps, claims_study, tuning_maps
from robocov_app.replication.verdicts import LEAST_MAPS
from robocov_app.sweep.study import tasks_of

both = pytest.mark.parametrize(
    "plan", [pytest.param(FULL, marks=pytest.mark.slow), QUICK], ids=["full", "quick"]
)


@both
def test_every_registered_controller_takes_part_once(plan):
    others = [law.key for _, laws in beyond_studies.rival_studies(plan).values() for law in laws]
    assert len(others) == len(set(others))
    assert {*others, *IN_CLAIMS} == set(CONTROLLERS)


@both
def test_rivals_begin_where_the_papers_controllers_began(plan):
    laws = {"rapf": beyond_studies.UNTUNED[0], "rpf": beyond_studies.UNTUNED[2]}
    papers = {(task.document, task.start, task.seed) for task in tasks_of(claims_study(plan, laws))}
    limits = {
        (task.duration, task.dt, task.lattice, str(task.team)) for task in tasks_of(claims_study(plan, laws))
    }
    for study, _ in beyond_studies.rival_studies(plan).values():
        for task in tasks_of(study):
            assert (task.document, task.start, task.seed) in papers
            assert {(task.duration, task.dt, task.lattice, str(task.team))} == limits


@pytest.mark.slow
def test_in_full_ours_is_run_as_often_as_rapf_and_rivals_on_every_map():
    beyond = beyond_studies.of(FULL)
    assert beyond.own_seeds == FULL.seeds
    assert len(beyond_studies.rival_maps(FULL)) == len(claim_maps(FULL)) == 33
    for name, (study, laws) in beyond_studies.rival_studies(FULL).items():
        seeds = len(FULL.seeds) if name == f"ours-{OURS[0]}" else 1
        assert len(study) == 33 * 3 * seeds * len(laws)


@pytest.mark.slow
def test_maps_that_nobody_looked_at_are_none_of_the_others():
    unseen = {each.name: each.environment for each in beyond_studies.unseen_maps(FULL)}
    known = [*claim_maps(FULL), *tuning_maps(FULL), *beyond_studies.small_maps(FULL)]
    known += beyond_studies.rival_maps(FULL)
    assert len(unseen) >= LEAST_MAPS
    assert not set(unseen) & {each.name for each in known}
    assert not set(unseen.values()) & {each.environment for each in known}
    study, laws = beyond_studies.unseen_study(FULL)
    assert [law.key for law in laws] == [OURS[0], "rapf-default", "lloyd"]
    assert len(study) == len(unseen) * 3 * len(laws)
    _, tuned = beyond_studies.unseen_study(FULL, [*beyond_studies.UNTUNED, best("rapf", {"k_rep": 0.1})])
    assert [law.key for law in tuned] == [OURS[0], "rapf-best", "lloyd"]
    assert beyond_studies.unseen_study(QUICK) is None


def test_the_quick_part_is_small():
    studies = beyond_studies.all_studies(QUICK)
    assert sum(study.duration for study in studies.values() for _ in tasks_of(study)) < 4000.0


def test_conditions_are_those_that_degradation_asks_for():
    for plan in (FULL, QUICK):
        own = {
            task.digest
            for study in beyond_studies.conditions_studies(plan).values()
            for task in tasks_of(study)
        }
        assert own == {task.digest for *_, task in beyond_studies.conditions_plan(plan).tasks()}


def test_the_same_density_is_drawn_again():
    (first, *_), (again, *_) = beyond_studies.weighed_maps(QUICK), beyond_studies.weighed_maps(QUICK)
    assert first.environment == again.environment
    density = first.environment.density
    assert density is not None and not density.uniform
    assert (density.lowest, density.highest) == (1.0, 41.0)
    known, ignored = beyond_studies.density_studies(QUICK).values()
    for with_, without in zip(tasks_of(known), tasks_of(ignored), strict=True):
        assert (with_.map, with_.start, with_.seed) == (without.map, without.start, without.seed)
        assert with_.document != without.document


def test_in_a_mixed_team_the_laws_differ_in_their_cells_alone():
    by_distance, by_time = (
        [task for task in tasks_of(beyond_studies.teams_study(QUICK)) if task.gains["cells"] == cells]
        for cells in ("distance", "time")
    )
    assert len(by_distance) == len(by_time) > 0
    for one, other in zip(by_distance, by_time, strict=True):
        assert {**one.gains, "cells": "time"} == other.gains
        assert (one.team, one.map, one.start) == (other.team, other.map, other.start)


def test_every_built_in_controller_is_accounted_for():
    assert set(CONTROLLERS) <= set(_KNOWN)
    for name in CONTROLLERS:
        account = account_of(name)
        assert account.short != "–" and account.source.endswith(".") and account.does.endswith(".")
    assert account_of("geodesic-lloyd").information == "whole map"
    assert account_of("rapf").information == "own"


def test_without_a_plan_there_is_nothing_beyond():
    with pytest.raises(AssertionError):
        beyond_studies.of(TINY)
