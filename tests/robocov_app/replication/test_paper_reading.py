import csv
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiny_paper import TINY

from robocov.mapfile import load_map
from robocov.metrics import CostHistory
from robocov_app.replication import plan as planned
from robocov_app.replication.contenders import LLOYD, RAPF_SHARED, RPF_SHARED, best
from robocov_app.replication.maps import with_kinds_of_starts
from robocov_app.replication.outcomes import Scenario
from robocov_app.replication.reading import mean_until, read_gain_outcomes, read_outcomes
from robocov_app.replication.references import Reference
from robocov_app.sweep.ledger import _check_sum
from robocov_app.sweep.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

REFERENCES = {"blocks-a": Reference(1.5, ((1.0, 1.0),), 1.0)}
SAME = best("rapf", RAPF_SHARED.gains)
CONTENDERS = (RAPF_SHARED, SAME, RPF_SHARED, LLOYD)


@pytest.fixture(scope="module")
def study():
    laws = planned.distinct(CONTENDERS)
    gains: dict = {}
    for controller, choice in laws:
        gains.setdefault(controller, []).append(choice)
    maps = (StudyMap("blocks-a", with_kinds_of_starts(load_map("blocks-a"))),)
    return Study(
        maps=maps,
        controllers=tuple(gains),
        gains=gains,
        starts=("corner", "uniform"),
        seeds=(0, 1),
        duration=2.0,
        dt=0.02,
        lattice=16,
        record_hz=0.0,
    )


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory):
    target = tmp_path_factory.mktemp("swept") / "sweep"
    sweep(study, target, workers=1, quiet=True)
    return target


def rows_of(folder):
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_value_is_that_of_its_run(study, folder):
    outcomes = read_outcomes(folder, study, CONTENDERS, REFERENCES)
    assert outcomes.scenarios == tuple(
        Scenario("blocks-a", start, seed) for start in ("corner", "uniform") for seed in (0, 1)
    )
    rows = rows_of(folder)
    assert len(rows) == 12
    for row in rows:
        k = outcomes.scenarios.index(Scenario(row["map"], row["start"], int(row["seed"])))
        law = {"rapf": "rapf-shared", "rpf": "rpf-shared", "lloyd": "lloyd"}[row["controller"]]
        final = float(row["mean_distance_m"])
        assert outcomes.of(law, "final")[k] == final
        assert outcomes.of(law, "gap")[k] == pytest.approx(final / 1.5 - 1.0)
        assert outcomes.of(law, "contacts")[k] == float(row["contacts"])
        stuck = outcomes.of(law, "stuck")[k]
        assert np.isnan(stuck) if row["stuck_robots"] == "" else stuck == float(row["stuck_robots"])
        with np.load(folder / "runs" / row["run"] / "record.npz") as record:
            assert outcomes.placements[law][k] == pytest.approx(record["positions"][-1])
        # a run of two seconds is averaged over all of it
        whole = float(row["mean_distance_over_run_m"])
        assert outcomes.of(law, "first_minute")[k] == pytest.approx(whole, rel=1e-9)
    assert (outcomes.of("rapf-best", "final") == outcomes.of("rapf-shared", "final")).all()
    assert np.isnan(outcomes.of("rapf-default", "final")).all()
    assert outcomes.shares["blocks-a"] == pytest.approx(np.sqrt(load_map("blocks-a").free_area / 6))


def test_a_run_that_failed_is_nan(study, folder, tmp_path):
    import shutil

    broken = tmp_path / "sweep"
    shutil.copytree(folder, broken)
    row = next(row for row in rows_of(folder) if row["controller"] == "lloyd")
    entry = broken / "runs" / row["run"] / "row.json"
    content = json.loads(entry.read_text()) | {"figures": {}, "error": "it fell over"}
    content["check_sum"] = _check_sum({key: value for key, value in content.items() if key != "check_sum"})
    entry.write_text(json.dumps(content))
    sweep(study, broken, workers=1, quiet=True)
    outcomes = read_outcomes(broken, study, CONTENDERS, REFERENCES)
    assert np.isnan(outcomes.of("lloyd", "final")).tolist() == [True, False, False, False]
    assert np.isnan(outcomes.placements["lloyd"][0]).all()
    assert np.isfinite(outcomes.of("rapf-shared", "final")).all()


def test_without_a_reference_there_is_no_gap(study, folder):
    outcomes = read_outcomes(folder, study, CONTENDERS, {})
    assert np.isnan(outcomes.of("lloyd", "gap")).all()
    assert np.isfinite(outcomes.of("lloyd", "final")).all()


def test_gains_are_told_apart(study, folder):
    grids = read_gain_outcomes(folder, study, REFERENCES)
    plain = read_outcomes(folder, study, CONTENDERS, REFERENCES)
    assert set(grids) == {"rapf", "rpf", "lloyd"}
    for law, key in (("rapf", "rapf-shared"), ("rpf", "rpf-shared")):
        assert grids[law].excess.shape == (1, 4)
        assert grids[law].excess[0] == pytest.approx(plain.of(key, "gap") + 1.0)
        assert grids[law].gains[0]["k_rep"] == 1.0
    assert TINY.tuning_seed not in {scenario.seed for scenario in grids["rapf"].scenarios}


@given(st.lists(st.floats(0.5, 9.0), min_size=2, max_size=40), st.floats(0.1, 30.0))
def test_the_mean_over_time_is_that_of_the_curve(values, until):
    time = np.arange(len(values)) * 0.5
    cost = np.array(values)
    found = mean_until(CostHistory(time, cost, cost, cost), until)
    end = min(until, time[-1])
    fine = np.linspace(0.0, end, 20_001)
    assert found == pytest.approx(np.interp(fine, time, cost).mean(), rel=2e-3)
    assert cost.min() - 1e-9 <= found <= cost.max() + 1e-9


def test_a_moment_has_its_own_value():
    one = np.array([2.5])
    assert mean_until(CostHistory(np.zeros(1), one, one, one), 20.0) == 2.5
