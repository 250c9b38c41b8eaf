"""The grids of the rivals' gains: what is tried where, which set is taken, and how that is told."""

from dataclasses import replace

import numpy as np
import pytest
from tiny_paper import TINY, TINY_BEYOND, means

from robocov.controllers import CONTROLLERS, gain_values, gains_of, make_controller
from robocov_app.replication import beyond_studies, beyond_writing
from robocov_app.replication.beyond_plan import IN_CLAIMS, OURS
from robocov_app.replication.maps import KINDS
from robocov_app.replication.outcomes import GainOutcomes, Scenario
from robocov_app.replication.plan import FULL, QUICK, claim_maps
from robocov_app.replication.rival_gains import (
    GRIDS,
    gains_words,
    rival_gains_study,
    studied_rival_gains,
    tuned_rivals,
)
from robocov_app.sweep.study import tasks_of

DEFAULTS = gain_values(make_controller("range-limited"))


def outcomes(*excess: tuple[float, ...]) -> GainOutcomes:
    """Return what two or more sets of `range-limited` reached, the defaults the first of them."""
    sets = [DEFAULTS, *({**DEFAULTS, "interaction_range": 20.0 + k} for k in range(1, len(excess)))]
    scenarios = tuple(Scenario(f"map-{k}", "corner", 0) for k in range(len(excess[0])))
    return GainOutcomes(scenarios, tuple(sets), np.array(excess))


@pytest.mark.parametrize("name", sorted(set(CONTROLLERS) - {*IN_CLAIMS, *OURS}))
def test_every_rival_has_a_grid_and_its_defaults_are_in_it(name):
    known, usual = gains_of(CONTROLLERS[name]), gain_values(make_controller(name))
    sets = [{**usual, **make_known(known, gains)} for gains in GRIDS[name]]
    assert usual in sets
    assert len(sets) > 2 and all(each not in sets[:k] for k, each in enumerate(sets))
    # what a set does not name would change with the defaults
    assert len({tuple(gains) for gains in GRIDS[name]}) == 1
    assert 1 <= len(GRIDS[name][0]) <= 3


def make_known(known, gains):
    return {gain: known[gain].validated(value, "grid") for gain, value in gains.items()}


@pytest.mark.slow
def test_in_full_they_are_tuned_where_nothing_is_tested():
    study = rival_gains_study(FULL)
    assert study is not None
    assert set(study.controllers) == set(GRIDS) == {law.controller for law in beyond_studies.rivals()}
    assert len(study) == 4 * 3 * sum(len(grid) for grid in GRIDS.values())
    tested = {each.environment.obstacles for each in claim_maps(FULL)}
    assert not tested & {each.environment.obstacles for each in study.maps}
    assert set(beyond_studies.of(FULL).tuning) <= set(FULL.tuning)
    assert {task.seed for task in tasks_of(study)} == {FULL.tuning_seed}
    assert {task.start for task in tasks_of(study)} == set(KINDS)
    assert {(task.duration, task.robots) for task in tasks_of(study)} == {(120.0, 6)}


def test_in_the_quick_study_none_are_tried_and_it_says_so(tmp_path):
    assert rival_gains_study(QUICK) is None
    assert studied_rival_gains(tmp_path, QUICK, means()) == {}
    assert tuned_rivals({}) == {}
    quick, full = (beyond_writing._gains_told(plan) for plan in (QUICK, FULL))
    assert "default gains: those that the full study" in quick and "120 s on 4 generated maps" in quick
    assert full.startswith("Each rival has those with the least mean") and "seeds 101 to 104" in full
    small = replace(TINY, beyond=TINY_BEYOND)
    assert "on 1 generated maps (seeds 101)" in beyond_writing._gains_told(small)


def test_the_set_with_the_least_mean_is_taken():
    found = {"range-limited": outcomes((1.2, 1.2, 1.2), (1.0, 1.0, 1.7), (1.1, 1.1, 1.3))}
    (law,) = tuned_rivals(found).values()
    assert (law.key, law.controller, law.label) == ("range-limited", "range-limited", "LA, limited range")
    assert law.gains == {**DEFAULTS, "interaction_range": 22.0}
    rivals = beyond_studies.rivals(tuned_rivals(found))
    assert [each.gains for each in rivals if each.controller == "range-limited"] == [law.gains]
    assert all(each.gains == {} for each in rivals if each.controller != "range-limited")


def test_without_a_scenario_in_which_every_run_was_well_the_defaults_stay():
    found = outcomes((1.2, np.nan), (np.nan, 1.1))
    assert tuned_rivals({"range-limited": found}) == {}
    assert gains_words("range-limited", found).startswith("Gains: its defaults; in every scenario")


def test_it_is_told_what_tuning_was_worth():
    better = gains_words("range-limited", outcomes((1.2, 1.2, 1.5), (1.5, 1.8, 2.1), (0.9, 1.2, 1.2)))
    assert better == (
        "Gains: interaction_range 22: of 3 sets the best on 3 maps of the tuning, mean J/J_ref 1.100; "
        "with its defaults 1.3, median ratio 0.8; with the worst set 1.8, median ratio 0.6."
    )
    usual = gains_words("range-limited", outcomes((1.2, 1.2, 1.2), (1.8, 2.4, np.nan)))
    assert usual.startswith(
        f"Gains: interaction_range {DEFAULTS['interaction_range']:g}, as by default: of 2 sets "
    )
    assert usual.endswith("with the worst set 2.1, median ratio 0.583.")
