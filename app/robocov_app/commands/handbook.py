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

_BROUGHT = Path(__file__).parents[1] / "pages"  # those that a wheel brings


@dataclass
class Arguments:
    """Open the handbook in a browser: tutorials, guides, and a reference of every command and name.

    Installed packages bring it. In a checkout it is built at first use, and again after the program has
    changed (pip install "robocov[docs]"), and kept in the user's cache. Searching it needs no network.

    Example: robocov handbook --out site
    """

    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Put it into this new folder, as static pages for any host, instead of opening it."""


def command(options: Arguments) -> None:
    if options.out is not None:
        built(options.out)
        echo(f"saved in {options.out}/: begin with index.html")
        return
    import webbrowser

    index = (_BROUGHT if _BROUGHT.is_dir() else _kept()) / "index.html"
    echo(index)
    webbrowser.open(index.as_uri())


def _kept() -> Path:
    """Return the pages in the user's cache, which are built where they are not those of this program."""
    import robocov
    from robocov.files.array_files import ArrayCache

    cache = ArrayCache.open_default()
    home = Path(tempfile.mkdtemp(prefix="robocov-")) if cache is None else cache.folder / "handbook"
    # another folder when a page or a module of the program has changed
    roots = (sources(), Path(__file__).parents[1], Path(robocov.__file__).parent)
    files = sorted(file for root in roots for file in root.rglob("*") if file.suffix in (".py", ".md"))
    written = [file for file in files if sources() / "reference" not in file.parents]
    pages = home / ArrayCache.compute_key(*(f"{file} {file.stat().st_mtime_ns}" for file in written))
    if not (pages / "index.html").is_file():
        if cache is not None:
            shutil.rmtree(home, ignore_errors=True)  # those of an earlier state
        echo("building the handbook, once ...", to_stderr=True)
        built(pages)
    return pages


def sources() -> Path:
    app = Path(__file__).resolve().parents[1]
    return next(each for each in (app / "handbook", app.parent / "handbook") if each.is_dir())


def built(folder: Path) -> None:
    """Put the pages into a new folder; InputError where it is none, RobocovError where Sphinx complains."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: exists already; expected a new or an empty folder")
    if _BROUGHT.is_dir():
        shutil.copytree(_BROUGHT, folder, dirs_exist_ok=True)
        return
    needed = "sphinx", "furo", "myst_parser"
    if missing := [name for name in needed if importlib.util.find_spec(name) is None]:
        text = f"the pages can be read as text, too: {sources() / 'index.md'}"
        raise RobocovError(f'{missing[0]} is not installed: pip install "robocov[docs]"; {text}')
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".handbook-") as work:
            # a copy: the reference is written beside the other pages, and packages may be read-only
            copy, pages = Path(work, "sources"), Path(work, "pages")
            shutil.copytree(sources(), copy, ignore=shutil.ignore_patterns("reference", "__pycache__"))
            call = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
            call += ["-d", str(Path(work, "doctrees")), str(copy), str(pages)]
            done = subprocess.run(call, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            if done.returncode:
                raise RobocovError(f"the handbook cannot be built: {done.stderr.strip()}")
            pages.replace(folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror}") from error
