"""Outcomes read from the tables of sweeps, best gains, and degradations."""

import csv
import json
import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiny_paper import TINY

from robocov.controllers import get_gain_values, make_controller
from robocov.mapfile import load_map
from robocov.metrics import CostHistory
from robocov_app.evaluation.reference_search import ReferencePlacement
from robocov_app.replication.design import studies, study_maps
from robocov_app.replication.design.contenders import LLOYD, RAPF_SHARED, RPF_SHARED, build_paper_contender
from robocov_app.replication.evidence import describe_tuning
from robocov_app.replication.results import degradations
from robocov_app.replication.results.degradations import read_degradations
from robocov_app.replication.results.outcome_tables import read_gain_outcomes, read_outcomes
from robocov_app.replication.results.outcomes import (
    GainOutcomes,
    ProblemInstance,
    compute_mean_until,
    find_best_gains,
    merge_outcomes,
)
from robocov_app.sweep.ledger import _compute_row_checksum
from robocov_app.sweep.sweeping import sweep

REFERENCES = {"blocks-a": ReferencePlacement(1.5, ((1.0, 1.0),), 1.0)}
SAME = build_paper_contender("rapf-best", RAPF_SHARED.gains)
CONTENDERS = (RAPF_SHARED, SAME, RPF_SHARED, LLOYD)


@pytest.fixture(scope="module")
def study():
    plan = replace(TINY, duration=1.0)
    maps = (study_maps.load_study_map("blocks-a"),)
    return studies.build_contest(plan, maps, CONTENDERS, ("corner", "uniform"), (0, 1))


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory):
    target = tmp_path_factory.mktemp("swept") / "sweep"
    sweep(study.study, target, workers=1, quiet=True)
    return target


def read_rows(folder):
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_value_is_that_of_its_run(study, folder):
    outcomes = read_outcomes(folder, study, REFERENCES)
    assert outcomes.instances == tuple(
        ProblemInstance("blocks-a", start, seed) for start in ("corner", "uniform") for seed in (0, 1)
    )
    rows = read_rows(folder)
    assert len(rows) == 12
    for row in rows:
        k = outcomes.instances.index(ProblemInstance(row["map"], row["start"], int(row["seed"])))
        key = {"rapf": "rapf-shared", "rpf": "rpf-shared", "lloyd": "lloyd"}[row["controller"]]
        final = float(row["mean_distance_m"])
        assert outcomes.get_values(key, "final")[k] == final
        assert outcomes.get_values(key, "gap")[k] == pytest.approx(final / 1.5 - 1.0)
        assert outcomes.get_values(key, "contacts")[k] == float(row["contacts"])
        assert outcomes.get_values(key, "work")[k] == float(row["work_J"]) > 0.0
        assert outcomes.get_values(key, "clearance")[k] == float(row["min_clearance_m"])
        with np.load(folder / "runs" / row["run"] / "record.npz") as record:
            assert outcomes.values[key, "placement"][k] == pytest.approx(record["positions"][-1])
        # The first minute of a run of one second is the whole run.
        mean = float(row["mean_distance_over_run_m"])
        assert outcomes.get_values(key, "first_minute")[k] == pytest.approx(mean, rel=1e-9)
    assert (outcomes.get_values("rapf-best", "final") == outcomes.get_values("rapf-shared", "final")).all()
    assert np.isnan(outcomes.get_values("rapf-default", "final")).all()
    assert outcomes.length_scale_by_map["blocks-a"] == pytest.approx(
        np.sqrt(load_map("blocks-a").free_area / 6)
    )


def test_values_of_failed_runs_are_nan(study, folder, tmp_path):
    broken = tmp_path / "sweep"
    shutil.copytree(folder, broken)
    row = next(row for row in read_rows(folder) if row["controller"] == "lloyd")
    entry = broken / "runs" / row["run"] / "row.json"
    content = json.loads(entry.read_text()) | {"figures": {}, "error": "it fell over"}
    del content["check_sum"]
    content["check_sum"] = _compute_row_checksum(content)
    entry.write_text(json.dumps(content))
    sweep(study.study, broken, workers=1, quiet=True)
    outcomes = read_outcomes(broken, study, REFERENCES)
    assert np.isnan(outcomes.get_values("lloyd", "final")).tolist() == [True, False, False, False]
    assert np.isnan(outcomes.values["lloyd", "placement"][0]).all()
    assert np.isfinite(outcomes.get_values("rapf-shared", "final")).all()


def test_without_a_reference_there_is_no_gap(study, folder):
    outcomes = read_outcomes(folder, study, {})
    assert np.isnan(outcomes.get_values("lloyd", "gap")).all()
    assert np.isfinite(outcomes.get_values("lloyd", "final")).all()


def test_sets_of_gains_are_distinguished(study, folder):
    grids = read_gain_outcomes(folder, study.study, REFERENCES)
    plain = read_outcomes(folder, study, REFERENCES)
    assert set(grids) == {"rapf", "rpf", "lloyd"}
    for controller, key in (("rapf", "rapf-shared"), ("rpf", "rpf-shared")):
        assert grids[controller].relative_costs.shape == (1, 4)
        assert grids[controller].relative_costs[0] == pytest.approx(plain.get_values(key, "gap") + 1.0)
        assert grids[controller].gains[0]["k_rep"] == 1.0
    assert TINY.tuning_seed not in {scenario.seed for scenario in grids["rapf"].instances}


@given(st.lists(st.floats(0.5, 9.0), min_size=2, max_size=40), st.floats(0.1, 30.0))
def test_the_mean_over_time_is_the_integral_of_the_curve(values, until):
    time = np.arange(len(values)) * 0.5
    cost = np.array(values)
    mean = compute_mean_until(CostHistory(time, cost, cost, cost), until)
    end = min(until, time[-1])
    fine = np.linspace(0.0, end, 20_001)
    assert mean == pytest.approx(np.interp(fine, time, cost).mean(), rel=2e-3)
    assert cost.min() - 1e-9 <= mean <= cost.max() + 1e-9


def test_the_mean_of_a_single_sample_is_its_value():
    one = np.array([2.5])
    assert compute_mean_until(CostHistory(np.zeros(1), one, one, one), 20.0) == 2.5


def test_selected_outcomes_can_be_merged(study, folder):
    whole = read_outcomes(folder, study, REFERENCES)
    left = whole.select([True, True, False, False])
    right = whole.select([False, False, True, True])
    again = merge_outcomes([left, right])
    assert again.instances == whole.instances
    for key, values in whole.values.items():
        assert np.array_equal(again.values[key], values, equal_nan=True)
    half = merge_outcomes([right, left]).select([True, True, False, False])
    assert half.instances == right.instances


DEFAULTS = get_gain_values(make_controller("range-limited"))


def build_gain_outcomes(*relative_costs: tuple[float, ...]) -> GainOutcomes:
    """Build outcomes of two or more sets of gains of `range-limited`, the defaults first."""
    sets = [DEFAULTS, *({**DEFAULTS, "interaction_range": 20.0 + k} for k in range(1, len(relative_costs)))]
    scenarios = tuple(ProblemInstance(f"map-{k}", "corner", 0) for k in range(len(relative_costs[0])))
    return GainOutcomes(scenarios, tuple(sets), np.array(relative_costs))


def test_the_best_gains_have_the_smallest_mean():
    found = {"range-limited": build_gain_outcomes((1.2, 1.2, 1.2), (1.0, 1.0, 1.7), (1.1, 1.1, 1.3))}
    assert find_best_gains(found) == {"range-limited": {**DEFAULTS, "interaction_range": 22.0}}


def test_without_complete_instances_the_defaults_are_kept():
    found = build_gain_outcomes((1.2, np.nan), (np.nan, 1.1))
    assert find_best_gains({"range-limited": found}) == {}
    assert describe_tuning("range-limited", found).startswith("Gains: its defaults; in every scenario")


def test_the_benefit_of_tuning_is_described():
    better = describe_tuning(
        "range-limited", build_gain_outcomes((1.2, 1.2, 1.5), (1.5, 1.8, 2.1), (0.9, 1.2, 1.2))
    )
    assert better == (
        "Gains: interaction_range 22: of 3 sets, the best one on 3 tuning maps, mean J/J_ref 1.100; "
        "with its defaults 1.3, median ratio 0.8; with the worst set 1.8, median ratio 0.6."
    )
    usual = describe_tuning("range-limited", build_gain_outcomes((1.2, 1.2, 1.2), (1.8, 2.4, np.nan)))
    assert usual.startswith(
        f"Gains: interaction_range {DEFAULTS['interaction_range']:g}, the default: of 2 sets, "
    )
    assert usual.endswith("with the worst set 2.1, median ratio 0.583.")


class TestDegradations:
    @pytest.fixture
    def finals(self, monkeypatch, tmp_path):
        """Make up tables in which each run has its final cost, by study, value, controller and seed."""

        def make_up_outcomes(cost):
            class Table:
                def __init__(self, folder):
                    self.name = folder.name

                def rows(self):
                    values = (0.6, 0.9) if self.name == "conditions-loss" else (0.6,)
                    others = "others" in self.name
                    rows = [
                        {"controller": controller, "map": "rooms", "seed": seed, "loss": value}
                        for controller in (("rpf",) if others else ("rapf", "lloyd"))
                        for value in values
                        for seed in ((0,) if others else (0, 1))
                    ]
                    return [row | {"mean_distance_m": cost(self.name, row)} for row in rows]

            axes = {"loss": (0.0, 0.6, 0.9), "communication_range": (None, 4.0)}
            parts = {
                "conditions": (("rapf", "lloyd"), 2, axes),
                "conditions-others": (("rpf",), 1, {"loss": (0.0, 0.6)}),
            }
            monkeypatch.setattr(studies, "list_disturbances", lambda plan: parts)
            monkeypatch.setattr(degradations, "read_results", Table)
            found = read_degradations(tmp_path, TINY)
            return {(each.axis, each.value, each.controller): each for each in found}

        return make_up_outcomes

    def test_runs_are_compared_on_the_same_map_and_seed(self, finals):
        def cost(name, row):
            bad = 1.5 if name == "conditions-loss" and row["loss"] == 0.9 else 1.0
            return (2.0 + row["seed"]) * bad

        found = finals(cost)
        assert found["loss", 0.9, "rapf"].ratio.estimate == 1.5
        assert found["loss", 0.0, "rapf"].ratio.estimate == found["loss", 0.6, "lloyd"].ratio.estimate == 1.0
        # Tables have no column for parameters with a single value.
        assert found["communication_range", 4.0, "lloyd"].ratio.estimate == 1.0
        assert len(found) == 2 * (1 + 3 + 2) + 3
        assert {each.runs for key, each in found.items() if key[2] == "rapf"} == {2}
        assert {each.runs for key, each in found.items() if key[2] == "rpf"} == {1}

    def test_ideal_runs_are_compared_with_rapfs(self, finals):
        found = finals(lambda name, row: (1.0 + row["seed"]) * (3.0 if row["controller"] == "rpf" else 2.0))
        assert found["ideal", None, "rpf"].ratio.estimate == 1.5
        assert found["ideal", None, "lloyd"].ratio.estimate == found["loss", 0.6, "rpf"].ratio.estimate == 1.0

    def test_runs_without_a_result_are_left_out(self, finals):
        found = finals(lambda name, row: 2.0 if name == "conditions-ideal" or row["loss"] == 0.6 else None)
        assert (found["loss", 0.6, "rapf"].runs, found["loss", 0.9, "rapf"].runs) == (2, 0)
        assert math.isnan(found["loss", 0.9, "rapf"].ratio.estimate)
        assert all(math.isnan(each.ratio.estimate) for each in finals(lambda name, row: None).values())
