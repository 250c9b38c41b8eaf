"""The handbook covers what the program contains."""

from __future__ import annotations

import re
import tomllib

from markdown_pages import ROOT, list_handbook_pages, read_handbook_page

import robocov as rc

SOURCE_FOLDERS = (ROOT / "app/robocov_app", ROOT / "coverage/robocov")
EXTRAS_FOR_DEVELOPERS = {"all", "test"}


def test_the_contents_list_every_page_once() -> None:
    listed_pages: list[str] = []
    for contents in re.findall(r"```{toctree}(.*?)```", read_handbook_page("index"), re.DOTALL):
        listed_pages += re.findall(r"^([\w-]+)$", contents, re.MULTILINE)
    pages = [page.stem for page in list_handbook_pages() if page.stem != "index"]
    assert sorted(listed_pages) == pages


def test_every_public_name_has_an_example() -> None:
    used_names = set(re.findall(r"\brc\.(\w+)", read_handbook_page("names-in-use")))
    assert used_names == set(rc.__all__)


def test_the_architecture_page_names_every_package() -> None:
    names = set(re.findall(r"`(\w+)`", read_handbook_page("architecture")))
    for folder in SOURCE_FOLDERS:
        for path in folder.iterdir():
            is_module = path.suffix == ".py" or (path / "__init__.py").exists()
            if is_module and not path.stem.startswith("_"):
                assert path.stem in names


def test_the_modules_on_the_architecture_page_exist() -> None:
    for path in re.findall(r"`([\w/]+\.py)`", read_handbook_page("architecture")):
        candidates = [ROOT / path, *(folder / path for folder in SOURCE_FOLDERS)]
        assert any(candidate.is_file() for candidate in candidates), path


def test_every_environment_variable_is_explained() -> None:
    page = read_handbook_page("install")
    for folder in SOURCE_FOLDERS:
        for path in folder.rglob("*.py"):
            for variable in re.findall(r'"(ROBOCOV_[A-Z]+)"', path.read_text(encoding="utf-8")):
                assert f"`{variable}`" in page, f"{path.relative_to(ROOT)}: {variable}"


def test_every_extra_is_explained() -> None:
    page = read_handbook_page("install")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for name in project["optional-dependencies"].keys() - EXTRAS_FOR_DEVELOPERS:
        assert f"`{name}`" in page
