"""What the README shows works as it is printed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from robocov.controllers import make_controller
from robocov.errors import MapError
from robocov.mapfile import bundled_maps, load_map, parse_map
from robocov.simulation import Simulation
from robocov_app.cli import COMMANDS, main
from robocov_app.sweep.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

README = (Path(__file__).parents[1] / "README.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, flags=re.DOTALL)


def block(language: str, part: str) -> str:
    return next(text for kind, text in BLOCKS if kind == language and part in text)


def test_the_map_is_valid_and_its_mistakes_are_named_as_it_says() -> None:
    text = block("json", "robocov-map")
    assert parse_map(text, "README").free_area < 60.0
    with pytest.raises(MapError, match=r"^mine.json:8:54: obstacles\[2\].radius: -1, but "):
        parse_map(text.replace('"radius": 0.5', '"radius": -1'), "mine.json")


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    exec(block("python", "import robocov as rc\n\nenvironment").replace("run(60.0)", "run(0.5)"), {})
    assert len(capsys.readouterr().out.split()) == 3


@pytest.mark.slow
def test_the_examples_of_plots_and_tables_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    study = Study((StudyMap("square", load_map("square")),), ("rapf",), duration=0.5)
    sweep(study, Path("study"), workers=1, quiet=True)
    names: dict[str, Any] = {}
    exec(block("python", "import robocov as rc\n\nenvironment").replace("run(60.0)", "run(20.0)"), names)
    exec(block("python", "record.to_pandas()"), names)
    assert (tmp_path / "cost.pdf").read_bytes().startswith(b"%PDF")
    assert len(names["frame"]) == len(names["record"]) * 6 and len(names["results"]) == 1
    assert names["axes"].has_data() and len(names["slow"]) == 101


@pytest.mark.parametrize("name", ["Homing", "Patient"])
def test_the_controllers_run(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(block("python", f"class {name}"))
    controller = make_controller(f"{file}:{name}")
    room = load_map("rooms")
    record = Simulation(room, controller, room.start().sample(3), dt=1 / 30).run(2.0)
    assert record.label == name
    assert abs(record.positions[-1] - record.positions[0]).max() > 0.1


def test_every_command_and_map_that_it_names_exists() -> None:
    calls = re.findall(r"(?:`|bin/)robocov (\w+) ([\w-]+)", README)
    assert len(calls) > 8
    for command, word in calls:
        assert command in COMMANDS
        if command in ("run", "compare", "cost") and word != "story":  # a session's file
            assert word in bundled_maps()


def test_pictures_are_there() -> None:
    names = re.findall(r'(?:src|srcset)="([^"]+)"|!\[[^]]*\]\(([^)]+)\)', README)
    assert len(names) >= 2
    for name in ("".join(pair) for pair in names):
        assert (Path(__file__).parents[1] / name).is_file()


@pytest.mark.slow
def test_the_maps_that_it_generates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # a few of many will do
    text = block("sh", "robocov generate").replace("--count 20", "--count 3").replace("full", "quick")
    calls = [line.partition("#")[0].split() for line in text.splitlines()]
    assert [call[:2] for call in calls] == [["robocov", "generate"]] * 3
    for call in calls:
        assert main(call[1:]) == 0
    assert load_map("cave.json").starts
    assert len(list(Path("mazes").iterdir())) == 3 and Path("mazes.png").stat().st_size > 1000
    assert Path("paper-maps/generated-1.json").is_file()


def test_a_map_may_begin_with_its_schema(tmp_path: Path) -> None:
    assert '`{"$schema": "./map.schema.json",`' in README
    text = block("json", "robocov-map").replace("{", '{"$schema": "./map.schema.json",', 1)
    assert parse_map(text, "README").schema == "./map.schema.json"
