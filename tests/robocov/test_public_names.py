"""The public names of `robocov`, which are loaded when they are first used."""

from __future__ import annotations

import ast
import importlib
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import robocov as rc

PACKAGE = Path(__file__).parents[2] / "coverage/robocov"


def test_every_public_name_is_loaded_from_the_module_in_the_stub() -> None:
    stub = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(stub) if isinstance(node, ast.ImportFrom)]
    stub_names = [str(alias.asname) for node in imports for alias in node.names]
    assert sorted(stub_names) == rc.__all__
    for node in imports:
        module = importlib.import_module(f"robocov.{node.module}")
        for alias in node.names:
            assert getattr(rc, alias.name) is getattr(module, alias.name)


def test_dir_lists_the_public_names() -> None:
    assert {*rc.__all__, "__version__"} <= set(dir(rc))


def test_a_star_import_imports_the_public_names() -> None:
    namespace: dict[str, object] = {}
    exec("from robocov import *", namespace)
    assert set(rc.__all__) <= namespace.keys()


def test_no_module_hides_a_public_name() -> None:
    # After its import, a module of the package is an attribute of the package.
    assert not {path.stem for path in PACKAGE.iterdir()} & set(rc.__all__)


def test_an_unknown_name_raises_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'robocov' has no attribute 'nothing'"):
        rc.nothing  # type: ignore[attr-defined]


def test_public_classes_can_be_pickled_by_reference() -> None:
    for name in rc.__all__:
        value = getattr(rc, name)
        if isinstance(value, type):
            assert pickle.loads(pickle.dumps(value)) is value


def list_loaded_modules(code: str) -> set[str]:
    """Return the modules that a new process has loaded after running some code."""
    script = f"import sys\n{code}\nprint(' '.join(sys.modules))"
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(process.stdout.split())


def test_importing_the_package_loads_no_large_library() -> None:
    loaded_modules = list_loaded_modules("import robocov")
    assert not loaded_modules & {"pygame", "matplotlib", "scipy", "shapely", "pydantic"}


def test_the_library_does_not_need_libraries_of_the_application() -> None:
    loaded_modules = list_loaded_modules(
        "import robocov\nfor name in robocov.__all__: getattr(robocov, name)"
    )
    assert not loaded_modules & {"pygame", "matplotlib", "rich", "tyro"}


def test_the_overview_of_commands_loads_no_large_library() -> None:
    loaded_modules = list_loaded_modules("from robocov_app.cli import main\nmain(['--help'])")
    large_libraries = {"numpy", "scipy", "shapely", "pydantic", "pygame", "matplotlib", "pymunk"}
    assert not loaded_modules & {*large_libraries, "tyro", "rich"}
