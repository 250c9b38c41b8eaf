"""The rules of the house: layout, types, style, imports."""

from __future__ import annotations

import ast
import importlib
import pickle
import re
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
MAX_METHODS = 25
"""Maximum number of methods of a class; one with more has parts that are objects of their own."""


def assert_passes(*command: str, cwd: Path = ROOT) -> None:
    done = subprocess.run([sys.executable, *command], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"


def test_ruff_finds_nothing() -> None:
    assert_passes("-m", "ruff", "check", ".")


def test_the_format_is_ruffs() -> None:
    assert_passes("-m", "ruff", "format", "--check", ".")


@pytest.mark.slow
def test_types_are_strict() -> None:
    assert_passes("-m", "mypy")


def test_imports_go_down_only() -> None:
    call = "from importlinter.cli import lint_imports_command as lint; lint([])"
    assert_passes("-c", call)


def test_no_two_modules_need_each_other_not_even_for_types() -> None:
    graph = grimp.build_graph("robocov", "robocov_app")
    TopologicalSorter(
        {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    ).prepare()


def test_no_class_has_too_many_methods() -> None:
    too_large = []
    for path in (*ROOT.glob("coverage/robocov/**/*.py"), *ROOT.glob("app/robocov_app/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.ClassDef):
                continue
            method_count = sum(isinstance(member, ast.FunctionDef) for member in node.body)
            if method_count > MAX_METHODS:
                too_large.append(f"{path.relative_to(ROOT)}: {node.name}: {method_count} methods")
    assert not too_large


def test_percent_signs_follow_their_numbers_without_a_space() -> None:
    # "95%" as in the output of Python's format "%", not "95 %". A brace after the sign ends a Jinja tag.
    spaced = re.compile(r"[0-9}][ \u00a0\u202f\u2009]%(?!})")
    paths = [ROOT / "README.md", ROOT / "CHANGELOG.md", *ROOT.glob("app/handbook/*.md")]
    for root in ("coverage", "app"):
        paths += [path for suffix in (".py", ".jinja", ".toml") for path in ROOT.glob(f"{root}/**/*{suffix}")]
    found = []
    for path in paths:
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1):
            if spaced.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
    assert not found


@pytest.mark.parametrize("root", ["coverage", "app"])
def test_a_source_root_is_not_a_package(root: str) -> None:
    """An import package called `coverage` would overwrite coverage.py in the user's environment."""
    assert not (ROOT / root / "__init__.py").exists()


def test_top_level() -> None:
    for name in (
        "pyproject.toml",
        "app",
        "coverage",
        "maps",
        "tests",
        "README.md",
        "LICENSE",
        "CHANGELOG.md",
    ):
        assert (ROOT / name).exists()


def test_the_tests_of_the_library_stand_in_the_folders_of_its_packages() -> None:
    tested = {path.parent.name for path in (ROOT / "tests/robocov").glob("*/test_*.py")}
    packages = {path.parent.name for path in (ROOT / "coverage/robocov").glob("*/__init__.py")}
    flat = {path.stem for path in (ROOT / "coverage/robocov").glob("*.py")}
    assert packages <= tested <= packages | flat
    loose = {path.stem.removeprefix("test_") for path in (ROOT / "tests/robocov").glob("test_*.py")}
    assert loose - flat == {"errata"}, "tests beside the packages that belong into them"


def test_the_version_is_said_once_in_each_place() -> None:
    import robocov

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == robocov.__version__
    assert f"## {robocov.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_every_public_name_loads_from_the_module_that_the_stub_says() -> None:
    import robocov

    stub = ast.parse((ROOT / "coverage/robocov/__init__.pyi").read_text())
    imports = [node for node in ast.walk(stub) if isinstance(node, ast.ImportFrom)]
    stub_names = [alias.asname for node in imports for alias in node.names]
    assert sorted(map(str, stub_names)) == robocov.__all__
    for node in imports:
        module = importlib.import_module(f"robocov.{node.module}")
        for alias in node.names:
            assert getattr(robocov, alias.name) is getattr(module, alias.name)


def test_public_names_can_be_listed_and_star_imported_and_misspelled() -> None:
    import robocov

    assert {*robocov.__all__, "__version__"} <= {*dir(robocov)}
    namespace: dict[str, object] = {}
    exec("from robocov import *", namespace)
    assert {*robocov.__all__} <= {*namespace}
    modules = {path.stem for path in (ROOT / "coverage/robocov").iterdir()}
    assert not modules & set(robocov.__all__), "once imported, a module would hide the name"
    with pytest.raises(AttributeError, match="module 'robocov' has no attribute 'nothing'"):
        robocov.nothing


def test_public_classes_can_be_pickled_by_reference() -> None:
    import robocov

    for name in robocov.__all__:
        value = getattr(robocov, name)
        if isinstance(value, type):
            assert pickle.loads(pickle.dumps(value)) is value


def list_loaded_modules(statement: str) -> set[str]:
    script = f"import sys\n{statement}\nprint(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_loads_neither_pygame_nor_matplotlib() -> None:
    loaded = list_loaded_modules("import robocov")
    assert not loaded & {"pygame", "matplotlib", "scipy", "shapely", "pydantic"}
    everything = list_loaded_modules("import robocov\nfor name in robocov.__all__: getattr(robocov, name)")
    assert not everything & {"pygame", "matplotlib", "rich", "tyro"}


def test_asking_for_help_loads_nothing_heavy() -> None:
    loaded = list_loaded_modules("from robocov_app.cli import main\nmain(['--help'])")
    heavy = {"numpy", "scipy", "shapely", "pydantic", "pygame", "matplotlib", "pymunk", "tyro", "rich"}
    assert not loaded & heavy


def test_ci_runs_the_readmes_test_command_and_then_what_is_slow() -> None:
    readme = (ROOT / "README.md").read_text()
    script = (ROOT / ".ci/run").read_text().splitlines()
    *others, command, slow, interpreted, paper = [
        line for line in script if line and not line.startswith("#")
    ]
    assert command in readme.splitlines()
    thorough = '-m "slow or hypothesis" --hypothesis-profile=thorough'
    assert slow == f".venv-test/bin/python -m pytest {thorough}"
    assert interpreted.startswith("NUMBA_DISABLE_JIT=1 .venv-test/bin/python -m pytest ")
    assert paper.startswith(".venv-test/bin/python -m pytest ")
    named = [word for line in (interpreted, paper) for word in line.split() if word.startswith("tests/")]
    assert len(named) > 2 and all((ROOT / word).exists() for word in named)
    assert others[:3] == ["set -eu", 'cd "$(dirname "$0")/.."', "unset PYTHONDONTWRITEBYTECODE"]
    # what is beside it brings a screen and hands for the tests that can do without, and may fail
    assert all(line.endswith("|| true") for line in others[3:])
