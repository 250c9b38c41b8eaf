"""`robocov handbook`."""

import importlib.util
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from robocov.errors import InputError, OutputError, RobocovError
from robocov_app.terminal.output import echo

_BUNDLED_PAGES = Path(__file__).parents[1] / "pages"
"""Folder of the built pages, which only wheels contain."""
_REQUIRED_MODULES = ("sphinx", "furo", "myst_parser")
"""Modules that build the pages, from the extra `robocov[docs]`."""


@dataclass
class Arguments:
    """Open the handbook in a browser: tutorials, guides, and a reference of all commands and names.

    A released wheel contains it. An installation from a checkout builds it at first use, and again after
    changes of the program, which needs pip install "robocov[docs]", and keeps it in the user's cache. Its
    search works offline.

    Example: robocov handbook --out site
    """

    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Write the handbook to this new folder as a static site, instead of opening it."""


def command(options: Arguments) -> None:
    """Run `robocov handbook`."""
    if options.out is not None:
        _build_pages(options.out)
        echo(f"saved in {options.out}/: start with index.html")
        return
    import webbrowser

    folder = _BUNDLED_PAGES if _BUNDLED_PAGES.is_dir() else _cache_pages()
    index = folder / "index.html"
    echo(index)
    webbrowser.open(index.as_uri())


def _cache_pages() -> Path:
    """Return the folder of the pages in the user's cache; build them first if they are out of date."""
    from robocov.files.array_files import ArrayCache

    cache = ArrayCache.open_default()
    folder = Path(tempfile.mkdtemp(prefix="robocov-")) if cache is None else cache.folder / "handbook"
    # The key changes whenever a page or a module of the program changes.
    states = (f"{file} {file.stat().st_mtime_ns}" for file in _list_sources())
    pages = folder / ArrayCache.compute_key(*states)
    if not (pages / "index.html").is_file():
        if cache is not None:
            # Remove pages of an earlier state of the program.
            shutil.rmtree(folder, ignore_errors=True)
        echo("building the handbook, once ...", to_stderr=True)
        _build_pages(pages)
    return pages


def _list_sources() -> list[Path]:
    """List the files from which the handbook is built, except for the generated reference."""
    import robocov

    pages = find_page_sources()
    roots = (pages, Path(__file__).parents[1], Path(robocov.__file__).parent)
    files = sorted(file for root in roots for file in root.rglob("*") if file.suffix in (".py", ".md"))
    return [file for file in files if pages / "reference" not in file.parents]


def find_page_sources() -> Path:
    """Find the folder with the Markdown sources of the handbook.

    Returns
    -------
    Path
    """
    application = Path(__file__).resolve().parents[1]
    candidates = (application / "handbook", application.parent / "handbook")
    return next(folder for folder in candidates if folder.is_dir())


def _build_pages(folder: Path) -> None:
    """Write the handbook to a new folder.

    Raises
    ------
    InputError
        If the folder is not empty.
    OutputError
        If the folder cannot be written.
    RobocovError
        If Sphinx is not installed or fails.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: already exists; expected a new or empty folder")
    try:
        if _BUNDLED_PAGES.is_dir():
            shutil.copytree(_BUNDLED_PAGES, folder, dirs_exist_ok=True)
        else:
            _build_with_sphinx(folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from error


def _build_with_sphinx(folder: Path) -> None:
    """Build the pages in a new or empty folder."""
    missing_modules = [name for name in _REQUIRED_MODULES if importlib.util.find_spec(name) is None]
    if missing_modules:
        alternative = f"the pages can also be read as text: {find_page_sources() / 'index.md'}"
        raise RobocovError(
            f'{missing_modules[0]} is not installed: pip install "robocov[docs]"; {alternative}'
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".handbook-") as scratch:
        pages = _run_sphinx(Path(scratch))
        if folder.exists():
            # A folder in use, such as the current one, cannot be replaced.
            shutil.copytree(pages, folder, dirs_exist_ok=True)
        else:
            pages.replace(folder)


def _run_sphinx(scratch: Path) -> Path:
    """Build the pages in a scratch folder, and return their folder."""
    # Sphinx writes the reference next to the other sources, which may be read-only, so it gets a copy.
    sources = scratch / "sources"
    pages = scratch / "pages"
    shutil.copytree(find_page_sources(), sources, ignore=shutil.ignore_patterns("reference", "__pycache__"))
    arguments = ["-q", "-W", "--keep-going", "-b", "html", "-d", str(scratch / "doctrees")]
    process = subprocess.run(
        [sys.executable, "-m", "sphinx", *arguments, str(sources), str(pages)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    if process.returncode:
        raise RobocovError(f"the handbook cannot be built: {process.stderr.strip()}")
    return pages
