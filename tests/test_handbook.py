"""The handbook names everything that the program has, and is built without a warning."""

from __future__ import annotations

import re
import tomllib
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import robocov as rc
from robocov.controllers import CONTROLLERS
from robocov_app import learning
from robocov_app.cli import COMMANDS, main
from robocov_app.commands.handbook import find_page_sources

ROOT = Path(__file__).parents[1]
ROOTS = ROOT / "app/robocov_app", ROOT / "coverage/robocov"
PAGES = {page.name: page.read_text() for page in find_page_sources().glob("*.md")}
WITH_SPHINX = all(find_spec(name) for name in ("sphinx", "furo", "myst_parser"))


class Links(HTMLParser):
    """Targets of links and pictures, and the places in a page that links may name."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.to: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if value and key in ("href", "src"):
                self.to.append(value)
            elif value and key == "id":
                self.places.add(value)


def test_every_page_is_in_the_contents_once() -> None:
    listed = re.findall(
        r"^([\w-]+)$", "\n".join(re.findall(r"```{toctree}(.*?)```", PAGES["index.md"], re.S)), re.M
    )
    assert sorted(f"{name}.md" for name in listed) == sorted(PAGES.keys() - {"index.md"})


def test_every_public_name_is_in_use_on_a_page() -> None:
    used = set(re.findall(r"\brc\.(\w+)", PAGES["names-in-use.md"]))
    assert used == {*rc.__all__}


def test_the_architecture_page_names_every_package_and_only_existing_modules() -> None:
    page = PAGES["architecture.md"]
    names = set(re.findall(r"`(\w+)`", page))
    for root in ROOTS:
        modules = {
            path.stem for path in root.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()
        }
        public_modules = {module for module in modules if not module.startswith("_")}
        assert public_modules <= names
    for path in re.findall(r"`([\w/]+\.py)`", page):
        candidates = [ROOT / path, *(root / path for root in ROOTS)]
        assert any(candidate.is_file() for candidate in candidates), path


def test_every_extra_and_every_environment_variable_is_explained() -> None:
    source = "".join(path.read_text() for root in ROOTS for path in root.rglob("*.py"))
    for variable in re.findall(r'"(ROBOCOV_[A-Z]+)"', source):
        assert f"`{variable}`" in PAGES["install.md"]
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert not [name for name in extras.keys() - {"all", "test"} if f"`{name}`" not in PAGES["install.md"]]


def test_without_sphinx_it_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["handbook", "--out", str(tmp_path / "site")]) == 2
    assert 'pip install "robocov[docs]"' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_folder_with_something_in_it_stays_as_it_is(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["handbook", "--out", str(tmp_path)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.slow
@pytest.mark.skipif(not WITH_SPHINX, reason="needs robocov[docs]")
def test_it_is_built_without_a_warning_and_its_links_lead_somewhere(tmp_path: Path) -> None:
    site = tmp_path / "site"
    assert main(["handbook", "--out", str(site)]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["site"]
    found = {file.resolve(): Links(file.read_text()) for file in site.rglob("*.html")}
    for file, links in found.items():
        for link in links.to:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file.name}: {link}"
            if parts.fragment and target in found:
                assert unquote(parts.fragment) in found[target].places, f"{file.name}: {link}"
    reference = {file.stem: file.read_text() for file in (site / "reference").glob("*.html")}
    assert all(f"robocov {name}" in reference["commands"] for name in COMMANDS)
    assert all(f'id="{name}"' in reference["gains"] for name in CONTROLLERS)
    assert all(f'.{name}"' in reference["names"] for name in rc.__all__)
    assert all(f'id="robocov_app.learning.{name}"' in reference["learning"] for name in learning.__all__)
    assert "Play or pause" in reference["keys"] and "Undo" in reference["keys"]
    assert 'id="robocov.typing.FloatArray"' in reference["other-names"]
    for name in ("names", "other-names", "learning"):
        assert '<span class="pre">ndarray' not in reference[name]


def test_nothing_in_a_terminal_is_answered_in_five_lines(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert main([]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5 and all(line.startswith("robocov ") for line in lines)


def test_a_run_without_pictures_has_its_numbers(tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert (
        main(["run", "square", "--duration", "0.2", "--no-figures", "--lattice", "16", "--out", str(out)])
        == 0
    )
    assert {file.name for file in out.iterdir()} == {".robocov.json", "run.json", "record.npz", "cost.csv"}
