"""What the README and the handbook show works as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import robocov as rc
from robocov.controllers import make_controller
from robocov.errors import MapError
from robocov.mapfile import list_bundled_maps, load_map, parse_map
from robocov.simulation import Simulation
from robocov_app.cli import COMMANDS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "app/handbook").glob("*.md"))]
README = "\n".join(page.read_text() for page in PAGES)
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, flags=re.DOTALL)


def find_block(language: str, part: str) -> str:
    return next(text for kind, text in BLOCKS if kind == language and part in text)


def test_the_map_is_valid_and_its_mistakes_are_named_as_it_says() -> None:
    text = find_block("json", "desk")
    assert parse_map(text, "README").free_area < 60.0
    with pytest.raises(MapError, match=r"^mine.json:8:54: obstacles\[2\].radius: expected "):
        parse_map(text.replace('"radius": 0.5', '"radius": -1'), "mine.json")


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    exec(
        find_block("python", "\nsimulation = rc.Simulation(environment").replace("run(60.0)", "run(0.5)"),
        {"rc": rc},
    )
    assert len(capsys.readouterr().out.split()) == 3


@pytest.mark.parametrize("name", ["Homing", "Patient"])
def test_the_controllers_run(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(find_block("python", f"class {name}"))
    controller = make_controller(f"{file}:{name}")
    room = load_map("rooms")
    record = Simulation(room, controller, room.start().sample(3), dt=1 / 30).run(2.0)
    assert record.label == name
    assert abs(record.positions[-1] - record.positions[0]).max() > 0.1


def test_every_command_and_map_that_it_names_exists() -> None:
    calls = re.findall(r"(?:`|bin/)robocov ([a-z]+) ([\w-]+)", README)
    assert len(calls) > 8
    for command, word in calls:
        assert command in COMMANDS
        if command in ("run", "compare", "cost") and word != "story":  # a session's file
            assert word in list_bundled_maps()


def test_the_readme_is_one_screen() -> None:
    assert PAGES[0].stat().st_size <= 6000


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_pictures_and_pages_that_it_links_to_are_there(page: Path) -> None:
    names = re.findall(r'(?:src|srcset)="([^"]+)"|\]\(([\w./-]+)\)', page.read_text())
    for name in ("".join(pair) for pair in names):
        made = name.startswith("reference/")  # when the pages are built, with a test of their links
        assert made or (page.parent / name).is_file(), name


def test_a_map_may_begin_with_its_schema(tmp_path: Path) -> None:
    assert '`{"$schema": "./map.schema.json",`' in README
    text = find_block("json", "desk").replace("{", '{"$schema": "./map.schema.json",', 1)
    assert parse_map(text, "README").schema == "./map.schema.json"
