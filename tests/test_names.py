"""Names mentioned in the documentation exist: modules and attributes in pages, docstrings and assets."""

from __future__ import annotations

import ast
import builtins
import doctest
import importlib
import inspect
import keyword
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import tyro  # noqa: F401 - its import hashes all built-in values, and doctests leave arrays in `_`

import robocov as rc
from robocov.controllers import get_gains
from robocov_app import learning
from robocov_app.cli import COMMANDS
from robocov_app.figures import files

ROOT = Path(__file__).parents[1]
ROOTS = (ROOT / "coverage", ROOT / "app")
PACKAGE_FOLDERS = (ROOT / "coverage/robocov", ROOT / "app/robocov_app")
DOCUMENT_SUFFIXES = {".py", ".pyi", ".md", ".js", ".css", ".html", ".toml"}
LOGGERS = {"robocov.web"}
"""Names of loggers look like those of modules."""
USERS_FILE = "mine.py"
"""File of a user in many examples."""

DOTTED_NAME = re.compile(r"(?<![\w./-])robocov(?:_app)?(?:\.[A-Za-z_]\w*)+")
NAME_IN_BACKTICKS = re.compile(r"(?<!`)`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)`(?!`)")
MODULE_PATH = re.compile(r"(?<![\w./-])((?:[\w-]+/)+\w+\.(?:py|js))\b")
SPLIT_KEYS = re.compile(r"\b(?:Ctrl|Shift|Alt)[ -](?:[A-Z←→↑↓](?!\w)|Shift\b|Delete\b|Enter\b)")
SECTION = re.compile(r"^([A-Z][A-Za-z ]+)\n-{3,}$", re.M)

PUBLIC = {
    **{f"robocov.{name}": getattr(rc, name) for name in rc.__all__},
    **{f"robocov_app.learning.{name}": getattr(learning, name) for name in learning.__all__},
    "robocov_app.figures.files.save_figure": files.save_figure,
    "robocov_app.figures.files.render_png": files.render_png,
}
DOCUMENTED = {name: value for name, value in PUBLIC.items() if callable(value)}


def list_documents() -> Iterator[Path]:
    yield from (ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "pyproject.toml", ROOT / ".ci/run")
    for folder in (*ROOTS, ROOT / ".readme"):
        for file in folder.rglob("*"):
            if file.suffix in DOCUMENT_SUFFIXES and "reference" not in file.parts:
                yield file


@cache
def resolves(name: str) -> bool:
    """Whether a dotted name is that of a module, or of an attribute in a module."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            value: Any = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[count:]:
            if attribute in getattr(value, "__annotations__", {}):
                return True
            if not hasattr(value, attribute):
                return False
            value = getattr(value, attribute)
        return True
    return False


def test_dotted_names_in_documents_are_those_of_modules_and_attributes() -> None:
    unknown = []
    for file in list_documents():
        for number, line in enumerate(file.read_text().splitlines(), 1):
            names = [name for name in DOTTED_NAME.findall(line) if name not in LOGGERS]
            unknown += [f"{file.relative_to(ROOT)}:{number}: {name}" for name in names if not resolves(name)]
    assert not unknown, "\n".join(unknown)


def test_keys_in_documents_are_joined_by_plus_signs() -> None:
    """One spelling everywhere, as in Ctrl+Z."""
    found = []
    for file in list_documents():
        for number, line in enumerate(file.read_text().splitlines(), 1):
            found += [f"{file.relative_to(ROOT)}:{number}: {keys}" for keys in SPLIT_KEYS.findall(line)]
    assert not found, "\n".join(found)


def list_identifiers(tree: ast.Module) -> Iterator[str]:
    """Yield every name that a module defines, assigns, imports or uses, and its short strings."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.alias):
            yield from (node.asname or node.name).split(".")
        elif isinstance(node, ast.keyword) and node.arg:
            yield node.arg
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
            yield node.value


def test_names_in_backticks_in_docstrings_are_names_of_the_program() -> None:
    trees = {}
    for root in ROOTS:
        for file in root.rglob("*.py"):
            trees[file] = ast.parse(file.read_text())
    known = {*dir(builtins), *keyword.kwlist, "robocov", "robocov_app"}
    for file, tree in trees.items():
        known.update(list_identifiers(tree), (file.stem, file.parent.name))
    unknown = []
    for file, tree in trees.items():
        for node in ast.walk(tree):
            if not isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
                continue
            names = NAME_IN_BACKTICKS.findall(ast.get_docstring(node) or "")
            names = [name for name in names if not known.issuperset(name.split("."))]
            unknown += [f"{file.relative_to(ROOT)}: `{name}`" for name in names if not resolves(name)]
    assert not unknown, "\n".join(unknown)


def test_paths_of_modules_in_documents_exist() -> None:
    unknown = []
    for file in list_documents():
        folders = (ROOT, *ROOTS, *PACKAGE_FOLDERS, *file.parents)
        paths = [path for path in MODULE_PATH.findall(file.read_text()) if Path(path).name != USERS_FILE]
        missing = [path for path in paths if not any((folder / path).exists() for folder in folders)]
        unknown += [f"{file.relative_to(ROOT)}: {path}" for path in missing]
    assert not unknown, "\n".join(unknown)


# Docstrings of public names


def list_sections(value: Any) -> set[str]:
    return set(SECTION.findall(inspect.cleandoc(value.__doc__ or "")))


def list_parameters(value: Any) -> list[str]:
    return [name for name in inspect.signature(value).parameters if name not in ("self", "cls")]


@pytest.mark.parametrize("name", DOCUMENTED)
def test_docstrings_of_public_names_are_complete(name: str) -> None:
    value = DOCUMENTED[name]
    sections = list_sections(value)
    text = inspect.cleandoc(value.__doc__)
    assert {"See Also", "Examples"} <= sections
    assert ">>> " in text.partition("Examples\n-----")[2]
    is_interface = inspect.isabstract(value) or getattr(value, "_is_protocol", False)
    is_error = isinstance(value, type) and issubclass(value, Exception)
    if not is_interface and not is_error:
        for parameter in list_parameters(value):
            is_described = re.search(rf"^(?:\**\w+, )*\**{parameter}(?:, \**\w+)*(?: :.*)?$", text, re.M)
            assert is_described or parameter.startswith("_"), f"{parameter} is not described"
    if not isinstance(value, type) and inspect.signature(value).return_annotation not in (None, "None"):
        assert "Returns" in sections


@pytest.mark.parametrize("name", DOCUMENTED)
def test_examples_of_public_names_import_what_they_use(name: str) -> None:
    """Doctests see all names of their module, but readers copy examples into a session of their own."""
    examples = doctest.DocTestParser().get_examples(DOCUMENTED[name].__doc__ or "")
    tree = ast.parse("".join(example.source for example in examples))
    known = set(dir(builtins))
    used = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            used.add(node.id)
        elif isinstance(node, ast.Name):
            known.add(node.id)
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            known.add(node.name)
        elif isinstance(node, ast.arg):
            known.add(node.arg)
        elif isinstance(node, ast.alias):
            known.add(node.asname or node.name.partition(".")[0])
        elif isinstance(node, ast.ExceptHandler) and node.name:
            known.add(node.name)
    assert used <= known


@pytest.mark.parametrize("name", [name for name, value in PUBLIC.items() if isinstance(value, type)])
def test_public_methods_say_what_they_take_and_return(name: str) -> None:
    incomplete = []
    kind = PUBLIC[name]
    for attribute, member in inspect.getmembers_static(kind):
        if attribute.startswith("_"):
            continue
        owner = next(base for base in kind.__mro__ if attribute in vars(base))
        if not owner.__module__.startswith("robocov"):
            continue
        if isinstance(member, (classmethod, staticmethod)):
            member = member.__func__
        if inspect.isfunction(member):
            sections = list_sections(member)
            has_value = inspect.signature(member).return_annotation not in (None, "None")
            takes = bool(list_parameters(member))
            if takes and "Parameters" not in sections:
                incomplete.append(f"{attribute}: Parameters")
            if takes and has_value and not sections & {"Returns", "Yields"}:
                incomplete.append(f"{attribute}: Returns")
        if (callable(member) or isinstance(member, property)) and not member.__doc__:
            incomplete.append(f"{attribute}: summary")
    assert not incomplete


def test_docstrings_of_further_names_in_the_reference_are_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(ROOT / "app/handbook")
    incomplete = []
    for names in importlib.import_module("reference").OTHER_NAMES.values():
        for name in names:
            module, _, attribute = name.rpartition(".")
            value = getattr(importlib.import_module(module), attribute)
            sections = list_sections(value)
            if "See Also" not in sections:
                incomplete.append(f"{name}: See Also")
            if not sections & {"Parameters", "Attributes"} and not inspect.isabstract(value):
                incomplete.append(f"{name}: Parameters or Attributes")
            if inspect.isfunction(value):
                has_value = inspect.signature(value).return_annotation not in (None, "None")
                if has_value and "Returns" not in sections:
                    incomplete.append(f"{name}: Returns")
    assert not incomplete


@pytest.mark.parametrize("name", DOCUMENTED)
def test_errors_that_public_functions_raise_are_documented(name: str) -> None:
    value = DOCUMENTED[name]
    if not inspect.isfunction(value):
        return
    tree = ast.parse(inspect.getsource(value))
    if any(isinstance(node, ast.Raise) and node.exc is not None for node in ast.walk(tree)):
        assert "Raises" in list_sections(value)


@pytest.mark.parametrize("name", ["Lloyd", "Rapf", "Rpf", "Atlas"])
def test_docstrings_of_controllers_list_their_gains_with_units(name: str) -> None:
    text = inspect.getdoc(getattr(rc, name)) or ""
    for gain in get_gains(getattr(rc, name)).values():
        unit = getattr(gain, "unit", "")
        described = re.search(rf"^{gain.name} : (.*)$", text, re.M)
        assert described
        assert described[1].endswith(f", {unit}" if unit else ("}", "float"))


# Pictures


def test_every_picture_is_drawn_by_a_script_that_the_handbook_names() -> None:
    page = (ROOT / "app/handbook/contributing.md").read_text()
    _, _, section = page.partition("## Images and the video")
    section = section.partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w.-]+)` \| `(.+)` \|$", section, re.M))
    pictures = {
        file.name.replace("-dark", "")
        for folder in (ROOT / "app/handbook/pictures", ROOT / ".readme")
        for file in folder.iterdir()
        if file.suffix in (".png", ".svg", ".gif", ".mp4", ".webp")
    }
    assert rows.keys() == pictures
    for command in rows.values():
        program, word, *_ = command.split()
        assert (program == "robocov" and word in COMMANDS) or (ROOT / word).is_file(), command
