"""`robocov optimum`: results, lower bounds, gaps, figures and rejected options."""

import json
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from command_calls import COMMAND, SHORT, read_error, read_json
from PIL import Image

from robocov.environment import DiscStart, Environment, WallObstacle
from robocov.mapfile import load_map, save_map
from robocov.optimum import find_optimum
from robocov_app.cli import main

FAST = ("--lattice", "24", "--restarts", "3")


def test_the_result_equals_that_of_the_library(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "best.json"
    options = ("--robots", "3", "--seed", "2", "--positions", str(file))
    row = read_json(capsys, "optimum", "trap", *FAST, *options)
    best = find_optimum(load_map("trap"), 3, lattice=24, restarts=3, seed=2)
    assert row["mean_distance_m"] == best.mean_distance
    assert row["positions_m"] == best.positions.tolist() == json.loads(file.read_bytes())
    assert row["restart_mean_distances_m"] == best.costs.tolist()
    assert row["undescended_mean_distances_m"] == best.costs_before_descent.tolist()
    assert row["robots"] == row["restarts"] == 3
    assert row["runs"] == []
    assert row["lower_bound"] is None
    assert row["agreement"] == {
        "0.001": best.compute_agreement(0.001),
        "0.005": best.compute_agreement(),
        "0.02": best.compute_agreement(0.02),
    }
    cost = read_json(capsys, "cost", "trap", "--positions", str(file), "--lattice", "24")
    assert cost["mean_distance_m"] == pytest.approx(best.mean_distance, rel=1e-12)
    assert cost["cost_m3"] == pytest.approx(row["cost_m3"], rel=1e-12)
    assert len(file.read_text().splitlines()) == 3, "one line per robot"


def test_the_result_is_printed_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["optimum", "square", "--lattice", "16", "--restarts", "5", "--robots", "1"]) == 0
    output = capsys.readouterr().out
    assert "mean distance   3.82" in output
    assert "1 robot, 5 restarts in" in output
    assert "within 0.5% of the best: 5" in output
    assert "[5.000, 5.000]" in output


def test_a_lower_bound_is_proved_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("optimum", "square", "--lattice", "12", "--restarts", "2", "--robots", "1", "--bound")
    row = read_json(capsys, *arguments)
    bound = row["lower_bound"]
    assert bound["mean_distance_m"] < row["mean_distance_m"]
    assert bound["cost_m3"] == pytest.approx(100.0 * bound["mean_distance_m"])
    assert bound["max_saving"] == pytest.approx(1.0 - bound["mean_distance_m"] / row["mean_distance_m"])
    assert bound["max_saving"] < 0.001
    assert main([*arguments, "--precision", "0.5"]) == 0
    output = capsys.readouterr().out
    assert "lower bound     3." in output
    assert "m, no placement is more than 0." in output


@pytest.mark.usefixtures("no_figures")
def test_the_gap_of_a_run_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    assert main(["run", "trap", *SHORT, "--robots", "4", "--out", str(out)]) == 0
    capsys.readouterr()
    row = read_json(capsys, "optimum", "--run", str(out), "--lattice", "16", "--restarts", "3")
    end = json.loads((out / "run.json").read_bytes())["summary"]["mean_distance_m"]
    (run,) = row["runs"]
    assert row["robots"] == 4
    assert run["run"] == "run"
    assert run["mean_distance_m"] == pytest.approx(end, rel=1e-9)
    assert run["gap"] == pytest.approx(end / row["mean_distance_m"] - 1.0)
    assert run["gap"] > 0.0
    assert main(["optimum", "--run", str(out), "--lattice", "16", "--restarts", "3"]) == 0
    assert f"gap {run['gap']:.1%}" in capsys.readouterr().out


@pytest.mark.usefixtures("no_figures")
def test_a_comparison_has_a_gap_for_each_controller(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "both"
    assert main(["compare", "trap", *SHORT, "--controllers", "rapf", "rpf", "--out", str(out)]) == 0
    capsys.readouterr()
    row = read_json(capsys, "optimum", "--run", str(out), *FAST)
    assert [run["run"] for run in row["runs"]] == ["rapf", "rpf"]
    assert all(run["gap"] > 0.0 for run in row["runs"])


@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize("change", ["--fail=2@0.1", "--join=2@9"])
def test_a_run_in_which_the_team_changes_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: str
) -> None:
    out = tmp_path / "run"
    assert main(["run", "trap", *SHORT, "--robots", "4", change, "--out", str(out)]) == 0
    capsys.readouterr()
    assert main(["optimum", "--run", str(out), *FAST]) == 2
    assert "expected a run without moving obstacles, failures or joins" in capsys.readouterr().err


@pytest.mark.usefixtures("no_figures")
def test_a_run_that_covers_other_rooms_has_no_gap(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    halves = Environment(
        "halves",
        ((0, 0), (8, 0), (8, 4), (0, 4)),
        (WallObstacle(((3, 0), (3, 4)), 0.1),),
        {"left": DiscStart((1.5, 2.0), 1.0)},
    )
    save_map(halves, tmp_path / "halves.json")
    out = tmp_path / "run"
    assert main(["run", str(tmp_path / "halves.json"), *SHORT, "--robots", "2", "--out", str(out)]) == 0
    capsys.readouterr()
    row = read_json(capsys, "optimum", "--run", str(out), *FAST)
    assert row["uncovered_area_m2"] == 0.0
    assert row["runs"][0]["gap"] is None
    assert main(["optimum", "--run", str(out), *FAST]) == 0
    assert "covers different parts of the map from the best placement" in capsys.readouterr().out


@pytest.mark.slow
def test_figures_are_reproducible_in_both_themes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    light = tmp_path / "light.png"
    dark = tmp_path / "dark.png"
    assert main(["optimum", "trap", *FAST, "--plot", str(light)]) == 0
    assert main(["optimum", "trap", *FAST, "--plot", str(dark), "--theme", "dark"]) == 0
    content = light.read_bytes()
    assert main(["optimum", "trap", *FAST, "--plot", str(light)]) == 0
    assert light.read_bytes() == content
    capsys.readouterr()
    assert np.array(Image.open(light))[0, 0, :3].min() == 255
    assert np.array(Image.open(dark))[0, 0, :3].max() < 50


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "expected either MAP or --run DIR"),
        (("rooms", "--run", "x"), "expected either MAP or --run DIR"),
        (("roms",), "unknown map 'roms': did you mean 'rooms'?"),
        (("rooms", "--robots", "0"), "--robots: expected a whole number from 1 to 500, got 0"),
        (("rooms", "--robots", "many"), "--robots: "),
        (("rooms", "--restarts", "0"), "--restarts: expected a whole number from 1 to 100000, got 0"),
        (("rooms", "--lattice", "1"), "--lattice: expected a whole number from 2 to 2048, got 1"),
        (("rooms", "--seed", "-1"), "--seed: expected a whole number of at least 0, got -1"),
        (("rooms", "--precision", "0"), "--precision: expected a number from 0.00001 to 1, got 0.0"),
        (("rooms", "--radius", "-1"), "radius: expected a number from 0.001 to 1000 m, got -1.0"),
        (("square", "--radius", "6"), "radius: no space for a robot of radius 6 m in map"),
        (("rooms", "--plot", "a.jpg"), "'.jpg'"),
        (("--run", "nowhere"), "nowhere: expected the folder of a run"),
        (
            ("--run", "x", "--robots", "3"),
            "--robots: cannot be combined with --run, which gives its value; got 3",
        ),
        (("--run", "x", "--radius", "0.2"), "--radius: cannot be combined with --run"),
        (("rooms", "--positions", "."), ".: expected a file, got a folder"),
    ],
)
def test_invalid_options_are_reported(
    arguments: tuple[str, ...], part: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert part in read_error(capsys, "optimum", *arguments)


def test_positions_are_overwritten_only_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.json"
    file.write_text("[[1, 1]]")
    arguments = ("optimum", "trap", *FAST, "--positions", str(file))
    assert "already exists" in read_error(capsys, *arguments)
    assert file.read_text() == "[[1, 1]]"
    assert main([*arguments, "--overwrite"]) == 0
    assert len(json.loads(file.read_bytes())) == 6


@pytest.mark.slow
def test_ctrl_c_leaves_no_files(tmp_path: Path) -> None:
    file = tmp_path / "best.json"
    arguments = ("optimum", "museum", "--restarts", "100000", "--robots", "20", "--positions", str(file))
    process = subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True)
    time.sleep(4.0)
    process.send_signal(signal.SIGINT)
    try:
        _, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []
