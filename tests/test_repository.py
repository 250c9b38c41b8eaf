"""The files of the repository: layout, versions, continuous integration."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import robocov as rc

ROOT = Path(__file__).parents[1]
TOP_LEVEL = ("pyproject.toml", "app", "coverage", "maps", "tests", "README.md", "LICENSE", "CHANGELOG.md")


def test_the_top_level_contains_what_the_readme_describes() -> None:
    assert not [name for name in TOP_LEVEL if not (ROOT / name).exists()]


@pytest.mark.parametrize("folder", ["coverage", "app"])
def test_a_source_folder_is_not_a_package(folder: str) -> None:
    # An import package called `coverage` would overwrite coverage.py in the user's environment.
    assert not (ROOT / folder / "__init__.py").exists()


def test_tests_of_the_library_are_in_the_folders_of_its_packages() -> None:
    tested_packages = {path.parent.name for path in (ROOT / "tests/robocov").glob("*/test_*.py")}
    packages = {path.parent.name for path in (ROOT / "coverage/robocov").glob("*/__init__.py")}
    modules = {path.stem for path in (ROOT / "coverage/robocov").glob("*.py")}
    assert packages <= tested_packages <= packages | modules


def test_test_files_outside_these_folders_belong_to_single_modules() -> None:
    modules = {path.stem for path in (ROOT / "coverage/robocov").glob("*.py")}
    subjects = {path.stem.removeprefix("test_") for path in (ROOT / "tests/robocov").glob("test_*.py")}
    assert subjects - modules == {"errata", "public_names"}


def test_the_version_is_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == rc.__version__
    assert f"## {rc.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_ci_runs_the_test_command_of_the_readme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    (command,) = [line for line in script.splitlines() if line.startswith("python3 -m venv")]
    assert command in readme.splitlines()


def test_ci_then_runs_all_slow_tests_and_more_examples_of_the_domain() -> None:
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    examples = '-m "hypothesis and not slow" --hypothesis-profile=thorough tests/robocov'
    for selection in ("-m slow -n $(($(nproc) + 1))", examples):
        assert f"\n.venv-test/bin/python -m pytest {selection}\n" in script


def test_paths_in_the_ci_script_exist() -> None:
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    paths = re.findall(r"\btests/[\w/.]+", script)
    assert len(paths) > 2
    assert not [path for path in paths if not (ROOT / path).exists()]
