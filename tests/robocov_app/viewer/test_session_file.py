"""Session files: small, validated, with errors that name the location, and safe to open."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from sample_sessions import HALL, RAPF, advance_session, advance_with_costs, start_session

from robocov.conditions import Conditions, Failure, Join
from robocov.environment import CircleObstacle
from robocov.errors import InputError, MapError
from robocov.mapfile import load_map
from robocov_app.cli import main
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.models import build_session_schema
from robocov_app.viewer.session.files.session_file import (
    build_session_content,
    format_session,
    load_session,
    save_session,
)
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

MAX_FILE_BYTES = 3000
USER_CONTROLLER = """
import robocov as rc
from dataclasses import dataclass

@dataclass(frozen=True)
class Mine(rc.Lloyd):
    label = 'Mine'
"""
PRINT_POSITIONS = """
import sys
from pathlib import Path
from robocov_app.viewer.session.files.session_file import load_session
from robocov_app.viewer.session.session import Session

session = Session.open(load_session(Path(sys.argv[1])))
sys.stdout.write(session.timeline.panes[0].simulation.positions.tobytes().hex())
"""


def save(session: Session, path: Path) -> None:
    timeline = session.timeline
    save_session(path, timeline.document, timeline.head, timeline.step, {})


def build_content_with_edit() -> dict[str, Any]:
    """Build the content of a file with two nodes, of which the second lets a robot fail at step 10."""
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_session(session, 20)
    timeline = session.timeline
    content = build_session_content(timeline.document, timeline.head, timeline.step, {})
    return json.loads(format_session(content))


@pytest.mark.slow
def test_a_session_is_the_same_in_another_process(tmp_path: Path) -> None:
    conditions = Conditions(
        loss=0.2,
        delay=0.1,
        position_noise=0.02,
        failures=(Failure(2, 0.5),),
        joins=(Join(4, 0.8, (3.0, 3.0)),),
        seed=3,
    )
    session = advance_session(start_session(RAPF, robots=4, conditions=conditions), 40)
    session.edit_map(add_obstacle(HALL, CircleObstacle((2.0, 3.0), 0.3)), "circle drawn")
    advance_session(session, 40)
    texts = [event.text for event in session.timeline.events]
    assert texts == ["robot 2 failed", "circle drawn", "robot 4 joined"]
    path = tmp_path / "session.robocov"
    save(session, path)
    command = [sys.executable, "-c", PRINT_POSITIONS, str(path)]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    expected = session.timeline.panes[0].simulation.positions.tobytes().hex()
    assert process.stdout.endswith(expected)


def test_a_file_is_small_and_valid(tmp_path: Path) -> None:
    session = advance_session(start_session(RAPF, environment=load_map("rooms"), robots=6), 30)
    session.playback.is_playing = True
    for move in range(60):
        session.drag_robot(2, (3.0 + 0.01 * move, 2.0))
        session.playback.advance(1 / 60)
    session.release()
    path = tmp_path / "session.robocov"
    save(session, path)
    assert path.stat().st_size < MAX_FILE_BYTES
    content = json.loads(path.read_text())
    assert content["format"] == "robocov-session"
    assert content["maps"][0]["bundled"] == "rooms"
    jsonschema.Draft202012Validator(build_session_schema()).validate(content)


def test_a_bundled_map_that_has_changed_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "session.robocov"
    save(start_session(RAPF, environment=load_map("rooms")), path)
    digest = json.loads(path.read_text())["maps"][0]["digest"]
    path.write_text(path.read_text().replace(digest, "0"))
    message = rf'maps\[0\]\.digest: expected "{digest}", got "0": the bundled map \'rooms\' has changed'
    with pytest.raises(MapError, match=message):
        load_session(path)


def test_the_description_of_a_bundled_map_is_kept_and_may_change(tmp_path: Path) -> None:
    path = tmp_path / "session.robocov"
    described = replace(load_map("rooms"), description="My rooms.")
    save(start_session(RAPF, environment=described), path)
    assert json.loads(path.read_text())["maps"][0]["description"] == "My rooms."
    earlier_digest = "f80cc6154428d973"
    save(start_session(RAPF, environment=load_map("rooms")), path)
    digest = json.loads(path.read_text())["maps"][0]["digest"]
    path.write_text(path.read_text().replace(digest, earlier_digest))
    assert Session.open(load_session(path)).timeline.scenario.environment == load_map("rooms")


def test_the_branches_of_a_file_are_described_before_they_are_recomputed(tmp_path: Path) -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_with_costs(session, 20)
    session.undo()
    session.add_robot((3.0, 3.0))
    advance_with_costs(session, 20)
    path = tmp_path / "session.robocov"
    save(session, path)
    timeline = Session.open(load_session(path)).timeline
    dt = timeline.scenario.dt
    descriptions = [branch.describe_end(dt) for branch in timeline.document.list_branches()]
    assert sorted(descriptions) == ["0.5 s", "0.5 s · RAPF 2.517 m"]


@pytest.mark.parametrize(
    ("json_path", "value", "message"),
    [
        (("head",), 9, "head: expected the index of an edit, 0 to 1, got 9"),
        (("step",), 999, "step: expected a step of the head, 10 to 30, got 999"),
        (("edits", 1, "parent"), 1, "edits[1].parent: expected null for the first"),
        (("edits", 1, "at"), 999, "edits[1].at: expected a step of edit 0, 0 to 10, got 999"),
        (
            ("edits", 1, "end"),
            9,
            "edits[1].end: expected a step at or after its changes, whose steps must ascend",
        ),
        (("edits", 1, "changes", 0, "robot"), "two", 'changes[0].robot: expected an integer, got "two"'),
        (("edits", 1, "changes", 0, "do"), "fly", "edits[1].changes[0].do: expected one of 'drag', "),
        (("edits", 1, "changes", 0), {"robot": 2}, "edits[1].changes[0].do: missing"),
        (("edits", 1, "changes", 0), 5, "edits[1].changes[0]: expected an object, got 5"),
        (("edits", 1, "changes"), [], "edits[1].changes: expected at least 1 item, got []"),
        (("edits", 1, "curves"), {"0 speed": [[0], [1]]}, 'edits[1].curves: expected "0 distance", '),
        (
            ("edits", 0, "changes", 0, "scenario", "robots"),
            0,
            "edits[0].changes[0].scenario.robots: expected greater than or equal to 1, got 0",
        ),
        (("edits", 0, "changes", 0, "scenario", "map"), 7, "scenario.map: expected the number of a map"),
        (("edits", 0, "changes", 0, "scenario"), 7, "changes[0].scenario: expected an object, got 7"),
        (("maps", 0, "boundary"), [], "maps[0]: boundary: "),
        (("version",), 2, "version: expected 1, got 2; it was written by a newer robocov"),
        (("nonsense",), 1, "nonsense: unknown key"),
    ],
)
def test_errors_name_the_file_and_the_place(tmp_path: Path, json_path, value, message) -> None:
    content = build_content_with_edit()
    parent: Any = content
    for key in json_path[:-1]:
        parent = parent[key]
    parent[json_path[-1]] = value
    file = tmp_path / "session.robocov"
    file.write_text(json.dumps(content))
    with pytest.raises(MapError) as caught:
        load_session(file)
    assert message in str(caught.value)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_edit_that_cannot_be_repeated_is_named(tmp_path: Path, capsys) -> None:
    content = build_content_with_edit()
    content["edits"][1]["changes"][0]["robot"] = 77
    file = tmp_path / "session.robocov"
    file.write_text(json.dumps(content))
    assert main(["run", str(file), "--out", str(tmp_path / "run")]) == 2
    assert f"{file}: edits[1], “robot 1 failed”: there is no robot 77\n" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_controller_in_a_file_is_only_run_if_the_user_names_it(tmp_path: Path) -> None:
    controller_file = tmp_path / "mine.py"
    controller_file.write_text(USER_CONTROLLER)
    name = f"{controller_file}:Mine"
    session = advance_session(start_session(ControllerChoice(name)), 5)
    path = tmp_path / "session.robocov"
    save(session, path)
    with pytest.raises(
        InputError, match=r"pass --controller \S+mine\.py:Mine \(--controllers for robocov demo\)$"
    ):
        load_session(path)
    opened = Session.open(load_session(path, [name]))
    assert opened.timeline.end_time == session.timeline.end_time


def test_early_files_with_other_keys_are_read_and_saved_with_the_present_keys(tmp_path: Path) -> None:
    content = build_content_with_edit()
    early = dict(content)
    early["touches"] = [dict(node) for node in early.pop("edits")]
    for node in early["touches"]:
        node["words"] = node.pop("description")
    path = tmp_path / "early.robocov"
    path.write_text(json.dumps(early))
    session = Session.open(load_session(path))
    assert [event.text for event in session.timeline.events] == ["robot 1 failed"]
    save(session, path)
    saved = json.loads(path.read_text())
    assert saved["edits"] == content["edits"]
    assert "touches" not in saved
    early["touches"][1]["words"] = 7
    path.write_text(json.dumps(early))
    with pytest.raises(MapError, match=r"touches\[1\]\.words: expected a string, got 7"):
        load_session(path)
    early["edits"] = content["edits"]
    path.write_text(json.dumps(early))
    with pytest.raises(MapError, match="touches: unknown key"):
        load_session(path)
    del early["edits"], early["touches"]
    path.write_text(json.dumps(early))
    with pytest.raises(MapError, match="edits: missing"):
        load_session(path)


def test_the_schema_describes_every_field_and_is_strict_json() -> None:
    schema = build_session_schema()
    json.dumps(schema, allow_nan=False)
    for name, definition in schema["$defs"].items():
        assert "Attributes" not in definition["description"], name
        for key, field_schema in definition["properties"].items():
            assert field_schema.get("description"), (name, key)
