"""Commands in trouble: full disks, missing permissions, Ctrl+C and restricted terminals."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from command_calls import COMMAND, SHORT, read_error, read_json
from sample_sessions import advance_session, start_session
from session_records import build_records

from robocov.controllers import Rapf
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.runs import artifacts, execution, video


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="needs a limit on the size of files")
@pytest.mark.parametrize("earlier", [False, True])
@pytest.mark.parametrize(("limit", "file"), [(2_000, "record.npz"), (45_000, "trajectories.png")])
@pytest.mark.slow
def test_a_full_disk_leaves_no_partial_files_and_keeps_the_earlier_result(
    tmp_path: Path, limit: int, file: str, *, earlier: bool
) -> None:
    """A limit on the size of files fails as a full disk does, in the middle of a write."""
    before = {"run.json": '{"format": "robocov-run"}', "trajectories.png": "old", "record.npz": "old"}
    if earlier:
        (tmp_path / "run").mkdir()
        for name, text in before.items():
            (tmp_path / "run" / name).write_text(text)
    script = (
        "import resource, signal, sys\n"
        f"signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from robocov_app.cli import main\n"
        "import robocov, robocov_app.runs.execution, robocov_app.figures.map_pages, matplotlib.figure\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n"
        f"out = {str(tmp_path / 'run')!r}\n"
        "arguments = ['run', 'rooms', '--duration', '1', '--lattice', '16', '--overwrite', '--out', out]\n"
        "sys.exit(main(arguments))\n"
    )
    # Without -B, Python would leave truncated bytecode of modules.
    process = subprocess.run(
        [sys.executable, "-B", "-c", script], capture_output=True, text=True, check=False
    )
    assert process.returncode == 2, process.stderr
    errors = [line for line in process.stderr.splitlines() if line.startswith("robocov: error: ")]
    assert len(errors) == 1
    assert "Traceback" not in process.stderr
    assert f"{file}: cannot be written" in errors[0]
    files = {path.name: path for path in (tmp_path / "run").glob("*")}
    if earlier:
        assert {name: path.read_text() for name, path in files.items()} == before
    assert earlier or file not in files
    assert not [name for name in files if "part" in name or "new" in name]


@pytest.mark.skipif(os.name == "nt", reason="special files of POSIX")
@pytest.mark.parametrize(
    "arguments",
    [
        *("generate --overwrite --out", "generate --plot", "export square --overwrite --format wkt --out"),
        *("import square.wkt --overwrite --out", "import square.wkt --out o.json --overwrite --preview"),
        *("cost square --positions p.json --sites", "cost square --positions p.json --plot"),
        *("optimum square --overwrite --positions", "edit square --screenshot"),
        *("demo square --frames 2 --video", "report run --overwrite --out", "metrics run --plot"),
    ],
)
@pytest.mark.parametrize(
    ("name", "expected_message"),
    [
        ("pipe", "expected a file, got a named pipe"),
        ("link", "expected a file, got a named pipe"),
        pytest.param("x" * 252, "File name too long", id="too long"),
    ],
)
def test_an_unwritable_file_is_reported_and_unchanged(
    arguments: str,
    name: str,
    expected_message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The file is a named pipe, a link to one, or has too long a name."""
    monkeypatch.chdir(tmp_path)
    Path("p.json").write_text("[[1, 1], [2, 2]]")
    suffix = {"--plot": ".png", "--preview": ".png", "--screenshot": ".png", "--video": ".mp4"}
    target = Path(name + suffix.get(arguments.split()[-1], ".json"))
    if name in ("pipe", "link"):
        os.mkfifo(target if name == "pipe" else "a pipe")
    if name == "link":
        target.symlink_to("a pipe")
    if "run" in arguments.split():
        (record,) = build_records(advance_session(start_session(), 5))
        record.save(Path("run"))
    elif "import" in arguments:
        Path("square.wkt").write_text("POLYGON ((0 0, 9 0, 9 9, 0 9, 0 0))")
    before = {path: path.lstat().st_mode for path in tmp_path.iterdir()}
    assert expected_message in read_error(capsys, *arguments.split(), str(target))
    assert {path: path.lstat().st_mode for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    "arguments",
    [
        *(
            "run square --out",
            "compare square --out",
            "replay",
            "report",
            "metrics",
            "optimum --run",
            "check",
        ),
        *("generate --count 2 --out", "import", "demo square --frames 1 --out", "run"),
    ],
)
def test_too_long_names_are_reported_in_one_line(arguments: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "n" * 40 in read_error(capsys, *arguments.split(), "n" * 256)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may read every folder")
@pytest.mark.parametrize("arguments", ["run square --overwrite --out", "replay", "report", "generate --out"])
def test_missing_permissions_are_reported_in_one_line(
    arguments: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tmp_path.chmod(0)
    try:
        assert "ermission denied" in read_error(capsys, *arguments.split(), str(tmp_path / "x"))
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.slow
def test_ctrl_c_keeps_and_reports_partial_results(tmp_path: Path) -> None:
    arguments = ("--duration", "3000", "--lattice", "16", "--size", "480x320")
    for delay in (1.0, 5.0, 25.0):  # until the run has recorded some steps
        out = tmp_path / f"run-{delay}"
        command = [*COMMAND, "run", "square", *arguments, "--out", str(out)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not out.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=120)
        if (out / "run.json").exists() and len(Record.load(out)) > 10:
            break
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "Interrupted at" in output
    assert "Partial results are in" in output
    record = Record.load(out)
    assert 10 < len(record) < 180_000
    run = json.loads((out / "run.json").read_text())
    assert run["duration_s"] == pytest.approx(record.time[-1])
    assert run["summary"]["mean_distance_m"] > 0
    assert len((out / "cost.csv").read_text().splitlines()) < 300, "the cost is computed of few steps"
    assert (out / "trajectories.png").exists()


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.slow
def test_ctrl_c_keeps_the_finished_part_of_a_video(tmp_path: Path) -> None:
    """In a terminal Ctrl+C goes to the whole process group, the encoder included."""
    import imageio_ffmpeg

    out = tmp_path / "run"
    arguments = "run square --duration 20 --lattice 16 --video-speed 0.01 --size 480x320".split()
    process = subprocess.Popen(
        [*COMMAND, *arguments, "--video", "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not list(out.rglob("*.part.mp4")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "run.mp4" in output
    assert [path.name for path in out.glob(".*")] == [".robocov.json"], "no unfinished file is left"
    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(out / "run.mp4"))
    assert frames > 3


RUN = ("run", "square", *SHORT)
COMPARISON = ("compare", "square", "--controllers", "rapf", "lloyd", *SHORT)


@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize("command", [RUN, COMPARISON], ids=["run", "compare"])
@pytest.mark.parametrize(
    ("option", "message"),
    [("--frames", "The frames are incomplete."), ("--video", "The video is incomplete.")],
)
def test_ctrl_c_during_a_video_does_not_interrupt_the_runs(
    command: tuple[str, ...],
    option: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write = video.write_frames_and_video

    def interrupt_and_write(*arguments: Any, **options: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        write(*arguments, **options)

    monkeypatch.setattr(video, "write_frames_and_video", interrupt_and_write)
    out = tmp_path / "out"
    assert main([*command, option, "--out", str(out)]) == 130
    output = capsys.readouterr().out
    assert f"{message} Results are in {out}" in output
    assert "Interrupted" not in output and "Partial" not in output


@pytest.mark.parametrize("command", [RUN, COMPARISON], ids=["run", "compare"])
def test_ctrl_c_during_the_last_figures_interrupts_nothing(
    command: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(artifacts, "save_figures", lambda *_, **__: signal.raise_signal(signal.SIGINT))
    out = tmp_path / "out"
    assert main([*command, "--out", str(out)]) == 0
    assert f"saved in {out}" in capsys.readouterr().out


@pytest.mark.usefixtures("no_figures")
def test_ctrl_c_after_the_last_step_does_not_limit_the_samples_of_the_cost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    save = Record.save
    interrupted_folders: list[Any] = []

    def interrupt_and_save(self: Record, folder: Any, *arguments: Any, **options: Any) -> None:
        if not interrupted_folders:  # The record is saved for the first time before the evaluation.
            interrupted_folders.append(folder)
            signal.raise_signal(signal.SIGINT)
        save(self, folder, *arguments, **options)

    monkeypatch.setattr(execution, "MAX_SAMPLES_AFTER_INTERRUPTION", 3)
    monkeypatch.setattr(Record, "save", interrupt_and_save)
    out = tmp_path / "out"
    assert main([*RUN, "--out", str(out)]) == 0
    assert interrupted_folders
    output = capsys.readouterr().out
    assert f"saved in {out}" in output and "Interrupted" not in output
    assert len((out / "cost.csv").read_text().splitlines()) > 10


@pytest.mark.usefixtures("no_figures")
@pytest.mark.parametrize("command", [RUN, COMPARISON], ids=["run", "compare"])
def test_ctrl_c_during_a_run_leaves_partial_results(
    command: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    decide = Rapf.decide

    def interrupt_and_decide(self: Rapf, seen: Any, memory: Any) -> Any:
        if round(60 * seen.time) == 30:
            signal.raise_signal(signal.SIGINT)
        return decide(self, seen, memory)

    monkeypatch.setattr(Rapf, "decide", interrupt_and_decide)
    out = tmp_path / "out"
    assert main([*command, "--frames", "--out", str(out)]) == 130
    output = capsys.readouterr().out
    assert "Interrupted" in output
    assert f"Partial results are in {out}" in output
    assert not (out / "lloyd").exists()


@pytest.mark.parametrize("command", ["controllers", "maps", "check rooms", "schema"])
@pytest.mark.slow
def test_commands_print_on_terminals_restricted_to_ascii(command: str) -> None:
    process = subprocess.run(
        [*COMMAND, *command.split()],
        env={**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"},
        capture_output=True,
        check=False,
    )
    assert process.returncode == 0
    assert process.stderr == b""
    assert len(process.stdout) > 100


@pytest.mark.skipif(os.name == "nt", reason="a shell of POSIX")
@pytest.mark.slow
def test_a_closed_standard_output_is_not_an_error(tmp_path: Path) -> None:
    arguments = ["run", "square", *SHORT, "--out", str(tmp_path / "run")]
    process = subprocess.run(
        f"{' '.join([*COMMAND, *arguments])} >&-", shell=True, capture_output=True, check=False
    )
    assert process.returncode == 0, process.stderr
    assert (tmp_path / "run" / "trajectories.png").exists()


@pytest.mark.usefixtures("no_figures")
def test_a_team_controller_is_named_after_its_class(
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
    arguments = ("compare", "square", *SHORT, "--controllers", "rapf", f"{mine}:Still", "--out", str(out))
    assert [row["label"] for row in read_json(capsys, *arguments)["runs"]] == ["RAPF", "Still"]
    assert (Record.load(out / "Still").forces == 0).all()


def test_brackets_in_labels_are_not_interpreted_as_markup(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    label = '[bold]R[/] [/] $x'\n"
        "    def force(self, own):\n"
        "        return own.centroid - own.position\n"
    )
    arguments = ["compare", "square", *SHORT, "--controllers", "rapf", f"{mine}:Mine"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 0
    assert "[bold]R[/] [/] $x" in capsys.readouterr().out


@pytest.mark.slow
def test_a_reader_that_closes_the_pipe_early_is_not_an_error() -> None:
    process = subprocess.run(
        f"{sys.executable} -m robocov_app schema | head -c 10",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.stderr == ""
    assert len(process.stdout) == 10
