"""Commands that print information, and errors in arguments and files of all commands."""

import contextlib
import gc
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_calls import SHORT, read_error, read_json
from drawn_run import ROOMS, record_walk
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

import robocov
from robocov.controllers import CONTROLLERS, get_gains
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.cli import COMMANDS, main


def test_the_overview_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for name, command in COMMANDS.items():
        assert f"  {name}" in out
        assert command.summary in out


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_every_command_has_an_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "-h"]) == 0
    out = capsys.readouterr().out
    assert f"usage: robocov {name}" in out
    assert f"Example: robocov {name}" in out
    assert not re.findall(r"None|\d\.\d{6}", out), "defaults are values that a user could type"
    positional = out.partition("positional arguments")[2].partition("╰")[0]
    required = re.findall(r"^│ \w[^│]*│(?:\n│  [^│]*│)*", positional, re.M)
    assert not any("(default:" in argument for argument in required), "optional arguments are in brackets"


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"robocov {robocov.__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--version"]])
def test_a_reader_that_has_ended_causes_no_error(arguments: list[str]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "robocov_app", *arguments]
    process = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert process.stderr == ""
    assert process.returncode == (0 if arguments else 2)


def test_the_process_of_a_command_collects_no_garbage_at_exit(monkeypatch: pytest.MonkeyPatch) -> None:
    functions_at_exit: list[object] = []
    monkeypatch.setattr("atexit.register", functions_at_exit.append)
    monkeypatch.setattr("sys.argv", ["robocov", "--version"])
    main()
    assert functions_at_exit == [gc.freeze]


def test_maps_lists_every_bundled_map(capsys: pytest.CaptureFixture[str]) -> None:
    rows = read_json(capsys, "maps")["maps"]
    assert [row["name"] for row in rows] == list(list_bundled_maps())
    for row in rows:
        assert row["starts"] == list(load_map(row["name"]).starts)
    assert main(["maps"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in list_bundled_maps())


def test_controllers_lists_gains_with_units_and_recommendations(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = {row["name"]: row for row in read_json(capsys, "controllers")["controllers"]}
    assert [name for name, row in rows.items() if row["flagship"]] == ["rapf"]
    assert [name for name, row in rows.items() if row["recommended"]] == ["atlas", "atlas-shared"]
    for name, controller in CONTROLLERS.items():
        assert [gain["name"] for gain in rows[name]["gains"]] == list(get_gains(controller))
    assert rows["rapf"]["gains"][0]["unit"] == "N m³"
    assert rows["rapf"]["information"] == "own"
    assert rows["geodesic-lloyd"]["information"] == "whole map"
    assert main(["controllers"]) == 0
    out = capsys.readouterr().out
    assert "Geodesic Lloyd   (informed: whole map)" in out
    assert "attraction_limit" in out
    assert "rapf   RAPF   (the paper's controller)" in out
    assert "atlas   Atlas   (recommended)" in out


def test_controllers_lists_only_named_ones_if_there_are_any(capsys: pytest.CaptureFixture[str]) -> None:
    rows = read_json(capsys, "controllers", "lloyd", "rapf")["controllers"]
    assert [row["name"] for row in rows] == ["lloyd", "rapf"]


def test_controllers_rejects_unknown_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["controllers", "loyd"]) == 2
    assert "unknown controller 'loyd': did you mean 'lloyd'?" in capsys.readouterr().err


def test_the_map_schema_is_a_valid_json_schema(capsys: pytest.CaptureFixture[str]) -> None:
    import jsonschema

    assert main(["schema"]) == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(capsys.readouterr().out))


def test_check_measures_areas(capsys: pytest.CaptureFixture[str]) -> None:
    (row,) = read_json(capsys, "check", "square")["maps"]
    assert row["valid"]
    assert row["area_m2"] == 100.0
    assert row["free_area_m2"] == 100.0
    assert row["components_m2"] == [100.0]


@pytest.fixture
def invalid_map(tmp_path: Path) -> Path:
    """A map with an error in line 1, column 66."""
    path = tmp_path / "invalid.json"
    path.write_text('{"format": "robocov-map", "version": 1, "name": "x", "boundary": [[0, 0], [1, 1]]}')
    return path


def test_check_reports_invalid_maps_as_json(invalid_map: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "square", str(invalid_map), "--json"]) == 2
    valid_row, invalid_row = json.loads(capsys.readouterr().out)["maps"]
    assert valid_row["valid"]
    assert not invalid_row["valid"]
    assert invalid_row["error"].startswith(f"{invalid_map}:1:66: boundary")
    assert invalid_row["line"] == 1
    assert invalid_row["column"] == 66


def test_check_prints_valid_maps_and_errors(invalid_map: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "square", str(invalid_map)]) == 2
    output = capsys.readouterr()
    assert "narrowest passage" in output.out
    assert f"robocov: error: {invalid_map}:1:66: boundary" in output.err


def test_the_cost_of_a_robot_at_the_center_of_a_square_is_exact(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    positions = tmp_path / "robots.json"
    positions.write_text("[[5, 5]]")
    sites = tmp_path / "sites.npz"
    row = read_json(
        capsys, "cost", "square", "--positions", str(positions), "--lattice", "64", "--sites", str(sites)
    )
    # The mean distance to the center of a unit square is (sqrt 2 + asinh 1) / 6.
    assert row["mean_distance_m"] == pytest.approx(10 * (np.sqrt(2) + np.arcsinh(1)) / 6, rel=1e-3)
    assert row["cost_m3"] == pytest.approx(100 * row["mean_distance_m"])
    with np.load(sites) as saved:
        assert saved["points"].shape == (4096, 2)
        expected = np.linalg.norm(saved["points"] - 5, axis=1)
        np.testing.assert_allclose(saved["distances"], expected, atol=1e-9)
        assert (saved["owner"] == 0).all()


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """A plan of an L-shaped flat of 33 m²."""
    path = tmp_path / "plan.json"
    corners = [[0, 0], [6, 0], [6, 4], [3, 4], [3, 7], [0, 7], [0, 0]]
    path.write_text(json.dumps({"id": "flat", "verts": corners}))
    return path


def test_an_import_keeps_the_free_area(
    plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "flat.json"
    row = read_json(capsys, "import", str(plan), "-o", str(out))
    assert row["area_kept_m2"] == pytest.approx(33.0)
    assert load_map(out).free_area == pytest.approx(33.0)


def test_an_import_replaces_no_file(plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "flat.json"
    out.touch()
    assert "already exists" in read_error(capsys, "import", str(plan), "-o", str(out))


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("frobnicate", "unknown command 'frobnicate'"),
        ("rum rooms", "did you mean 'run'?"),
        ("run roms", "unknown map 'roms': did you mean 'rooms'?"),
        ("run rooms --controller rpaf", "unknown controller 'rpaf': did you mean 'rapf' or 'rpf'?"),
        ("run rooms --controller raf", "unknown controller 'raf': did you mean 'rapf' or 'rpf'?"),
        ("run rooms --set k_rep=-1", "rapf.k_rep: expected a number from 0"),
        ("run rooms --set k_rep", "--set: expected GAIN=VALUE"),
        ("run rooms --set k_rep=1 k_rep=2", "k_rep is given twice"),
        ("run rooms --set k_rep=big", "rapf.k_rep: expected a number from 0 to"),
        ("run rooms --set k_rep=0,3", "--set k_rep: expected a number (or null), or a word, got '0,3'"),
        ("run rooms --set target=mediane", "rapf.target: unknown choice 'mediane': did you mean 'median'?"),
        ("run rooms --set target=3", "rapf.target: expected one of centroid, sensing, median, got 3"),
        ("run rooms --set krep=1", "did you mean 'k_rep'?"),
        ("run rooms --robots 0", "--robots: expected a number from 1"),
        ("run rooms --robots 5000", "but 5000 were requested"),
        ("run rooms --robots many", "--robots: expected a whole number, got 'many'"),
        ("run rooms --start coridor", "did you mean 'corridor'?"),
        ("run rooms --max-speed -1", "--max-speed: expected a number from"),
        ("run rooms --fail 9@1", "--fail: expected a robot from 1 to 6, got robot 9"),
        ("run rooms --message-rate -1", "--message-rate: expected a number"),
        ("run rooms --dt nan", "--dt: expected a number from 0.0001 to 1 s, got nan"),
        ("run rooms --duration 1e6 --record-hz 60", "rows of the record"),
        ("run rooms --duration -1", "--duration: expected a number from 0 to 1000000 s, got -1.0"),
        ("run rooms --max-speed 0", "--max-speed: expected a number from 0.000001 to 1000, got 0.0 m/s"),
        (
            "run rooms --max-acceleration inf",
            "--max-acceleration: expected a number from 0.000001 to 1000000, got inf m/s²",
        ),
        (
            "run rooms --sensing-range -1",
            "--sensing-range: expected a number from 0 to 100000 or null for no limit, got -1.0 m",
        ),
        (
            "run rooms --communication-range nan",
            "--communication-range: expected a number from 0 to 100000 or null for no limit, got nan m",
        ),
        ("run rooms --radius 0", "--radius: expected a number from 0.001 to 1000, got 0.0 m"),
        ("run rooms --radius nan", "--radius: expected a number from 0.001 to 1000, got nan m"),
        ("run square --lattice 2 --robots 1 --radius 0.2 --start nowhere", "unknown start 'nowhere'"),
        ("cost rooms --positions x.json --sites .", ".: expected a file, got a folder"),
        ("run rooms --radius 4", "no space for a robot of radius 4 m"),
        ("run rooms --lattice 1", "--lattice: expected a number from 2 to 2048, got 1"),
        ("run rooms --size big", "--size: expected WIDTHxHEIGHT"),
        ("run rooms --size 10x10", "--size: expected a number from 320 to 7680 pixels wide, got 10"),
        ("run rooms --theme blue", "--theme: expected dark or light, got 'blue'"),
        ("run rooms --dt 0", "--dt: expected a number from 0.0001 to 1 s, got 0.0"),
        ("run rooms --vidoe", "unknown option --vidoe: did you mean --video?"),
        ("run rooms --seed", "--seed: expected a value"),
        ("run rooms --seed -1", "--seed: expected a number from 0 to 9.22337e+18, got -1"),
        ("run rooms extra", "unexpected argument 'extra'"),
        ("run rooms rapf", "unexpected argument 'rapf': did you mean --controller rapf?"),
        ("run rooms robots 3", "unexpected argument 'robots': did you mean --robots?"),
        ("run rooms -robots 3", "unknown option -robots: did you mean --robots?"),
        ("schema foo", "schema: expected map or session, got 'foo'"),
        ("lesson 99", "lesson: expected check, got '99'"),
        ("sweep", "missing argument: expected STUDY.toml"),
        ("lesson", "lesson: expected check, got nothing"),
        ("run /no/such/map.json", "/no/such/map.json"),
        ("compare rooms --controllers", "--controllers: expected at least one, got none"),
        (
            "compare rooms --controllers rapf rapf",
            "duplicate value. Compare several gains of a controller in a sweep",
        ),
        ("compare rooms --set lloyd.k_rep=1", "--set lloyd.k_rep: unknown gain 'k_rep'"),
        ("compare rooms --set rap.k_rep=1", "unknown controller 'rap'"),
        ("check", "at least one map file"),
        ("cost rooms", "--positions: this option is required"),
        ("cost rooms --positions /no/file.json", "/no/file.json: cannot be read"),
        ("import /no/plan.json -o /tmp/x.json", "/no/plan.json"),
    ],
)
def test_invalid_commands_print_one_line_and_write_nothing(
    command: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in read_error(capsys, *command.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"{}", "expected a list of [x, y] in meters"),
        (b"[]", "expected a list of [x, y] in meters"),
        (b"[[1, 2], [3]]", "[1]: expected [x, y]"),
        (b"[[1, true]]", "[0]: expected [x, y], two finite numbers in meters, got [1, True]"),
        (b"[[1, NaN]]", "[0]: expected [x, y], two finite numbers in meters, got [1, nan]"),
        (b"[[1, 1e999]]", "[0]: expected [x, y], two finite numbers in meters, got [1, inf]"),
        (b"[[1, " + b"9" * 400 + b"]]", "[0]: expected [x, y], two finite numbers in meters, got [1, 999"),
        (b"[[1, 2", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b"[[50, 50]]", "50"),
    ],
)
def test_invalid_files_of_positions_are_rejected(
    content: bytes, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "robots.json"
    file.write_bytes(content)
    assert message in read_error(capsys, "cost", "square", "--positions", str(file))


# fmt: off
ARGUMENTS = st.one_of(
    st.sampled_from(
        ["rooms", "square", "--", "-", "--robots", "--set", "--seed", "--dt", "--size", "--out", "--json",
            "--lattice", "--start", "k_rep=1", "k_rep=", "=1", "rapf", "nan", "1e400", "-1", "0", "3",
            "null", "--theme", "light", "--controller", "x.py:Y", "--max-speed"]
    ),
    st.text(max_size=6).filter(lambda text: "\x00" not in text and max(text, default=" ") < "\ud800"),
)
# fmt: on


@settings(max_examples=count_examples(40))
@given(
    command=st.sampled_from(["run", "compare", "check", "cost", "import"]),
    arguments=st.lists(ARGUMENTS, max_size=6),
)
def test_random_arguments_give_a_result_or_one_line(
    command: str, arguments: list[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Commands whose arguments are valid stop because their output folder is in use."""
    if {"-h", "--help"} & set(arguments):
        return
    used_folder = tmp_path_factory.getbasetemp() / "used"
    used_folder.mkdir(exist_ok=True)
    (used_folder / "file").touch()
    output_options = {"run": ["--out"], "compare": ["--out"], "import": ["-o"]}
    if command in output_options:
        arguments = [*arguments, *output_options[command], str(used_folder)]
    out = io.StringIO()
    err = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([command, *arguments])
    assert status in (0, 2), err.getvalue()
    if status == 2 and command != "check":
        assert out.getvalue() == ""
        assert len(err.getvalue().strip().splitlines()) == 1
        assert err.getvalue().startswith("robocov: error: ")


def test_an_output_folder_in_a_file_is_rejected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "file"
    file.write_text("")
    message = read_error(capsys, "run", "square", *SHORT, "--out", str(file / "x"))
    assert message.startswith(f"{file / 'x'}: cannot be written: Not a directory")


LONG = "x" * 300


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (f"report run --out {LONG}", f"{LONG}: cannot be "),
        (f"report {LONG}", f"{LONG}: "),
        (f"metrics {LONG}", f"{LONG}"),
        (
            f"generate --width 1 --kind {LONG * 20}",
            "--kind: expected polygons, blocks, rooms",
        ),
        ("replay run --frames --out loop", "loop: "),
        ("replay loop", "loop: "),
        (
            "run square --controller loop/mine.py:Mine",
            "loop/mine.py: no such file",
        ),
        ("run square --robots 1.5", "--robots: expected a whole number, got '1.5'"),
        (f"sweep a --workers {'9' * 5000}", "--workers: expected a whole number, got '999"),
        ("sweep a --workers 1.5", "--workers: expected a whole number, got '1.5'"),
        ("generate --width ten", "--width: expected a number, got 'ten'"),
    ],
    ids=range(11),
)
def test_unusual_arguments_print_one_short_line(
    command: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "run").mkdir()
    record_walk(ROOMS, 2).save(tmp_path / "run")
    error = read_error(capsys, *command.split())
    assert error.startswith(message)
    assert len(error) < 1100
