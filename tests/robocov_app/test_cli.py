from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robocov
from robocov.controllers import CONTROLLERS, gains_of
from robocov.mapfile import bundled_maps, load_map
from robocov.record import Record
from robocov_app.cli import COMMANDS, main

SHORT = ("--duration", "1.0", "--lattice", "16", "--size", "480x320")
COMMAND = (sys.executable, "-m", "robocov_app")


def complaint(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Call the command with something wrong; return the one line that it must say."""
    assert main(list(words)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.strip().splitlines()
    assert len(lines) == 1, said.err
    assert lines[0].startswith("robocov: error: ")
    return lines[0].removeprefix("robocov: error: ")


def answer(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    assert main([*words, "--json"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    return json.loads(said.out)


# -- asking ----------------------------------------------------------------------------------------


def test_overview_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for name, (_, line) in COMMANDS.items():
        assert f"  {name}" in out
        assert line in out


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_with_an_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "-h"]) == 0
    out = capsys.readouterr().out
    assert f"usage: robocov {name}" in out
    assert f"Example: robocov {name}" in out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"robocov {robocov.__version__}\n"


def test_maps_lists_every_bundled_map(capsys: pytest.CaptureFixture[str]) -> None:
    rows = answer(capsys, "maps")["maps"]
    assert [row["name"] for row in rows] == list(bundled_maps())
    for row in rows:
        assert row["starts"] == list(load_map(row["name"]).starts)
    assert main(["maps"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in bundled_maps())


def test_controllers_lists_gains_with_units_and_marks_the_flagship(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = {row["name"]: row for row in answer(capsys, "controllers")["controllers"]}
    assert [name for name, row in rows.items() if row["flagship"]] == ["rapf"]
    for name, kind in CONTROLLERS.items():
        assert [gain["name"] for gain in rows[name]["gains"]] == list(gains_of(kind))
    assert rows["rapf"]["gains"][0]["unit"] == "N m³"
    assert main(["controllers"]) == 0
    out = capsys.readouterr().out
    assert "attraction_limit" in out
    assert "(recommended)" in out


def test_schema_is_a_json_schema(capsys: pytest.CaptureFixture[str]) -> None:
    import jsonschema

    assert main(["schema"]) == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(capsys.readouterr().out))


def test_check_measures_maps_and_reports_each_bad_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row = answer(capsys, "check", "square")["maps"][0]
    assert row["valid"]
    assert row["area_m2"] == row["free_area_m2"] == 100.0
    assert row["components_m2"] == [100.0]
    bad = tmp_path / "bad.json"
    bad.write_text('{"format": "robocov-map", "version": 1, "name": "x", "boundary": [[0, 0], [1, 1]]}')
    assert main(["check", "square", str(bad), "--json"]) == 2
    rows = json.loads(capsys.readouterr().out)["maps"]
    assert [row["valid"] for row in rows] == [True, False]
    assert rows[1]["error"].startswith(f"{bad}: boundary")
    assert main(["check", "square", str(bad)]) == 2
    said = capsys.readouterr()
    assert "narrowest gap" in said.out
    assert f"robocov: error: {bad}: boundary" in said.err


def test_cost_of_a_robot_in_the_middle_of_a_square(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    positions = tmp_path / "robots.json"
    positions.write_text("[[5, 5]]")
    sites = tmp_path / "sites.npz"
    row = answer(
        capsys, "cost", "square", "--positions", str(positions), "--lattice", "64", "--sites", str(sites)
    )
    # the mean distance to the centre of a unit square is (sqrt 2 + asinh 1) / 6
    assert row["mean_distance_m"] == pytest.approx(10 * (np.sqrt(2) + np.arcsinh(1)) / 6, rel=1e-3)
    assert row["cost_m3"] == pytest.approx(100 * row["mean_distance_m"])
    with np.load(sites) as saved:
        assert saved["points"].shape == (4096, 2)
        np.testing.assert_allclose(saved["distances"], np.hypot(*(saved["points"] - 5).T), atol=1e-9)
        assert (saved["owner"] == 0).all()


def test_import_a_floor_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = tmp_path / "plan.json"
    plan.write_text(
        json.dumps({"id": "ours", "verts": [[0, 0], [6, 0], [6, 4], [3, 4], [3, 7], [0, 7], [0, 0]]})
    )
    out = tmp_path / "flat.json"
    row = answer(capsys, "import", str(plan), "-o", str(out))
    assert row["area_kept_m2"] == pytest.approx(33.0)
    assert load_map(out).free_area == pytest.approx(33.0)
    assert "exists already" in complaint(capsys, "import", str(plan), "-o", str(out))


# -- running ---------------------------------------------------------------------------------------


def test_run_saves_everything_and_says_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    words = (
        "run",
        "rooms",
        *SHORT,
        "--frames",
        "--video",
        "--fps",
        "10",
        "--film-speed",
        "1",
        "--out",
        str(out),
    )
    assert main(list(words)) == 0
    said = capsys.readouterr()
    assert str(out) in said.out
    assert "mean distance" in said.out
    names = sorted(path.name for path in out.iterdir())
    assert names == sorted(
        [
            "run.json",
            "record.npz",
            "cost.csv",
            "trajectories.png",
            "trajectories.svg",
            "cost.png",
            "cost.svg",
            "frames",
            "run.mp4",
        ]
    )
    frames = sorted(path.name for path in (out / "frames").iterdir())
    assert frames == [f"{k:06d}.png" for k in range(len(frames))]
    assert len(frames) == 11 + 10, "one second at ten frames, and one second on the last"
    header, *rows = (out / "cost.csv").read_text().splitlines()
    assert header == "time_s,mean_distance_m,cost_m3,uncovered_area_m2"
    assert len(rows) == 11
    run = json.loads((out / "run.json").read_text())
    assert run["summary"]["mean_distance_m"] == float(rows[-1].split(",")[1])
    assert run["controller"] == {
        "name": "rapf",
        "gains": {g.name: g.default for g in gains_of(CONTROLLERS["rapf"]).values()},
    }
    assert len(Record.load(out)) == 61


def test_run_answers_in_json_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row = answer(capsys, "run", "square", *SHORT, "--out", str(tmp_path / "run"))
    assert {"out", "mean_distance_m", "cost_m3", "settled_at_s", "contacts", "min_clearance_m"} <= set(row)
    assert row["settled_at_s"] is None
    assert row["interrupted"] is False


def test_the_same_words_give_the_same_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        answer(capsys, "run", "rooms", *SHORT, "--seed", "5", "--out", str(tmp_path / name))
    for file in (
        "record.npz",
        "run.json",
        "cost.csv",
        "trajectories.png",
        "trajectories.svg",
        "cost.png",
        "cost.svg",
    ):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file


def test_compare_gives_every_controller_the_same_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "compare"
    rows = answer(
        capsys, "compare", "rooms", *SHORT, "--set", "k_rep=1", "rpf.k_rep=2", "--video", "--out", str(out)
    )
    assert [row["controller"] for row in rows["runs"]] == ["rapf", "rpf", "lloyd"]
    assert [row["gains"].get("k_rep") for row in rows["runs"]] == [1.0, 2.0, None]
    assert min(row["above_best"] for row in rows["runs"]) == 0.0
    records = [Record.load(out / name) for name in ("rapf", "rpf", "lloyd")]
    assert all((record.positions[0] == records[0].positions[0]).all() for record in records)
    names = {path.name for path in out.iterdir()}
    assert {"comparison.json", "comparison.csv", "comparison.mp4", "cost.svg", "trajectories.png"} <= names
    assert len((out / "comparison.csv").read_text().splitlines()) == 4


def test_overwrite_removes_the_old_result_and_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    answer(capsys, "run", "square", *SHORT, "--frames", "--out", str(out))
    (out / "notes.txt").write_text("mine")
    (out / "frames" / "notes.txt").write_text("mine")
    assert "not empty" in complaint(capsys, "run", "square", *SHORT, "--out", str(out))
    answer(capsys, "run", "square", *SHORT, "--out", str(out), "--overwrite")
    assert (out / "notes.txt").read_text() == "mine"
    assert [path.name for path in (out / "frames").iterdir()] == ["notes.txt"]


def test_a_controller_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    pull: float = 0.5\n"
        "    def force(self, own):\n"
        "        return self.pull * (own.centroid - own.position)\n"
    )
    out = tmp_path / "run"
    answer(
        capsys, "run", "square", *SHORT, "--controller", f"{mine}:Mine", "--set", "pull=2", "--out", str(out)
    )
    record = Record.load(out)
    assert record.controller == f"{mine}:Mine", "the run can be repeated from its record"
    assert record.label == "Mine"
    assert record.gains == {"pull": 2.0}
    assert not np.isnan(record.goals).any()


@pytest.mark.parametrize(
    ("law", "part"),
    [
        (
            "return 1 / 0",
            "controller 'Mine': ZeroDivisionError: division by zero (mine.py, line 5) at 0.000 s",
        ),
        ("return [1.0]", "controller 'Mine': force(own) gave [1.0], but two numbers in newtons were wanted"),
        ("return None", "controller 'Mine': force(own) gave nan"),
        ("raise SystemExit(0)", "controller 'Mine': SystemExit: 0 (mine.py, line 5)"),
        ("return [float('nan'), 0]", "controller 'Mine': force [nan, 0.0] on robot 1 at 0.000 s"),
        ("return 'east'", "controller 'Mine': ValueError"),
    ],
)
def test_a_controller_that_fails_is_named_with_its_line(
    law: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    def force(self, own):\n"
        f"        {law}\n"
    )
    out = tmp_path / "run"
    words = ("run", "square", *SHORT, "--json", "--controller", f"{mine}:Mine", "--out", str(out))
    assert part in complaint(capsys, *words)
    assert not out.exists(), "a folder with nothing in it is not left behind"


# -- wrong input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ("frobnicate", "unknown command 'frobnicate'"),
        ("rum rooms", "did you mean 'run'?"),
        ("run roms", "unknown map 'roms': did you mean 'rooms'?"),
        ("run rooms --controller raf", "unknown controller 'raf': did you mean 'rapf'?"),
        ("run rooms --set k_rep=-1", "rapf.k_rep: -1, but a number from 0"),
        ("run rooms --set k_rep", "--set: 'k_rep', but GAIN=VALUE"),
        ("run rooms --set k_rep=1 k_rep=2", "k_rep is given twice"),
        ("run rooms --set k_rep=big", "--set k_rep: 'big', but a number"),
        ("run rooms --set krep=1", "did you mean 'k_rep'?"),
        ("run rooms --robots 0", "--robots: 0, but a number from 1"),
        ("run rooms --robots 5000", "but 5000 were asked for"),
        ("run rooms --robots many", "--robots: 'many', but a whole number was wanted"),
        ("run rooms --start coridor", "did you mean 'corridor'?"),
        ("run rooms --dt 0", "dt: 0.0 s"),
        ("run rooms --dt nan", "dt: nan s"),
        ("run rooms --duration 1e6", "rows of the record"),
        ("run rooms --duration -1", "--duration: -1.0"),
        ("run rooms --max-speed 0", "team.max_speed: 0.0 m/s"),
        ("run rooms --max-acceleration inf", "team.max_acceleration: inf"),
        ("run rooms --sensing-range -1", "team.sensing_range: -1.0 m"),
        ("run rooms --communication-range nan", "team.communication_range: nan m"),
        ("run rooms --radius 0", "team.radius: 0.0 m"),
        ("run rooms --radius nan", "team.radius: nan m"),
        ("run square --lattice 2 --robots 1 --radius 0.2 --start nowhere", "unknown start 'nowhere'"),
        ("cost rooms --positions x.json --sites .", "--sites: '.', but the name of a file was wanted"),
        ("run rooms --radius 4", "no room for a robot of radius 4 m"),
        ("run rooms --lattice 1", "--lattice: 1"),
        ("run rooms --size big", "--size: 'big', but WIDTHxHEIGHT"),
        ("run rooms --size 10x10", "--size: 10"),
        ("run rooms --theme blue", "--theme: 'blue', but one of 'light', 'dark'"),
        ("run rooms --vidoe", "unknown option --vidoe: did you mean --video?"),
        ("run rooms --seed", "--seed: a value was wanted"),
        ("run rooms --seed -1", "--seed: -1"),
        ("run rooms extra", "unknown option extra"),
        ("run /no/such/map.json", "/no/such/map.json"),
        ("compare rooms --controllers", "none given"),
        ("compare rooms --controllers rapf rapf", "each once was wanted"),
        ("compare rooms --set lloyd.k_rep=1", "--set lloyd.k_rep: unknown gain 'k_rep'"),
        ("compare rooms --set rap.k_rep=1", "unknown controller 'rap'"),
        ("check", "at least one map file"),
        ("cost rooms", "--positions: this option is required"),
        ("cost rooms --positions /no/file.json", "/no/file.json: cannot be read"),
        ("import /no/plan.json -o /tmp/x.json", "/no/plan.json"),
    ],
)
def test_wrong_input_gets_one_clear_line(
    words: str, part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert part in complaint(capsys, *words.split())
    assert list(tmp_path.iterdir()) == [], "nothing may be left behind by what was refused"


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"{}", "but a list of [x, y] in metres was wanted"),
        (b"[]", "but a list of [x, y] in metres was wanted"),
        (b"[[1, 2], [3]]", "[1]: [3], but [x, y]"),
        (b"[[1, true]]", "[0]: [1, True]"),
        (b"[[1, NaN]]", "[0]: [1, nan]"),
        (b"[[1, 1e999]]", "[0]: [1, inf]"),
        (b"[[1, " + b"9" * 400 + b"]]", "[0]: [1, 999"),
        (b"[[1, 2", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b"[[50, 50]]", "50"),
    ],
)
def test_wrong_positions_are_refused(
    content: bytes, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "robots.json"
    file.write_bytes(content)
    assert part in complaint(capsys, "cost", "square", "--positions", str(file))


_WORD = st.one_of(
    st.sampled_from(
        [
            "rooms",
            "square",
            "--",
            "-",
            "--robots",
            "--set",
            "--seed",
            "--dt",
            "--size",
            "--out",
            "--json",
            "--lattice",
            "--start",
            "k_rep=1",
            "k_rep=",
            "=1",
            "rapf",
            "nan",
            "1e400",
            "-1",
            "0",
            "3",
            "null",
            "--theme",
            "light",
            "--controller",
            "x.py:Y",
            "--max-speed",
        ]
    ),
    st.text(max_size=6).filter(lambda text: "\x00" not in text and max(text, default=" ") < "\ud800"),
)


@settings(max_examples=120)
@given(
    command=st.sampled_from(["run", "compare", "check", "cost", "import"]), words=st.lists(_WORD, max_size=6)
)
def test_any_words_end_in_an_answer_or_one_line(
    command: str, words: list[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """What cannot be parsed is refused; what can is stopped by a folder that is in use."""
    import contextlib
    import io

    if {"-h", "--help"} & set(words):
        return
    taken = tmp_path_factory.getbasetemp() / "taken"
    taken.mkdir(exist_ok=True)
    (taken / "full").touch()
    last = {"run": ["--out", str(taken)], "compare": ["--out", str(taken)], "import": ["-o", str(taken)]}.get(
        command, []
    )
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([command, *words, *last])
    assert status in (0, 2), err.getvalue()
    if status == 2 and command != "check":
        assert out.getvalue() == ""
        assert len(err.getvalue().strip().splitlines()) == 1
        assert err.getvalue().startswith("robocov: error: ")


def test_an_out_that_cannot_be_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "file"
    file.write_text("")
    line = complaint(capsys, "run", "square", *SHORT, "--out", str(file / "x"))
    assert line.startswith(f"{file / 'x'}: cannot be used for results: Not a directory")


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="needs a limit on the size of files")
@pytest.mark.parametrize(("limit", "file"), [(2_000, "record.npz"), (45_000, "trajectories.png")])
def test_a_full_disk_leaves_no_half_written_file(tmp_path: Path, limit: int, file: str) -> None:
    """The size of files is limited, which fails as a full disk does: in the middle of a write."""
    script = (
        "import resource, signal, sys\n"
        f"signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from robocov_app.cli import main\n"
        "import robocov, robocov_app.run, robocov_app.plots, matplotlib.figure\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n"
        f"out = {str(tmp_path / 'run')!r}\n"
        "words = ['run', 'rooms', '--duration', '1', '--lattice', '16', '--out', out]\n"
        "sys.exit(main(words))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    errors = [line for line in done.stderr.splitlines() if line.startswith("robocov: error: ")]
    assert len(errors) == 1
    assert "Traceback" not in done.stderr
    assert f"{file}: cannot be written" in errors[0]
    left = [path.name for path in (tmp_path / "run").glob("*")]
    assert file not in left
    assert not [name for name in left if "part" in name]


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_keeps_what_is_done_and_says_so(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = subprocess.Popen(
        [
            *COMMAND,
            "run",
            "square",
            "--duration",
            "3000",
            "--lattice",
            "16",
            "--size",
            "480x320",
            "--out",
            str(out),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not out.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    said, complaints = process.communicate(timeout=120)
    assert process.returncode == 130, complaints
    assert "Traceback" not in complaints
    assert "stopped at" in said
    assert "what was done is in" in said
    record = Record.load(out)
    assert 10 < len(record) < 180_000
    run = json.loads((out / "run.json").read_text())
    assert run["duration_s"] == pytest.approx(record.time[-1])
    assert run["summary"]["mean_distance_m"] > 0
    assert len((out / "cost.csv").read_text().splitlines()) < 300, "nobody waits for all of the cost"
    assert (out / "trajectories.png").exists()


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_during_a_film_keeps_the_film_so_far(tmp_path: Path) -> None:
    """In a terminal Ctrl-C goes to the whole process group, the encoder included."""
    import imageio_ffmpeg

    out = tmp_path / "run"
    words = [
        "run",
        "square",
        "--duration",
        "20",
        "--lattice",
        "16",
        "--film-speed",
        "0.01",
        "--size",
        "480x320",
    ]
    process = subprocess.Popen(
        [*COMMAND, *words, "--video", "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not list(out.glob(".run.*.part.mp4")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    said, complaints = process.communicate(timeout=60)
    assert process.returncode == 130, complaints
    assert "Traceback" not in complaints
    assert "run.mp4" in said
    assert not list(out.glob(".*")), "no unfinished file is left"
    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(out / "run.mp4"))
    assert frames > 3


@pytest.mark.parametrize("command", ["controllers", "maps", "check rooms", "schema"])
def test_a_terminal_that_knows_ascii_only_gets_an_answer(command: str) -> None:
    done = subprocess.run(
        [*COMMAND, *command.split()],
        env={**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0
    assert done.stderr == b""
    assert len(done.stdout) > 100


@pytest.mark.skipif(os.name == "nt", reason="a shell of POSIX")
def test_nobody_listening_is_no_error(tmp_path: Path) -> None:
    words = ["run", "square", *SHORT, "--out", str(tmp_path / "run")]
    done = subprocess.run(f"{' '.join([*COMMAND, *words])} >&-", shell=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "trajectories.png").exists()


def test_a_controller_for_the_whole_team_needs_no_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "import robocov as rc\n"
        "@dataclass(frozen=True)\n"
        "class Still:\n"
        "    def begin(self, region, team):\n"
        "        return 0\n"
        "    def decide(self, seen, memory):\n"
        "        assert memory == round(60 * seen.time)\n"
        "        return rc.Decision(0 * seen.positions, memory=memory + 1)\n"
    )
    out = tmp_path / "out"
    words = ("compare", "square", *SHORT, "--controllers", "rapf", f"{mine}:Still", "--out", str(out))
    assert [row["label"] for row in answer(capsys, *words)["runs"]] == ["RAPF", "Still"]
    assert (Record.load(out / "Still").forces == 0).all()


def test_names_with_brackets_are_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    label = '[bold]R[/] [/] $x'\n"
        "    def force(self, own):\n"
        "        return own.centroid - own.position\n"
    )
    words = (
        "compare",
        "square",
        *SHORT,
        "--controllers",
        "rapf",
        f"{mine}:Mine",
        "--out",
        str(tmp_path / "out"),
    )
    assert main(list(words)) == 0
    assert "[bold]R[/] [/] $x" in capsys.readouterr().out


def test_a_reader_that_has_had_enough_is_no_error() -> None:
    done = subprocess.run(
        f"{sys.executable} -m robocov_app schema | head -c 10",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert len(done.stdout) == 10
