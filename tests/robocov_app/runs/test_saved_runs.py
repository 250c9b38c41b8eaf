"""Names of the folders of saved runs."""

from __future__ import annotations

import pytest

from robocov_app.runs.saved_runs import name_folders


@pytest.mark.parametrize(
    ("controllers", "folders"),
    [
        (["x", "a.py:x", "b.py:x"], ["x", "x-2", "x-3"]),
        (["lloyd", "mine.py:Lloyd"], ["lloyd", "Lloyd-2"]),
        (["x-2", "x", "a.py:X"], ["x-2", "x", "X-3"]),
        (["x", "x-2", "a.py:x", "b.py:x"], ["x", "x-2", "x-3", "x-4"]),
    ],
)
def test_controllers_have_different_folders_even_if_case_is_ignored(
    controllers: list[str], folders: list[str]
) -> None:
    assert name_folders(controllers) == folders
