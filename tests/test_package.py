"""The wheel, the source archive, the extras, and the description on package indexes."""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from built_pages import HAS_SPHINX, UnlinkedNames, find_broken_links
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

import robocov as rc
from robocov.controllers import CONTROLLERS
from robocov_app import learning
from robocov_app.benchmark.results import ENTRIES
from robocov_app.cli import COMMANDS, main
from robocov_app.commands import handbook

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DESCRIPTION = (ROOT / PROJECT["readme"]).read_text(encoding="utf-8")
EXTRAS = PROJECT["optional-dependencies"]
EXTRAS_FOR_DEVELOPERS = {"all", "test", "bench", "coverage-control"}
MAX_ARCHIVE_BYTES = 6_500_000
MAX_ARCHIVED_FILE_BYTES = 250_000
MAX_WHEEL_BYTES = 7_000_000


def test_the_extra_all_contains_the_extras_for_users() -> None:
    (requirement,) = EXTRAS["all"]
    assert set(re.findall(r"\w+", requirement)) == {"robocov", *EXTRAS.keys()} - EXTRAS_FOR_DEVELOPERS


def test_large_packages_are_optional() -> None:
    requirements = " ".join(PROJECT["dependencies"])
    assert not re.findall(r"pyarrow|pandas|sphinx|imageio|distributed|gymnasium", requirements)


def test_the_description_lists_all_extras_for_users() -> None:
    first_columns = re.findall(r"^\|.*?\|", DESCRIPTION, re.MULTILINE)
    listed_extras = set(re.findall(r"`(\w+)`", "".join(first_columns)))
    assert listed_extras == EXTRAS.keys() - EXTRAS_FOR_DEVELOPERS


def test_the_description_has_neither_links_nor_pictures() -> None:
    # They would lead to files of the repository, which package indexes do not have.
    assert not re.findall(r"\]\(|<\w+", DESCRIPTION)


def test_references_name_the_current_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    recipes = (ROOT / "app/handbook/recipes.md").read_text(encoding="utf-8")
    title = re.search(r'^title: "(.*)"$', citation, re.MULTILINE)
    assert f"\nversion: {rc.__version__}\n" in citation
    assert f"version = {{{rc.__version__}}}" in recipes
    assert title is not None
    assert f"title   = {{{title[1]}}}" in recipes


def test_without_sphinx_the_command_uses_the_bundled_handbook(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bundled_pages = tmp_path / "pages"
    bundled_pages.mkdir()
    index = bundled_pages / "index.html"
    index.write_text("the pages")
    opened_pages: list[str] = []
    monkeypatch.setattr(handbook, "_BUNDLED_PAGES", bundled_pages)
    monkeypatch.setattr("webbrowser.open", opened_pages.append)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["handbook"]) == 0
    assert capsys.readouterr().out == f"{index}\n"
    assert opened_pages == [index.as_uri()]
    assert main(["handbook", "--out", str(tmp_path / "site")]) == 0
    assert (tmp_path / "site/index.html").read_text() == "the pages"


@pytest.mark.slow
def test_the_source_archive_contains_tests_and_maps_but_no_video(tmp_path: Path) -> None:
    (archive,) = SdistBuilder(str(ROOT)).build(directory=str(tmp_path))
    sizes = {}
    with tarfile.open(archive) as files:
        for member in files.getmembers():
            _, _, name = member.name.partition("/")
            sizes[name] = member.size
    assert {"README.md", PROJECT["readme"], "tests/test_package.py", "maps/rooms.json"} <= sizes.keys()
    unwanted_files = re.compile(r"mp4$|__pycache__|\.nb[ic]$|handbook/reference/")
    assert not [name for name in sizes if unwanted_files.search(name)]
    assert max(sizes.values()) < MAX_ARCHIVED_FILE_BYTES
    assert Path(archive).stat().st_size < MAX_ARCHIVE_BYTES


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout. It contains the built handbook if Sphinx is installed."""
    folder = tmp_path_factory.mktemp("wheel")
    (path,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(path)


@pytest.fixture(scope="module")
def unpacked_wheel(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the files in the wheel."""
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(wheel) as files:
        files.extractall(folder)
    return folder


@pytest.mark.slow
@pytest.mark.xdist_group("wheel")
def test_the_wheel_contains_only_what_the_program_needs(wheel: Path, unpacked_wheel: Path) -> None:
    assets = {path.name for path in (ROOT / "app/robocov_app/report/assets").iterdir()}
    assert {"report.html.jinja", "report.css", "replay.js"} <= assets
    assert assets <= {path.name for path in (unpacked_wheel / "robocov_app/report/assets").iterdir()}
    assert (unpacked_wheel / "robocov/maps/rooms.json").is_file()
    assert (unpacked_wheel / "robocov/__init__.pyi").is_file(), "the list of public names"
    packages = {path.name for path in unpacked_wheel.iterdir() if not path.name.endswith(".dist-info")}
    assert packages == {"robocov", "robocov_app"}
    assert wheel.stat().st_size < MAX_WHEEL_BYTES


@pytest.mark.slow
@pytest.mark.xdist_group("wheel")
@pytest.mark.skipif(not HAS_SPHINX, reason="needs robocov[docs]")
def test_the_handbook_in_the_wheel_has_valid_links_and_a_complete_reference(unpacked_wheel: Path) -> None:
    # Warnings of Sphinx are errors, so that the wheel would not have been built.
    site = unpacked_wheel / "robocov_app/pages"
    pages = {file: file.read_text(encoding="utf-8") for file in site.rglob("*.html")}
    assert len(pages) > 20
    assert (site / "searchindex.js").is_file()
    assert not find_broken_links(site)
    assert not [file for file, text in pages.items() if str(ROOT) in text]
    reference = {file.stem: text for file, text in pages.items() if file.parent.name == "reference"}
    assert all(f"robocov {name}" in reference["commands"] for name in COMMANDS)
    assert all(f'id="{name}"' in reference["gains"] for name in CONTROLLERS)
    assert all(f'.{name}"' in reference["names"] for name in rc.__all__)
    assert all(f'id="robocov_app.learning.{name}"' in reference["learning"] for name in learning.__all__)
    assert "Play or pause" in reference["keys"]
    assert "Undo" in reference["keys"]
    for text in reference.values():
        unlinked = UnlinkedNames(text)
        assert not unlinked.listed_names, "names to see also are links"
        assert not {name.split(".")[-1] for name in unlinked.names}.intersection(rc.__all__)
    assert 'href="#obstaclepath"' in reference["formats"], "types link to their tables"
    assert ">-1<" not in reference["formats"], "placeholders are no defaults"
    assert ">Type<" not in "".join(reference.values()), "descriptions of properties are not split at a colon"
    assert 'id="robocov.typing.FloatArray"' in reference["other-names"]
    for page in ("names", "other-names", "learning"):
        # Signatures show the names of array types, not what these stand for.
        assert '<span class="pre">ndarray' not in reference[page]
        assert "_SupportsArray" not in reference[page]


@pytest.mark.slow
@pytest.mark.xdist_group("wheel")
@pytest.mark.skipif(not HAS_SPHINX, reason="needs robocov[docs]")
def test_commands_of_the_wheel_find_its_pages_entries_and_maps(unpacked_wheel: Path, tmp_path: Path) -> None:
    # `furo` cannot be imported, so that the pages cannot be built. Two entries are enough for the page of the
    # benchmark, and compiling the kernels of this installation would take longer than using them.
    script = f"""
import sys
sys.path.insert(0, {str(unpacked_wheel)!r})
sys.modules["furo"] = None
from robocov_app.benchmark import results
from robocov_app.cli import main
entries = results.load_bundled_results()
assert len(entries) == {len(list(ENTRIES.glob("*.json.gz")))}
results.load_bundled_results = lambda: entries[:2]
for command in ("handbook --out book", "benchmark page --out page.html", "check rooms"):
    assert main(command.split()) == 0, command
"""
    environment = {"PATH": "/usr/bin:/bin", "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, env=environment)
    assert (tmp_path / "book/index.html").is_file()
    assert (tmp_path / "page.html").is_file()
