"""Optional packages: imports, and messages if they are missing."""

from __future__ import annotations

import sys

import pytest

from robocov.errors import RobocovError
from robocov.optional_imports import import_optional


def test_an_installed_module_is_returned() -> None:
    assert import_optional("json", "any") is sys.modules["json"]


def test_a_missing_module_is_reported_with_the_command_to_install_it() -> None:
    with pytest.raises(RobocovError) as caught:
        import_optional("no_such_module", "frames")
    assert str(caught.value) == 'no_such_module is not installed: pip install "robocov[frames]"'


def test_a_missing_dependency_of_a_package_is_not_reported_as_the_package(tmp_path, monkeypatch) -> None:
    (tmp_path / "incomplete.py").write_text("import missing_dependency\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="missing_dependency"):
        import_optional("incomplete", "frames")
