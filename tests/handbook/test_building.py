"""The command `robocov handbook` builds pages whose links lead somewhere."""

from __future__ import annotations

from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import robocov as rc
from robocov.controllers import CONTROLLERS
from robocov_app import learning
from robocov_app.cli import COMMANDS, main

HAS_SPHINX = all(find_spec(name) for name in ("sphinx", "furo", "myst_parser"))


class PageLinks(HTMLParser):
    """The links in a page, and the places that links to the page may name.

    Attributes
    ----------
    targets : list of str
        Targets of links, and files of pictures.
    identifiers : set of str
        Values of ``id``.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.identifiers: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value and name in ("href", "src"):
                self.targets.append(value)
            elif value and name == "id":
                self.identifiers.add(value)


def check_links(site: Path) -> None:
    """Check that all links within a site lead to a file, and to a place in it."""
    pages = {file.resolve(): PageLinks(file.read_text(encoding="utf-8")) for file in site.rglob("*.html")}
    for file, links in pages.items():
        for link in links.targets:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file.name}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].identifiers, f"{file.name}: {link}"


@pytest.mark.slow
@pytest.mark.skipif(not HAS_SPHINX, reason="needs robocov[docs]")
def test_the_handbook_is_built_with_valid_links_and_a_complete_reference(tmp_path: Path) -> None:
    site = tmp_path / "site"
    # Warnings of Sphinx are errors.
    assert main(["handbook", "--out", str(site)]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["site"], "no temporary files remain"
    check_links(site)
    reference = {file.stem: file.read_text() for file in (site / "reference").glob("*.html")}
    assert all(f"robocov {name}" in reference["commands"] for name in COMMANDS)
    assert all(f'id="{name}"' in reference["gains"] for name in CONTROLLERS)
    assert all(f'.{name}"' in reference["names"] for name in rc.__all__)
    assert all(f'id="robocov_app.learning.{name}"' in reference["learning"] for name in learning.__all__)
    assert "Play or pause" in reference["keys"]
    assert "Undo" in reference["keys"]
    assert 'id="robocov.typing.FloatArray"' in reference["other-names"]
    for page in ("names", "other-names", "learning"):
        # Signatures show the names of array types, not what they stand for.
        assert '<span class="pre">ndarray' not in reference[page]


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
