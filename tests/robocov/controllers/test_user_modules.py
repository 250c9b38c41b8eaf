"""Modules that a user's controller imports: finding them, and importing them from their texts."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from robocov.controllers import load_controller_class
from robocov.controllers.user_modules import (
    ControllerSource,
    ModuleText,
    find_own_modules,
    is_own_module,
    provide_modules,
)

CONTROLLER = """
from dataclasses import dataclass
import json, numpy, robocov, builtins, nothing_of_that_name
import tree_a.branch
from tree_a import leaf, NAME
from tree_a.inner import *

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        import late_one
        return own.position * 0
"""

FILES = {
    "tree_a/__init__.py": "NAME = 1\n",
    "tree_a/branch.py": "from . import twig\nfrom .inner.core import deep\n",
    "tree_a/leaf.py": "from .. import outside\n",
    "tree_a/twig.py": "",
    "tree_a/unused.py": "",
    "tree_a/inner/__init__.py": "from tree_a.inner.core import deep\n",
    "tree_a/inner/core.py": "import plain_b.part\ndeep = 1\n",
    "plain_b/part.py": "import plain_b.nested.deep  # no __init__.py in either folder\n",
    "plain_b/nested/deep.py": "",
    "late_one.py": "import unreadable_one\n",
    "unreadable_one.py": "this is no Python\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    loaded_before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - loaded_before:
        del sys.modules[name]


def test_all_modules_of_the_author_are_found_without_running_them(folder: Path) -> None:
    modules = find_own_modules(CONTROLLER)
    assert list(modules) == [
        *("late_one", "plain_b", "plain_b.nested", "plain_b.nested.deep", "plain_b.part"),
        *("tree_a", "tree_a.branch", "tree_a.inner", "tree_a.inner.core", "tree_a.leaf", "tree_a.twig"),
        "unreadable_one",
    ]
    assert modules["tree_a.leaf"] == ModuleText(str(folder / "tree_a" / "leaf.py"), FILES["tree_a/leaf.py"])
    assert modules["plain_b"] == ModuleText("", "")
    assert "tree_a" not in sys.modules
    assert pickle.loads(pickle.dumps(ControllerSource("mine.py", CONTROLLER, modules))).modules == modules


def test_a_controller_imports_modules_next_to_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "helper_d.py").write_text("SCALE = 2.0\n")
    (tmp_path / "numpy.py").write_text("raise RuntimeError('an installed package was replaced')\n")
    text = (
        "from dataclasses import dataclass\nimport numpy\nfrom helper_d import SCALE\n"
        "@dataclass(frozen=True)\nclass Mine:\n    def force(self, own): return SCALE * own.position\n"
    )
    (tmp_path / "mine.py").write_text(text)
    controller_class = load_controller_class(f"{tmp_path}/mine.py:Mine")
    assert vars(sys.modules[controller_class.__module__])["SCALE"] == 2.0
    assert list(find_own_modules(text)) == ["helper_d"]


def test_installed_packages_are_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "site-packages").mkdir()
    (folder / "site-packages" / "installed_c.py").touch()
    monkeypatch.syspath_prepend(str(folder / "site-packages"))
    assert find_own_modules("import installed_c") == {}


def test_a_submodule_may_be_named_robocov(folder: Path) -> None:
    (folder / "tree_a" / "robocov.py").touch()
    assert list(find_own_modules("import robocov.errors, tree_a.robocov")) == ["tree_a", "tree_a.robocov"]


def test_a_file_with_the_name_of_a_built_in_module_is_not_stored(folder: Path) -> None:
    (folder / "time.py").touch()
    assert find_own_modules("import time") == {}
    assert not is_own_module("time")


def test_modules_are_imported_from_their_texts_and_leave_no_trace(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "tree_a" / "leaf.py").write_text("# -*- coding: latin-1 -*-\nword = 'ü'\n", "latin-1")
    text = (
        "import late_two\nfrom tree_a import leaf\nimport plain_b.part, tree_a.branch\n"
        + CONTROLLER.replace(
            "import json, numpy, robocov, builtins, nothing_of_that_name",
            "word, TWO = leaf.word, late_two.TWO",
        )
    )
    (folder / "late_two.py").write_text("TWO = 2\n")
    source = ControllerSource("/nowhere/mine.py", text, find_own_modules(text))
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path != str(folder)])
    import types

    monkeypatch.setitem(sys.modules, "late_two", others := types.ModuleType("late_two"))
    with provide_modules(source.modules):
        module = sys.modules[load_controller_class("mine.py:Mine", source=source).__module__]
        assert (module.word, module.TWO) == ("ü", 2)
        import tree_a.leaf

        assert module.leaf is tree_a.leaf, "loaded once"
    assert sys.modules["late_two"] is others
    assert not {"tree_a", "tree_a.leaf", "plain_b"} & set(sys.modules)
