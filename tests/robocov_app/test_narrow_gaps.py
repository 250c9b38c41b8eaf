"""Gaps that are narrower than a robot, in commands, runs, sweeps and the window."""

import json
from pathlib import Path

import numpy as np
import pytest

import robocov
from robocov.environment import Environment, WallObstacle
from robocov.mapfile import save_map
from robocov.team import Team
from robocov_app.cli import main
from robocov_app.viewer.costs.costs import Costs

HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
CRACKED = Environment("cracked", HALL, (WallObstacle(((7.0, 0.1), (7.0, 6.0)), width=0.2),))
"""A crack of 0.1 m leads to a room of 2.9 by 6 m."""
SMALL_ROOM_M2 = 17.4
POSITIONS = np.array([[3.0, 3.0], [4.0, 3.0]])


def read_cost(capsys: pytest.CaptureFixture[str], folder: Path, *options: str) -> dict[str, float]:
    map_path = folder / "cracked.json"
    save_map(CRACKED, map_path)
    positions_path = folder / "positions.json"
    positions_path.write_text(json.dumps(POSITIONS.tolist()), encoding="utf-8")
    arguments = ["cost", str(map_path), "--positions", str(positions_path), "--lattice", "32", "--json"]
    assert main([*arguments, *options]) == 0
    answer: dict[str, float] = json.loads(capsys.readouterr().out)
    return answer


def test_cost_command_takes_a_radius(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    default = read_cost(capsys, tmp_path)
    assert default["uncovered_area_m2"] == pytest.approx(SMALL_ROOM_M2, abs=0.03)
    for_points = read_cost(capsys, tmp_path, "--radius", "0")
    assert for_points["uncovered_area_m2"] == 0.0
    assert for_points["mean_distance_m"] > default["mean_distance_m"]


@pytest.mark.parametrize(("radius", "uncovered_area"), [(0.1, SMALL_ROOM_M2), (0.04, 0.0)])
def test_window_uses_the_radius_of_the_robots(radius: float, uncovered_area: float) -> None:
    costs = Costs(32, direct=True)
    for used_radius in (0.2, radius):
        costs.set_environment(CRACKED, used_radius)
    costs.request(0, 0.0, POSITIONS)
    costs.poll()
    assert costs.known[0].result.uncovered_area == pytest.approx(uncovered_area, abs=0.03)
    costs.close()


@pytest.mark.parametrize(("radius", "uncovered_area"), [(0.1, SMALL_ROOM_M2), (0.04, 0.0)])
def test_comparison_uses_the_smallest_robot(radius: float, uncovered_area: float) -> None:
    team = Team.concatenate([Team.homogeneous(1, radius=0.2), Team.homogeneous(1, radius=radius)])
    comparison = robocov.compare(CRACKED, ["lloyd"], team=team, starts=POSITIONS, duration=0.1, lattice=16)
    assert comparison.histories["Lloyd"].uncovered_area[-1] == pytest.approx(uncovered_area, abs=0.03)
