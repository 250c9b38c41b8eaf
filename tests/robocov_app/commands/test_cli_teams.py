"""Commands with teams of different robots."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_calls import SHORT, read_error, read_json

from robocov.record import Record
from robocov_app.cli import main
from robocov_app.runs.cost_table import build_cost_table
from robocov_app.runs.saved_runs import load_saved_runs

TEAM = """
[[group]]
count = 1
max_speed = 1.0
radius = 0.2

[[group]]
count = 2
max_speed = 0.3
"""


@pytest.fixture
def team(tmp_path: Path) -> Path:
    path = tmp_path / "team.toml"
    path.write_text(TEAM)
    return path


def test_robots_of_a_run_may_differ(tmp_path: Path, team: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    arguments = ("run", "rooms", "--team", str(team), "--set", "cells=time", *SHORT, "--out", str(out))
    summary = read_json(capsys, *arguments)
    assert summary["mean_time_s"] > summary["mean_distance_m"], "slow robots take longer than 1 s for 1 m"
    record = Record.load(out)
    assert record.team.max_speed.tolist() == [1.0, 0.3, 0.3]
    assert record.team.radius.tolist() == [0.2, 0.1, 0.1]
    assert record.gains["cells"] == "time"
    header, *rows = (out / "cost.csv").read_text().splitlines()
    assert header == "time_s,mean_distance_m,cost_m3,uncovered_area_m2,mean_time_s"
    saved = load_saved_runs(out)[0]
    assert saved.history is not None
    assert saved.history.mean_time is not None
    assert saved.history.mean_time[-1] == summary["mean_time_s"] == float(rows[-1].split(",")[-1])
    assert build_cost_table(saved.history)[0] == header
    distance = np.hypot(*(record.positions[0, 1] - record.positions[0, 2]))
    assert distance >= 0.4, "starts leave space for the largest robot"
    speeds = np.hypot(*np.moveaxis(record.velocities, -1, 0)).max(axis=0)
    assert (speeds <= record.team.max_speed + 1e-9).all()


def test_a_comparison_prints_the_mean_time(
    tmp_path: Path, team: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "both"
    arguments = ["compare", "rooms", "--controllers", "rapf", "lloyd", "--team", str(team), *SHORT]
    assert main([*arguments, "--out", str(out)]) == 0
    assert "mean time" in capsys.readouterr().out
    rows = json.loads((out / "comparison.json").read_text())["runs"]
    assert all(row["mean_time_s"] > 0 for row in rows)


def test_speeds_give_a_cost_in_seconds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    positions = tmp_path / "positions.json"
    positions.write_text("[[1, 1], [9, 5]]")
    arguments = ("cost", "rooms", "--positions", str(positions), "--lattice", "16")
    plain = read_json(capsys, *arguments)
    assert "mean_time_s" not in plain
    sites = tmp_path / "sites.npz"
    timed = read_json(capsys, *arguments, "--speeds", "1.0", "0.25", "--sites", str(sites))
    assert timed["mean_distance_m"] == plain["mean_distance_m"]
    assert timed["mean_time_s"] > plain["mean_distance_m"]
    with np.load(sites) as saved:
        assert saved["times"].mean() == pytest.approx(timed["mean_time_s"])
    half_speed = read_json(capsys, *arguments, "--speeds", "0.5")
    assert half_speed["mean_time_s"] == pytest.approx(2.0 * plain["mean_distance_m"])
    message = read_error(capsys, *arguments, "--speeds", "1", "1", "1")
    assert message == "--speeds: expected one, or one for each of 2 robots, got 3 numbers"
    assert (
        read_error(capsys, *arguments, "--speeds", "0") == "--speeds: expected a number above 0, got 0.0 m/s"
    )


def test_invalid_teams_are_rejected(tmp_path: Path, team: Path, capsys: pytest.CaptureFixture[str]) -> None:
    message = read_error(capsys, "run", "rooms", "--team", str(team), "--robots", "5")
    assert message == f"--robots: expected 3 as in {team}, got 5"
    bad = tmp_path / "bad.toml"
    bad.write_text("[[group]]\ncount = 1\nspeed = 3\n")
    for arguments in (("run", "rooms"), ("compare", "rooms"), ("demo", "rooms")):
        message = read_error(capsys, *arguments, "--team", str(bad))
        assert message.startswith(f"{bad}: group[0]: unknown key 'speed'")
