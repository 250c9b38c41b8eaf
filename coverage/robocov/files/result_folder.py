"""Folders of results: the old result or the new one at any moment, and nothing else touched.

A result is made in a hidden staging folder inside its folder. To commit it, a journal is written that lists
the files of the new result, and those of the old one that go. From the moment when the journal has its name,
the new result counts: whoever opens the folder next does what is left to be done (`settle`). In the end the
journal becomes the manifest, the list of the files that the result consists of. What the manifest does not
name is somebody else's, and neither replaced nor removed. Links inside the folder are not followed.
"""

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Literal, TypeAlias

from robocov.errors import InputError, OutputError, describe_error, quote
from robocov.files.folder_lock import lock_folder
from robocov.files.writing import flush_to_disk, replace_file

Kind: TypeAlias = Literal["run", "comparison", "replay", "story"]
REPORT = "report.html"
"""A page about the result, which goes with it."""
MANIFEST, _JOURNAL = ".robocov.json", ".robocov-commit.json"
_STAGING, _LOCK = ".robocov-new", ".robocov.lock"
_HEAD = {"format": "robocov-folder", "version": 1}
_PICTURES = ("trajectories.png", "trajectories.svg", "cost.png", "cost.svg")
_FILES: dict[Kind, tuple[str, ...]] = {
    "comparison": ("comparison.json", "comparison.csv", "comparison.mp4", *_PICTURES),
    "run": ("run.json", "record.npz", "cost.csv", "run.mp4", *_PICTURES),
    "replay": ("replay.json", "run.mp4", "comparison.mp4"),
    "story": ("story.json", "session.robocov", "cost.csv", "run.mp4", "comparison.mp4"),
}
"""Files of a result of each kind, beside ``frames/`` and the folders of a comparison's runs."""
_NAMES = {MANIFEST, "metrics.csv", REPORT, *(name for names in _FILES.values() for name in names)}
_FRAME = re.compile(r"\d{6}\.png")
_BEGINNINGS = {
    **{f"{kind}.json": re.compile(rf'"format":\s*"robocov-{kind}"'.encode()) for kind in _FILES},
    "metrics.csv": re.compile(rb"time_s,sensed_area_m2,"),
    REPORT: re.compile(rb'<meta name="generator" content="robocov'),
}
"""By what files of ours are known, in their first 4096 bytes."""


class ResultFolder:
    """A folder while its result is being made: the files go to the hidden folder `new`."""

    def __init__(self, path: Path, owned: set[str], *, replaces: bool, part: str = "") -> None:
        self.path, self.new = path, path / _STAGING / part
        self._prefix = f"{part}/" if part else ""
        self._owned, self._replaces = owned, replaces
        with for_results(path):
            self.new.mkdir(parents=True)

    def claim(self, name: str) -> None:
        """Count a file that is there as one of the result's, so that it may be replaced."""
        self._owned.add(self._prefix + name)

    def keep(self) -> None:
        """Commit what is made so far, unless it is to replace a result: that is done once all is made."""
        if not self._replaces:
            self.commit()

    def commit(self) -> None:
        """Put what is made in the place of the earlier result; or beside it, where it replaces none."""
        with for_results(self.path):
            staging = self.path / _STAGING
            made = {path.relative_to(staging).as_posix() for path in staging.rglob("*") if not path.is_dir()}
            if not made:
                return
            for name in made:
                _require_free(self.path, name, self._owned)
            for folder in {(self.path / name).parent for name in made}:
                folder.mkdir(parents=True, exist_ok=True)
                if not os.access(folder, os.W_OK | os.X_OK):
                    raise OutputError(f"{folder}: cannot be written to: Permission denied")
            files = made if self._replaces else made | self._owned
            journal = {**_HEAD, "files": sorted(files), "removed": sorted(self._owned - files)}
            with replace_file(staging / _JOURNAL) as part:
                part.write_text(json.dumps(journal, indent=0) + "\n", encoding="utf-8")
            (staging / _JOURNAL).replace(self.path / _JOURNAL)  # from here on the new result counts
            _carry_out(self.path)
            self._owned, self._replaces = files, False
            self.new.mkdir(parents=True)


@contextmanager
def results(
    folder: Path, kind: Kind = "run", *, overwrite: bool, parts: Iterable[str] = ()
) -> Iterator[ResultFolder]:
    """Give a folder for a result, which is committed at the end; where the work fails, it is not.

    A missing folder is made; if nothing comes into it, it goes again. `overwrite` replaces the result that is
    there; `parts` names the folders of a comparison's runs.

    Raises `InputError` when what is in the folder may not be replaced, `OutputError` when it cannot be used,
    another process is at work in it, or a file of somebody else is in the way.
    """
    with for_results(folder):
        existed = folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with _held(folder):
            with for_results(folder):
                earlier = _replaceable(folder, overwrite=overwrite)
                owned = earlier or set()
                own = (*_FILES[kind], "frames/000000.png", *_frames(folder))
                inner = (f"{part}/{name}" for part in parts for name in _FILES["run"])
                for name in sorted({*owned, *own, *inner}):
                    _require_free(folder, name, owned)
            result = ResultFolder(folder, owned, replaces=earlier is not None)
            yield result
            result.commit()
    finally:
        if not existed:
            with suppress(OSError):
                folder.rmdir()  # fails, as it should, where there is something in it


@contextmanager
def extended(folder: Path) -> Iterator[ResultFolder]:
    """Give the folder of a result, or of one run of a comparison, to which files are added."""
    home, part = _home(folder)
    with _held(home):
        with for_results(home):
            owned = _owned(home)
        if owned is None:
            raise InputError(f"{folder}: there is no result of robocov in it")
        result = ResultFolder(home, owned, replaces=False, part=part)
        yield result
        result.commit()


def settle(folder: Path) -> None:
    """Complete the commit of a result that was interrupted; to be called before the result is read.

    Raises `InputError` when it cannot be known what is left to be done, `OutputError` when it cannot be done.
    """
    if os.path.lexists(folder / _JOURNAL):
        with lock_folder(folder, _LOCK, remove=True), for_results(folder):
            _carry_out(folder)
    home, part = _home(folder, _JOURNAL)
    if part:
        raise InputError(f"{folder}: its replacement was interrupted; open {home} to have it completed")


def is_report(path: Path) -> bool:
    """Return whether a file is a page that ``robocov report`` has written."""
    return _is_ours(path, REPORT)


def _listing(path: Path) -> tuple[set[str], set[str]] | None:
    """Return the files that a manifest or a journal names, and those that go; None where there is none."""
    if not os.path.lexists(path):
        return None
    try:
        if path.is_symlink() or not path.is_file():
            raise ValueError("it is no regular file")
        content = json.loads(path.read_bytes())
        if {key: content[key] for key in _HEAD} != _HEAD:
            raise ValueError(f"{quote(content['format'])}, version {quote(content['version'])}")
        files, removed = set(content["files"]), set(content.get("removed", ()))
        for name in files | removed:
            *_, own = steps = name.split("/")
            if not all(re.fullmatch(r"(?!\.{1,2}$)[^/\\:\0]+", step) for step in steps):
                raise ValueError(f"{quote(name)}, but a file in the folder was wanted")
            # or whoever sends a folder might have any file replaced or removed
            if own not in _NAMES and not _FRAME.fullmatch(own):
                raise ValueError(f"{quote(name)}, but a file of a result was wanted")
        return files, removed
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path}: cannot be used: {error}") from error


def _carry_out(folder: Path) -> None:
    """Do what a journal says, or the rest of it; then it is the manifest."""
    journal = _listing(folder / _JOURNAL)
    if journal is None:
        return
    files, removed = journal
    flush_to_disk([folder])
    for name in removed:
        path = _inside(folder, name)
        if _is_file(path):
            path.unlink()
    for name in files:
        source = _inside(folder, f"{_STAGING}/{name}")
        if _is_file(source):
            target = _inside(folder, name)
            target.parent.mkdir(parents=True, exist_ok=True)
            source.replace(target)
    parents = {parent for name in removed for parent in PurePosixPath(name).parents[:-1]}
    for parent in sorted(parents, key=lambda each: len(each.parts), reverse=True):
        with suppress(OSError):
            (folder / parent).rmdir()  # fails, as it should, where there is something in it
    _discard_staging(folder)
    (folder / _JOURNAL).replace(folder / MANIFEST)


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Lock a folder and put it in order; afterwards discard what was made and not committed."""
    with lock_folder(folder, _LOCK, remove=True):
        with for_results(folder):
            _carry_out(folder)
            _discard_staging(folder)
        try:
            yield
        finally:
            if not os.path.lexists(folder / _JOURNAL):
                with suppress(OSError):
                    _discard_staging(folder)


def _discard_staging(folder: Path) -> None:
    if os.path.lexists(folder / _STAGING):
        shutil.rmtree(folder / _STAGING)


def _replaceable(folder: Path, *, overwrite: bool) -> set[str] | None:
    """Return the files of the result that is to be replaced, None where the folder is empty."""
    if not {path.name for path in folder.iterdir()} - {_LOCK, _STAGING, MANIFEST}:
        return None
    if not overwrite:
        raise InputError(f"{folder}: the folder is not empty; another --out, or --overwrite, was wanted")
    home, part = _home(folder)
    if part:
        raise InputError(f"{folder}: belongs to the comparison in {home}; another --out was wanted")
    owned = _owned(folder)
    if owned is None:
        what = "what is in the folder is no result of robocov, so --overwrite leaves it alone"
        raise InputError(f"{folder}: {what}; another --out was wanted")
    return owned


def _home(folder: Path, name: str = MANIFEST) -> tuple[Path, str]:
    """Return the folder whose manifest (or journal) names files in this one, and the way from there."""
    if not os.path.lexists(folder / name):
        real = Path(os.path.realpath(folder))  # which takes links that go round in circles
        with suppress(InputError):
            files, _ = _listing(real.parent / name) or ((), ())
            if any(each.startswith(f"{real.name}/") for each in files):
                return real.parent, real.name
    return folder, ""


def _owned(folder: Path) -> set[str] | None:
    """Return the files of the result in a folder, None where there is none.

    Without a manifest that can be read, as in a copy without hidden files, those that have the names of ours.
    """
    with suppress(InputError):  # one that is damaged still says whose folder it is
        if manifest := _listing(folder / MANIFEST):
            return manifest[0]
    kind = next((kind for kind in _FILES if _is_ours(folder / f"{kind}.json", f"{kind}.json")), None)
    if kind is None and not os.path.lexists(folder / MANIFEST):
        return None
    names = {name for name in _FILES[kind or "run"] if _is_file(folder / name)}
    names |= {name for name in ("metrics.csv", REPORT) if _is_ours(folder / name, name)}
    for part in _parts(folder) if kind == "comparison" else ():
        inner = (*(_owned(part) or ()), MANIFEST)
        names |= {f"{part.name}/{name}" for name in inner if _is_file(part / name)}
    return names | _frames(folder)


def _frames(folder: Path) -> set[str]:
    frames = folder / "frames"
    if frames.is_symlink() or not frames.is_dir():
        return set()
    return {f"frames/{path.name}" for path in frames.iterdir() if _FRAME.fullmatch(path.name)}


def _parts(folder: Path) -> list[Path]:
    """Return the folders of the runs of a comparison without a manifest."""
    try:
        names = [str(name) for name in json.loads((folder / "comparison.json").read_bytes())["folders"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    parts = [folder / name for name in names if Path(name).name == name != ".."]
    return [part for part in parts if part.is_dir() and not part.is_symlink()]


def _is_ours(path: Path, name: str) -> bool:
    """Return whether a file begins like ours of that name."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _BEGINNINGS[name].search(file.read(4096)) is not None
    except OSError:
        return False


def _is_file(path: Path) -> bool:
    """Return whether there is a file, or a link."""
    return path.is_symlink() or path.is_file()


def _require_free(folder: Path, name: str, owned: set[str]) -> None:
    """Make sure that a file of the result may be written or removed: that it is nobody else's."""
    path = _inside(folder, name)
    if os.path.lexists(path) and not (name in owned and _is_file(path)):
        what = "is in the way, and does not belong to the result"
        raise OutputError(f"{path}: {what}; another --out was wanted")


def _inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder; the way to it must lead through folders, and no links."""
    path = folder
    for step in name.split("/")[:-1]:
        path /= step
        if path.is_symlink():
            raise OutputError(f"{path}: is a link, which is not followed; another --out was wanted")
        if os.path.lexists(path) and not path.is_dir():
            raise OutputError(f"{path}: is in the way of a folder; another --out was wanted")
    return folder / name


@contextmanager
def for_results(folder: Path) -> Iterator[None]:
    """Turn errors of the system into one line about the folder."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {describe_error(error)}") from error
