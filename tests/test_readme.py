"""What the README shows works as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from robocov.controllers import make_controller
from robocov.errors import MapError
from robocov.mapfile import bundled_maps, parse_map
from robocov_app.cli import COMMANDS

README = (Path(__file__).parents[1] / "README.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, flags=re.DOTALL)


def block(language: str, part: str) -> str:
    return next(text for kind, text in BLOCKS if kind == language and part in text)


def test_the_map_is_valid_and_its_mistakes_are_named_as_it_says() -> None:
    text = block("json", "robocov-map")
    assert parse_map(text, "README").free_area < 60.0
    with pytest.raises(MapError, match=r"^mine.json: obstacles\[2\].radius: -1, but "):
        parse_map(text.replace('"radius": 0.5', '"radius": -1'), "mine.json")


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    exec(block("python", "import robocov as rc\n\nenvironment").replace("run(60.0)", "run(0.5)"), {})
    assert len(capsys.readouterr().out.split()) == 3


def test_the_controller_is_one(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(block("python", "class Homing"))
    assert make_controller(f"{file}:Homing", {"shy": 0.5}).name == "Homing"


def test_every_command_and_map_that_it_names_exists() -> None:
    calls = re.findall(r"(?:`|bin/)robocov (\w+) ([\w-]+)", README)
    assert len(calls) > 8
    for command, word in calls:
        assert command in COMMANDS
        if command in ("run", "compare", "cost"):
            assert word in bundled_maps()


def test_pictures_are_there() -> None:
    names = re.findall(r'(?:src|srcset)="([^"]+)"|!\[[^]]*\]\(([^)]+)\)', README)
    assert len(names) >= 2
    for name in ("".join(pair) for pair in names):
        assert (Path(__file__).parents[1] / name).is_file()
