"""The command `robocov handbook --out` and its errors.

Building takes half a minute. The tests in `test_package.py` build the pages once, for a wheel, and check
them there.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest
from built_pages import HAS_SPHINX

from robocov_app.cli import main
from robocov_app.commands import handbook


@pytest.mark.skipif(not HAS_SPHINX, reason="needs robocov[docs]")
def test_lines_do_not_break_before_a_unit_or_within_a_range(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(handbook.find_page_sources())
    text = import_module("typography").prevent_breaks(
        "5 cm within 4 s, at 1 m/s; 3 maps, 2 to 4 more, up to 9"
    )
    assert (
        text.replace("\N{NO-BREAK SPACE}", "~") == "5~cm within 4~s, at 1~m/s; 3 maps, 2~to~4 more, up to 9"
    )


def test_without_sphinx_the_error_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["handbook", "--out", str(tmp_path / "site")]) == 2
    assert 'pip install "robocov[docs]"' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_folder_with_other_files_is_not_changed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["handbook", "--out", str(tmp_path)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["mine.txt"]


def write_page(scratch: Path) -> Path:
    """Write a page in place of Sphinx; return its folder."""
    pages = scratch / "pages"
    pages.mkdir()
    (pages / "index.html").write_text("the page")
    return pages


def test_no_temporary_files_remain(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(handbook, "_REQUIRED_MODULES", ())
    monkeypatch.setattr(handbook, "_run_sphinx", write_page)
    assert main(["handbook", "--out", str(tmp_path / "site")]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["site"]
    assert [file.name for file in (tmp_path / "site").iterdir()] == ["index.html"]


def test_the_current_folder_can_be_written_to(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(handbook, "_REQUIRED_MODULES", ())
    monkeypatch.setattr(handbook, "_run_sphinx", write_page)
    monkeypatch.chdir(tmp_path)
    assert main(["handbook", "--out", "."]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["index.html"]


def test_bundled_pages_that_cannot_be_written_are_reported(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(handbook, "_BUNDLED_PAGES", write_page(tmp_path))
    site = tmp_path / "pages" / "index.html" / "site"
    assert main(["handbook", "--out", str(site)]) == 2
    assert f"{site}: cannot be written: " in capsys.readouterr().err
