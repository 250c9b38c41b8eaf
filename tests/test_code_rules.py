"""Rules for the code that tools or short scripts can check: style, types, imports, sizes, spelling."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
MAX_METHODS = 25
"""Maximum number of methods of a class. One with more has parts that should be classes of their own."""


def assert_succeeds(*arguments: str) -> None:
    """Check that Python succeeds with these arguments in the root folder."""
    process = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, f"{' '.join(arguments)}\n{process.stdout}\n{process.stderr}"


def test_ruff_finds_nothing() -> None:
    assert_succeeds("-m", "ruff", "check", ".")


def test_the_code_is_formatted_by_ruff() -> None:
    assert_succeeds("-m", "ruff", "format", "--check", ".")


@pytest.mark.slow
def test_mypy_finds_nothing() -> None:
    assert_succeeds("-m", "mypy")
    # The scripts that draw the images of README and handbook, which no other test runs.
    assert_succeeds("-m", "mypy", *map(str, sorted(ROOT.glob(".readme/*.py"))))


def test_imports_follow_the_layers_in_pyproject() -> None:
    assert_succeeds("-c", "from importlinter.cli import lint_imports_command as lint; lint([])")


def test_modules_do_not_import_each_other_in_a_circle_not_even_for_types() -> None:
    graph = grimp.build_graph("robocov", "robocov_app")
    imported_modules = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    # This raises an error if there is a circle.
    TopologicalSorter(imported_modules).prepare()


def test_no_class_has_too_many_methods() -> None:
    large_classes = []
    for path in (*ROOT.glob("coverage/robocov/**/*.py"), *ROOT.glob("app/robocov_app/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ClassDef):
                continue
            method_count = sum(isinstance(member, ast.FunctionDef) for member in node.body)
            if method_count > MAX_METHODS:
                large_classes.append(f"{path.relative_to(ROOT)}: {node.name}: {method_count} methods")
    assert not large_classes


def test_percent_signs_follow_their_numbers_without_a_space() -> None:
    # "95%", as in the output of Python's format "%", not "95 %". A brace after the sign ends a Jinja tag.
    percentage_with_space = re.compile(r"[0-9}][ \u00a0\u202f\u2009]%(?!})")
    paths = [ROOT / "README.md", ROOT / "CHANGELOG.md", *ROOT.glob("app/handbook/*.md")]
    for folder in ("coverage", "app"):
        for suffix in (".py", ".jinja", ".toml"):
            paths += ROOT.glob(f"{folder}/**/*{suffix}")
    wrong_lines = []
    for path in paths:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if percentage_with_space.search(line):
                wrong_lines.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
    assert not wrong_lines
