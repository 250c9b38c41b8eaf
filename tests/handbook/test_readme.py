"""Examples, links and pictures of the README and the handbook."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from markdown_pages import README, find_code, list_handbook_pages

import robocov as rc
from robocov.controllers import make_controller
from robocov.errors import MapError
from robocov.mapfile import list_bundled_maps, load_map, parse_map
from robocov.simulation import Simulation
from robocov_app.cli import COMMANDS

PAGES = [README, *list_handbook_pages()]
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
MAX_README_BYTES = 6000
"""A longer README is no overview any more; details belong in the handbook."""
MAP_COMMANDS = ("run", "compare", "cost")


def test_the_map_is_valid_and_an_error_in_it_is_located_as_described() -> None:
    text = find_code(TEXT, "json", "desk")
    assert parse_map(text, "README").free_area < 60.0
    with pytest.raises(MapError, match=r"^mine.json:8:54: obstacles\[2\].radius: expected "):
        parse_map(text.replace('"radius": 0.5', '"radius": -1'), "mine.json")


def test_a_map_may_begin_with_its_schema() -> None:
    assert '`{"$schema": "./map.schema.json",`' in TEXT
    text = find_code(TEXT, "json", "desk").replace("{", '{"$schema": "./map.schema.json",', 1)
    assert parse_map(text, "README").schema == "./map.schema.json"


def test_the_example_of_a_simulation_prints_three_values(capsys: pytest.CaptureFixture[str]) -> None:
    example = find_code(TEXT, "python", "\nsimulation = rc.Simulation(environment")
    exec(example.replace("run(60.0)", "run(0.5)"), {"rc": rc})
    assert len(capsys.readouterr().out.split()) == 3


@pytest.mark.parametrize("name", ["Homing", "Patient"])
def test_robots_with_controllers_of_the_handbook_move(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(find_code(TEXT, "python", f"class {name}"))
    controller = make_controller(f"{file}:{name}")
    environment = load_map("rooms")
    record = Simulation(environment, controller, environment.start().sample(3), dt=1 / 30).run(2.0)
    assert record.label == name
    assert abs(record.positions[-1] - record.positions[0]).max() > 0.1


def test_all_commands_and_maps_exist() -> None:
    calls = re.findall(r"(?:`|bin/)robocov ([a-z]+) ([\w-]+)", TEXT)
    assert len(calls) > 8
    for command, argument in calls:
        assert command in COMMANDS
        # The argument may be the file of a session.
        if command in MAP_COMMANDS and argument != "session":
            assert argument in list_bundled_maps()


def test_the_readme_is_short() -> None:
    assert README.stat().st_size <= MAX_README_BYTES


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_linked_pages_and_pictures_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r'(?:src|srcset)="([^"]+)"', text) + re.findall(r"\]\(([\w./-]+)\)", text)
    for target in targets:
        # Pages of the reference are generated. `test_building.py` checks links to them.
        is_generated = target.startswith("reference/")
        assert is_generated or (page.parent / target).is_file(), target
