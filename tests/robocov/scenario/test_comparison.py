"""Comparisons of controllers in the same scenario."""

from __future__ import annotations

import numpy as np
import pytest

import robocov as rc
from robocov.environment import Environment
from robocov.errors import ParameterError

ROOM = Environment("room", ((0, 0), (6, 0), (6, 4), (0, 4)))


def test_controllers_start_from_the_same_positions() -> None:
    comparison = rc.compare(ROOM, ["rapf", "lloyd"], robots=3, seed=5, duration=2.0, lattice=16)
    rapf, lloyd = comparison.records.values()
    np.testing.assert_array_equal(rapf.positions[0], lloyd.positions[0])
    np.testing.assert_array_equal(
        lloyd.positions, rc.run(ROOM, "lloyd", robots=3, seed=5, duration=2.0).positions
    )


def test_the_table_agrees_with_the_costs_and_the_records() -> None:
    comparison = rc.compare(ROOM, ["rpf", "rapf"], robots=3, duration=2.0, lattice=16)
    cost = rc.CoverageCost(ROOM, lattice=16)
    distances = [cost(record.positions[-1]).mean_distance for record in comparison.records.values()]
    rows = comparison.table()
    assert [row["controller"] for row in rows] == ["RPF", "RAPF"]
    assert [row["mean_distance_m"] for row in rows] == pytest.approx(distances)
    assert min(row["above_best"] for row in rows) == 0.0
    assert max(row["above_best"] for row in rows) == pytest.approx(max(distances) / min(distances) - 1.0)


def test_equal_labels_are_numbered() -> None:
    controllers = [rc.Rapf(), rc.Rapf(k_rep=0.3)]
    comparison = rc.compare(ROOM, controllers, robots=2, duration=0.5, lattice=8)
    assert list(comparison.records) == ["RAPF", "RAPF (2)"]
    assert comparison.records["RAPF (2)"].gains["k_rep"] == 0.3


def test_gains_apply_to_all_controllers() -> None:
    comparison = rc.compare(ROOM, ["rpf", "rapf"], robots=2, duration=0.1, lattice=8, gains={"k_rep": 0.4})
    assert [record.gains["k_rep"] for record in comparison.records.values()] == [0.4, 0.4]
    with pytest.raises(ParameterError, match="k_rep"):
        rc.compare(ROOM, ["rapf", "lloyd"], robots=2, duration=0.1, lattice=8, gains={"k_rep": 0.4})


def test_a_comparison_prints_as_an_aligned_table() -> None:
    comparison = rc.compare(ROOM, ["rapf", "lloyd"], robots=2, duration=0.5, lattice=8)
    lines = repr(comparison).splitlines()
    assert lines[0].split() == (
        "mean distance above best cost settled contacts clearance path length".split()
    )
    assert [line.split()[0] for line in lines[1:]] == ["RAPF", "Lloyd"]
    assert len({len(line) for line in lines}) == 1


def test_a_comparison_becomes_a_data_frame() -> None:
    pytest.importorskip("pandas")
    frame = rc.compare(ROOM, ["rapf"], robots=2, duration=0.5, lattice=8).to_pandas()
    assert list(frame.index) == ["RAPF"]
    assert frame["above_best"].tolist() == [0.0]


@pytest.mark.parametrize("controllers", ["rapf", []])
def test_controllers_must_be_a_list(controllers: object) -> None:
    with pytest.raises(ParameterError, match="controllers: expected a list of controllers"):
        rc.compare(ROOM, controllers)  # type: ignore[arg-type]
