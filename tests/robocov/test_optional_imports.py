from __future__ import annotations

import sys

import pytest

from robocov.errors import RobocovError
from robocov.optional_imports import import_optional


def test_a_module_that_is_there() -> None:
    assert import_optional("json", "any") is sys.modules["json"]


def test_one_that_is_not_says_how_it_is_had() -> None:
    with pytest.raises(RobocovError) as caught:
        import_optional("no_such_module", "frames")
    assert str(caught.value) == 'no_such_module is not installed: pip install "robocov[frames]"'


def test_a_missing_dependency_of_a_package_is_not_reported_as_the_package(tmp_path, monkeypatch) -> None:
    (tmp_path / "half_there.py").write_text("import nothing_of_that_name\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="nothing_of_that_name"):
        import_optional("half_there", "frames")
