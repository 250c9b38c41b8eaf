"""The wheel, the source archive, the extras, and the description on package indexes."""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

from robocov import __version__
from robocov_app.cli import main
from robocov_app.commands import handbook

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
TEXT = (ROOT / PROJECT["readme"]).read_text()
WITH_SPHINX = all(find_spec(name) for name in ("sphinx", "furo", "myst_parser"))


def test_all_are_the_extras_of_users() -> None:
    (everything,) = EXTRAS["all"]
    assert set(re.findall(r"\w+", everything)) == {"robocov"} | EXTRAS.keys() - {"all", "test", "bench"}


def test_what_is_large_and_not_needed_is_an_extra() -> None:
    hard = " ".join(PROJECT["dependencies"])
    assert not re.findall(r"pyarrow|pandas|sphinx|imageio|distributed|gymnasium", hard)


def test_the_description_names_the_extras_and_links_to_nothing() -> None:
    named = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\|.*?\|", TEXT, re.M))))
    assert named == EXTRAS.keys() - {"all", "test", "bench"}
    assert not re.findall(r"\]\(|<\w+", TEXT), "pictures and pages of the repository are not on an index"


def test_references_name_the_current_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {__version__}\n" in citation
    recipes = (ROOT / "app/handbook/recipes.md").read_text()
    assert f"version = {{{__version__}}}" in recipes
    title = re.search(r'^title: "(.*)"$', citation, re.MULTILINE)
    assert title is not None and f"title   = {{{title[1]}}}" in recipes


def test_a_bundled_handbook_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bundled = tmp_path / "pages"
    opened: list[str] = []
    bundled.mkdir()
    (bundled / "index.html").write_text("the pages")
    monkeypatch.setattr(handbook, "_BUNDLED_PAGES", bundled)
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)  # no Sphinx
    assert main(["handbook"]) == 0
    assert capsys.readouterr().out == f"{bundled / 'index.html'}\n"
    assert opened == [(bundled / "index.html").as_uri()]
    assert main(["handbook", "--out", str(tmp_path / "site")]) == 0
    assert (tmp_path / "site/index.html").read_text() == "the pages"


@pytest.mark.slow
def test_the_source_archive_has_the_tests_and_no_film(tmp_path: Path) -> None:
    (archive,) = SdistBuilder(str(ROOT)).build(directory=str(tmp_path))
    with tarfile.open(archive) as files:
        sizes = {info.name.partition("/")[2]: info.size for info in files.getmembers()}
    assert {"README.md", PROJECT["readme"], "tests/test_package.py", "maps/rooms.json"} <= sizes.keys()
    assert not [name for name in sizes if re.search(r"mp4$|__pycache__|\.nb[ic]$|handbook/reference/", name)]
    assert max(sizes.values()) < 250_000
    assert Path(archive).stat().st_size < 5.5e6


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    (path,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(path)


@pytest.mark.slow
@pytest.mark.xdist_group("wheel")
def test_the_wheel_contains_all_assets_of_pages(wheel: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    assets = {path.name for path in (ROOT / "app/robocov_app/report/assets").iterdir()}
    assert {"report.html.jinja", "report.css", "replay.js"} <= assets
    assert {f"robocov_app/report/assets/{name}" for name in assets} <= packed


@pytest.mark.slow
@pytest.mark.xdist_group("wheel")
@pytest.mark.skipif(not WITH_SPHINX, reason="needs robocov[docs]")
def test_the_wheel_carries_maps_entries_and_a_handbook_that_needs_no_sphinx(
    wheel: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    empty = tmp_path / "empty"
    with zipfile.ZipFile(wheel) as files:
        files.extractall(site)
    assert wheel.stat().st_size < 6e6
    assert {path.name for path in site.iterdir() if "-" not in path.name} == {"robocov", "robocov_app"}
    assert (site / "robocov/__init__.pyi").is_file(), "the list of public names"
    assert (site / "robocov_app/pages/searchindex.js").is_file() and (
        site / "robocov/maps/rooms.json"
    ).is_file()
    pages = [*(site / "robocov_app/pages").rglob("*.html")]
    assert len(pages) > 20 and not [page for page in pages if str(ROOT) in page.read_text()]
    empty.mkdir()
    script = (
        f"import sys; sys.path.insert(0, {str(site)!r}); sys.modules['furo'] = None\n"
        "from robocov_app.cli import main\n"
        "sys.exit(main(['handbook', '--out', 'book']) or main(['benchmark', 'page', '--out', 'page.html'])\n"
        "         or main(['check', 'rooms']))"
    )
    subprocess.run([sys.executable, "-c", script], cwd=empty, check=True, env={"PATH": "/usr/bin:/bin"})
    assert (empty / "book/index.html").is_file() and (empty / "page.html").is_file()
