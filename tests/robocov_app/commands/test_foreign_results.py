"""Results may come from untrusted sources: no command executes code from their folders."""

import json
import sys
from pathlib import Path

import pytest
from command_calls import read_error
from small_studies import ROOM, DirectExecutor, write_controller

from robocov.mapfile import save_map
from robocov.metrics.results import read_results
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.notebook import render_record_html, render_record_png
from robocov_app.replication.design.contenders import Contender
from robocov_app.replication.design.studies import Contest
from robocov_app.replication.results.outcome_tables import read_outcomes
from robocov_app.sweep.study.study_file import read_study
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.missing_controller import MissingController
from robocov_app.viewer.window.window import ViewerWindow

# One worker makes the results.
pytestmark = pytest.mark.xdist_group("foreign results")

SHORT = ("--duration", "0.5", "--dt", "0.05", "--lattice", "8", "--robots", "2", "--size", "320x240")
SMALL = ("--size", "320x240", "--fps", "2", "--video-speed", "1")
STUDY = """
maps = ["room.json"]
controllers = ["mine.py:Mine"]
robots = 2
duration = 0.5
dt = 0.05
lattice = 8
"""
MALICIOUS_CODE = "from pathlib import Path\nPath({marker!r}).touch()\n"


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a run, a comparison and a sweep whose controllers have become malicious."""
    folder = tmp_path_factory.mktemp("shared")
    save_map(ROOM, folder / "room.json")
    name = write_controller(folder, "")
    (folder / "study.toml").write_text(STUDY)
    (folder / "lloyd.toml").write_text(STUDY.replace("mine.py:Mine", "lloyd"))
    room = str(folder / "room.json")
    # An installed package may offer a controller as well.
    offered = folder / "offered-1.0.dist-info"
    offered.mkdir()
    (offered / "METADATA").write_text("Metadata-Version: 2.1\nName: offered\nVersion: 1.0\n")
    (offered / "entry_points.txt").write_text("[robocov.controllers]\nplanted = planted:Mine\n")
    (folder / "planted.py").write_text((folder / "mine.py").read_text())
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)
        for command in (
            ["run", room, "--controller", name, "--out", str(folder / "run")],
            ["run", room, "--controller", "planted", "--out", str(folder / "offered")],
            ["compare", room, "--controllers", "lloyd", name, "planted", "--out", str(folder / "both")],
        ):
            assert main([*command, *SHORT]) == 0
        arguments = ["sweep", str(folder / "study.toml"), "--out", str(folder / "sweep"), "--workers", "1"]
        assert main(arguments) == 0
    for path in ("run/run.json", "both/Mine/run.json"):
        run = json.loads((folder / path).read_text())
        run["controller"]["source"] = MALICIOUS_CODE.format(marker=str(folder / "marker"))
        (folder / path).write_text(json.dumps(run))
    for path in ("mine.py", "planted.py"):
        text = (folder / path).read_text()
        (folder / path).write_text(MALICIOUS_CODE.format(marker=str(folder / "marker")) + text)
    return folder


@pytest.fixture(autouse=True)
def remove_traces(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (shared / "marker").unlink(missing_ok=True)
    monkeypatch.syspath_prepend(shared)
    monkeypatch.delitem(sys.modules, "planted", raising=False)


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> list[Session]:
    """Collect the sessions of windows, which are used on a dummy display and closed."""
    sessions: list[Session] = []

    def run(window: ViewerWindow) -> None:
        for tab in ("show", "robot", "parameters"):
            window.panel.show_tab(tab)
            window.run_command("robot:next")
            for _ in range(10):
                window.run_frame(1 / 30)
        for action in ("live", "step", "restart", "first", "branch:here", "more", "save:run"):
            window.run_command(action)
            window.run_frame(1 / 30)
        sessions.append(window.viewer.session)
        window.close()

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("ROBOCOV_SETTINGS", "")
    monkeypatch.setattr(ViewerWindow, "run", run)
    return sessions


@pytest.mark.parametrize(
    "arguments",
    [
        ("replay", "run"),
        ("replay", "offered"),
        ("replay", "both"),
        ("replay", "run", "--frames", *SMALL, "--out", "video"),
        ("replay", "both", "--frames", *SMALL, "--out", "video"),
        ("report", "run", "offered", "both", "sweep", "--out", "report.html"),
        ("metrics", "run"),
        ("metrics", "both", "--plot", "metrics.png"),
        ("optimum", "--run", "both", "--restarts", "1", "--lattice", "8"),
        ("sweep", "lloyd.toml", "--dry-run", "--out", "sweep"),
    ],
    ids=" ".join,
)
@pytest.mark.slow
def test_no_command_executes_code_of_results(
    shared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    windows: list[Session],
    arguments: tuple[str, ...],
) -> None:
    monkeypatch.chdir(shared)
    outputs = ("video", "report.html", "metrics.png")
    status = main([str(tmp_path / word) if word in outputs else word for word in arguments])
    assert not (shared / "marker").exists()
    assert status == 0 or arguments[0] == "sweep"  # A sweep rejects the folder of another study.
    for session in windows:
        is_missing = [isinstance(pane.controller, MissingController) for pane in session.timeline.panes]
        assert is_missing == ([False, True, True] if arguments[1] == "both" else [True])


@pytest.mark.slow
def test_the_library_executes_no_code_of_results(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(shared)
    for folder in ("run", "offered", "both/Mine", "both/planted"):
        record = Record.load(shared / folder)
        record.snapshot(3)
        record.compute_cells(3)
        record.to_json()
        repr(record)
        render_record_html(record)
        render_record_png(record)
    results = read_results(shared / "sweep")
    assert results.record(0).controller == results.to_pandas()["controller"][0] == "mine.py:Mine"
    contest = Contest(read_study(shared / "lloyd.toml"), (Contender("lloyd", "lloyd", "lloyd", {}),))
    read_outcomes(shared / "sweep", contest, {})
    assert not (shared / "marker").exists()


@pytest.mark.slow
def test_the_controller_of_a_run_is_loaded_only_on_request(
    shared: Path,
    windows: list[Session],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    name = write_controller(tmp_path, "", "safe.py")
    assert main(["replay", str(shared / "run"), "--controller", name]) == 0
    (session,) = windows
    assert session.timeline.panes[0].controller.name == name
    assert session.timeline.is_live
    assert session.timeline.end_time == 0.0, "the run was restarted"
    assert not (shared / "marker").exists()
    capsys.readouterr()
    message = read_error(capsys, "replay", str(shared / "run"), "--controller", name.replace("Mine", "Other"))
    assert "safe.py: unknown class 'Other' (known: Mine)" in message
