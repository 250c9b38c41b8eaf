"""Source text of controllers in files of the user, read without running it."""

from pathlib import Path

import pytest

from robocov.errors import ParameterError
from robocov_app.sweep.study.controller_files import read_controller_source


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("import numpy\ndef decide(:\n", ":2", "invalid syntax"),
        ("x = 1\n  y = 2\n", ":2", "unexpected indent"),
    ],
)
def test_a_syntax_error_is_reported_with_its_line(text: str, place: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(ParameterError) as caught:
        read_controller_source("mine.py:Mine", tmp_path)
    assert str(caught.value) == f"'mine.py:Mine': {path}{place}: not Python code: {reason}"


def test_a_link_to_itself_is_reported(tmp_path: Path) -> None:
    (tmp_path / "mine.py").symlink_to("mine.py")
    with pytest.raises(
        ParameterError, match=r"^'mine\.py:Mine': .*mine\.py: .*(Symlink loop|symbolic links)"
    ):
        read_controller_source("mine.py:Mine", tmp_path)


def test_a_path_that_no_file_can_have_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"embedded null byte$"):
        read_controller_source("mi\0ne.py:Mine", tmp_path)
