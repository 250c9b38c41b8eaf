"""Result folders, whose results are replaced completely or not at all.

A result is written to a hidden staging folder inside its folder. To commit the result, robocov writes a
journal in the staging folder. The journal lists the files of the new result, and the files of the old result
that are to be removed. Then the journal is moved to the folder. From then on, the new result is valid: if the
process is interrupted, the next process that opens the folder completes the remaining steps
(`complete_commit`). At the end, the journal becomes the manifest, which lists the files of the result.

Files that are not in the manifest were not written by robocov. They are neither replaced nor removed. Links
inside the folder are not followed.
"""

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import Any, Literal, TypeAlias

from robocov.errors import InputError, OutputError, describe_error, quote
from robocov.files.folder_lock import lock_folder
from robocov.files.paths import describe_path
from robocov.files.result_names import (
    BRANCH_FILE,
    COMPARISON_FILE,
    COMPARISON_TABLE_FILE,
    COMPARISON_VIDEO_FILE,
    COST_FIGURE,
    COST_FILE,
    FIGURE_SUFFIXES,
    FORMER_BRANCH_FILE,
    FRAMES_FOLDER,
    METRICS_FILE,
    RECORD_FILE,
    REPLAY_FILE,
    REPORT_FILE,
    RUN_FILE,
    RUN_VIDEO_FILE,
    SESSION_FILE,
    TRAJECTORIES_FIGURE,
)
from robocov.files.writing import flush_to_disk, replace_file

ResultKind: TypeAlias = Literal["run", "comparison", "replay", "branch"]
"""Kind of a result. A branch of a session consists of several runs."""
MANIFEST_FILE = ".robocov.json"
_JOURNAL_FILE = ".robocov-commit.json"
_STAGING_FOLDER = ".robocov-new"
_LOCK_FILE = ".robocov.lock"
_HEADER = {"format": "robocov-folder", "version": 1}
"""Format and version of manifests and journals."""
_FIGURE_FILES = (
    *(TRAJECTORIES_FIGURE + suffix for suffix in FIGURE_SUFFIXES),
    *(COST_FIGURE + suffix for suffix in FIGURE_SUFFIXES),
)
_MAIN_FILES: dict[ResultKind, str] = {
    "comparison": COMPARISON_FILE,
    "run": RUN_FILE,
    "replay": REPLAY_FILE,
    "branch": BRANCH_FILE,
}
"""File that marks a folder as the folder of a result, for each kind of result."""
_FILES: dict[ResultKind, tuple[str, ...]] = {
    "comparison": (COMPARISON_FILE, COMPARISON_TABLE_FILE, COMPARISON_VIDEO_FILE, *_FIGURE_FILES),
    "run": (RUN_FILE, RECORD_FILE, COST_FILE, RUN_VIDEO_FILE, *_FIGURE_FILES),
    "replay": (REPLAY_FILE, RUN_VIDEO_FILE, COMPARISON_VIDEO_FILE),
    "branch": (BRANCH_FILE, SESSION_FILE, COST_FILE, RUN_VIDEO_FILE, COMPARISON_VIDEO_FILE),
}
"""Files of each kind of result, except for ``frames/`` and the folders of the runs of a comparison."""
_KNOWN_NAMES = {
    MANIFEST_FILE,
    METRICS_FILE,
    REPORT_FILE,
    FORMER_BRANCH_FILE,
    *chain.from_iterable(_FILES.values()),
}
"""Names of all files of results, except for the frames of videos."""
_FRAME_NAME = re.compile(r"\d{6}\.png")
_FILE_NAME = re.compile(r"(?!\.{1,2}$)[^/\\:\0]+")
"""Name of a file, without separators and other than ``.`` and ``..``."""
_SIGNATURES = {
    **{
        main_file: re.compile(rf'"format":\s*"robocov-{kind}"'.encode())
        for kind, main_file in _MAIN_FILES.items()
    },
    FORMER_BRANCH_FILE: re.compile(rb'"format":\s*"robocov-story"'),
    METRICS_FILE: re.compile(rb"time_s,sensed_area_m2,"),
    REPORT_FILE: re.compile(rb'<meta name="generator" content="robocov'),
}
"""Patterns that the first bytes of a file contain if robocov has written it, by the name of the file."""
_SIGNATURE_BYTES = 4096
"""Number of bytes at the start of a file that are searched for its signature."""


class ResultFolder:
    """A folder to which a result is written; see `create_result` and `extend_result`.

    Parameters
    ----------
    path : Path
        The folder, which must exist.
    owned_files : set of str
        Files of the earlier result in the folder, which may be replaced.
    replaces : bool
        Whether the first commit replaces the whole earlier result. If not, it adds files to it.
    run_name : str
        Name of the run of a comparison to which files are added; empty for the result itself.

    Attributes
    ----------
    path : Path
        The folder.
    staging : Path
        Hidden folder to which the files of the result are written.
    """

    def __init__(self, path: Path, owned_files: set[str], *, replaces: bool, run_name: str = "") -> None:
        self.path = path
        self.staging = path / _STAGING_FOLDER / run_name
        self._prefix = f"{run_name}/" if run_name else ""
        self._owned_files = owned_files
        self._replaces = replaces
        with report_folder_errors(path):
            self.staging.mkdir(parents=True)

    def claim_file(self, name: str) -> None:
        """Add an existing file to the files of the result, so that it may be replaced.

        Parameters
        ----------
        name : str
            Path of the file, relative to the folder of the result.
        """
        self._owned_files.add(self._prefix + name)

    def save_progress(self) -> None:
        """Commit the files written so far, unless they replace an earlier result.

        An earlier result is kept until the new one is complete.

        Raises
        ------
        OutputError
            If the folder cannot be written to, or a file not written by robocov is in the way.
        """
        if not self._replaces:
            self.commit()

    def commit(self) -> None:
        """Move the files to the folder, in place of the earlier result or in addition to it.

        Raises
        ------
        OutputError
            If the folder cannot be written to, or a file not written by robocov is in the way.
        """
        with report_folder_errors(self.path):
            # If files are added to a run of a comparison, `self.staging` is a folder inside this one.
            staging_root = self.path / _STAGING_FOLDER
            staged_paths = [path for path in staging_root.rglob("*") if not path.is_dir()]
            new_files = {path.relative_to(staging_root).as_posix() for path in staged_paths}
            if not new_files:
                return
            self._prepare_targets(new_files)
            files = new_files if self._replaces else new_files | self._owned_files
            removed_files = self._owned_files - files
            journal = {**_HEADER, "files": sorted(files), "removed": sorted(removed_files)}
            with replace_file(staging_root / _JOURNAL_FILE) as temporary:
                temporary.write_text(json.dumps(journal, indent=0) + "\n", encoding="utf-8")
            # From here on, the new result is the valid one.
            (staging_root / _JOURNAL_FILE).replace(self.path / _JOURNAL_FILE)
            _apply_journal(self.path)
            self._owned_files = files
            self._replaces = False
            self.staging.mkdir(parents=True)

    def _prepare_targets(self, names: set[str]) -> None:
        """Create the folders of new files; raise an error if a file cannot be written or replaced."""
        for name in names:
            _require_replaceable(self.path, name, self._owned_files)
        for folder in {(self.path / name).parent for name in names}:
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK | os.X_OK):
                raise OutputError(f"{folder}: cannot be written to: Permission denied")


@contextmanager
def create_result(
    folder: Path, kind: ResultKind = "run", *, overwrite: bool, run_names: Iterable[str] = ()
) -> Iterator[ResultFolder]:
    """Create a result in a folder, and commit it at the end of the ``with`` block.

    If the block raises an error, nothing is committed. A missing folder is created, and removed again if it
    remains empty.

    Parameters
    ----------
    folder : Path
        Folder of the result.
    kind : {"run", "comparison", "replay", "branch"}
        Kind of the result.
    overwrite : bool
        Whether to replace a result that is already in the folder.
    run_names : iterable of str
        Names of the runs of a comparison. Each run has a folder of this name.

    Yields
    ------
    ResultFolder
        Folder to whose `staging` folder the files are to be written.

    Raises
    ------
    InputError
        If the content of the folder must not be replaced.
    OutputError
        If the folder cannot be used, another process is using it, or a file not written by robocov is in the
        way.
    """
    with report_folder_errors(folder):
        existed = folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with _open_folder(folder):
            with report_folder_errors(folder):
                replaced_files = _find_replaced_files(folder, overwrite=overwrite)
                owned_files = replaced_files or set()
                possible_files = _list_possible_files(folder, kind, run_names)
                for name in sorted(possible_files | owned_files):
                    _require_replaceable(folder, name, owned_files)
            result = ResultFolder(folder, owned_files, replaces=replaced_files is not None)
            yield result
            result.commit()
    finally:
        if not existed:
            with suppress(OSError):
                folder.rmdir()  # Fails, as it should, if the folder is not empty.


def _list_possible_files(folder: Path, kind: ResultKind, run_names: Iterable[str]) -> set[str]:
    """List the files that a result may have.

    There may be any number of frames. The first one and all that exist already are listed.
    """
    names = {*_FILES[kind], f"{FRAMES_FOLDER}/000000.png", *_list_frames(folder)}
    for run_name in run_names:
        names.update(f"{run_name}/{name}" for name in _FILES["run"])
    return names


@contextmanager
def extend_result(folder: Path) -> Iterator[ResultFolder]:
    """Add files to the result in a folder, and commit them at the end of the ``with`` block.

    Parameters
    ----------
    folder : Path
        Folder of a result, or of one run of a comparison.

    Yields
    ------
    ResultFolder
        Folder to whose `staging` folder the files are to be written.

    Raises
    ------
    InputError
        If there is no result in the folder.
    OutputError
        If the folder cannot be used, another process is using it, or a file not written by robocov is in the
        way.
    """
    # A run of a comparison belongs to the result of the comparison, in the folder above.
    result_root, run_name = _find_result_root(folder)
    with _open_folder(result_root):
        with report_folder_errors(result_root):
            owned_files = _list_owned_files(result_root)
        if owned_files is None:
            raise InputError(f"{folder}: expected a folder with a robocov result, found none")
        result = ResultFolder(result_root, owned_files, replaces=False, run_name=run_name)
        yield result
        result.commit()


def complete_commit(folder: Path) -> None:
    """Complete the commit of a result if it was interrupted. Call this before reading the result.

    Parameters
    ----------
    folder : Path
        Folder of a result, or of one run of a comparison.

    Raises
    ------
    InputError
        If the journal is damaged, or the commit of the comparison that contains the folder was interrupted.
    OutputError
        If the commit cannot be completed.
    """
    if os.path.lexists(folder / _JOURNAL_FILE):
        with lock_folder(folder, _LOCK_FILE, remove=True), report_folder_errors(folder):
            _apply_journal(folder)
    result_root, run_name = _find_result_root(folder, _JOURNAL_FILE)
    if run_name:
        raise InputError(f"{folder}: its replacement was interrupted; open {result_root} to complete it")


def is_report(path: Path) -> bool:
    """Return whether a file is a page that ``robocov report`` has written.

    Parameters
    ----------
    path : Path
        Any path, which may not exist.

    Returns
    -------
    bool
        False also if the file cannot be read.
    """
    return _has_signature(path, REPORT_FILE)


@contextmanager
def report_folder_errors(folder: Path) -> Iterator[None]:
    """Convert errors of the operating system to one-line errors about a result folder.

    Parameters
    ----------
    folder : Path
        Folder that the message names.

    Raises
    ------
    OutputError
        If the ``with`` block raises an OSError.
    """
    try:
        yield
    except OSError as error:
        if isinstance(error, FileExistsError) and not folder.is_dir():
            raise OutputError(f"{folder}: expected a folder, got a file") from error
        raise OutputError(f"{folder}: cannot be written: {describe_error(error)}") from error


def require_result(folder: Path, expected: str, files: Sequence[str]) -> None:
    """Raise an error unless a folder contains one of the files that mark a result.

    Parameters
    ----------
    folder : Path
    expected : str
        Description of the folder, such as "the folder of a run".
    files : sequence of str
        Names of files.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be read, or contains none of the files.
    """
    try:
        if any((folder / file).is_file() for file in files):
            return
        is_folder = folder.is_dir()
        actual = describe_path(folder)
    except OSError as error:
        # The user may have no permission to read the folder, or its name may be too long.
        raise InputError(f"{folder}: cannot be read: {describe_error(error)}") from error
    if is_folder:
        *first_files, last_file = files
        listing = f"{', '.join(first_files)} or {last_file}" if first_files else last_file
        actual = f"a folder without {listing}"
    raise InputError(f"{folder}: expected {expected}, got {actual}")


def _read_manifest(path: Path) -> tuple[set[str], set[str]] | None:
    """Read the names of files in a manifest or journal; return None if there is no such file.

    The first set contains the files of the result, the second one the files to remove.
    """
    if not os.path.lexists(path):
        return None
    try:
        if path.is_symlink() or not path.is_file():
            raise ValueError("not a regular file")
        content = json.loads(path.read_bytes())
        if not isinstance(content, dict):
            raise ValueError(f"expected a JSON object, got {quote(content)}")
        for key, expected in _HEADER.items():
            if content.get(key) != expected:
                raise ValueError(f"{key}: expected {quote(expected)}, got {quote(content.get(key))}")
        files = _require_file_names("files", content.get("files"))
        # A manifest lists no files to remove.
        removed_files = _require_file_names("removed", content.get("removed", []))
        return files, removed_files
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be used: {error}") from error


def _require_file_names(key: str, names: Any) -> set[str]:
    """Return a list of files in a manifest or journal as a set; raise ValueError if it cannot be used."""
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{key}: expected a list of files, got {quote(names)}")
    for name in names:
        _require_result_file(name)
    return set(names)


def _require_result_file(name: str) -> None:
    """Raise ValueError unless a relative path can be the path of a file of a result.

    Without this check, a manifest from an untrusted source could make robocov replace or remove any file.
    """
    parts = name.split("/")
    if not all(_FILE_NAME.fullmatch(part) for part in parts):
        raise ValueError(f"expected a file in the folder, got {quote(name)}")
    if parts[-1] not in _KNOWN_NAMES and not _FRAME_NAME.fullmatch(parts[-1]):
        raise ValueError(f"expected a file of a result, got {quote(name)}")


def _apply_journal(folder: Path) -> None:
    """Complete the steps in the journal of a folder, if there is one, and make the journal the manifest."""
    journal = _read_manifest(folder / _JOURNAL_FILE)
    if journal is None:
        return
    files, removed_files = journal
    # The journal must be on the disk before the first file is removed.
    flush_to_disk([folder])
    # If an earlier attempt was interrupted, some of the files have already been removed or moved.
    for name in removed_files:
        path = _resolve_inside(folder, name)
        if _is_file_or_link(path):
            path.unlink()
    for name in files:
        source = _resolve_inside(folder, f"{_STAGING_FOLDER}/{name}")
        if _is_file_or_link(source):
            target = _resolve_inside(folder, name)
            target.parent.mkdir(parents=True, exist_ok=True)
            source.replace(target)
    parents: set[PurePosixPath] = set()
    for name in removed_files:
        parents.update(PurePosixPath(name).parents[:-1])
    for parent in sorted(parents, key=lambda parent: len(parent.parts), reverse=True):
        with suppress(OSError):
            (folder / parent).rmdir()  # Fails, as it should, if the folder is not empty.
    _discard_staging(folder)
    (folder / _JOURNAL_FILE).replace(folder / MANIFEST_FILE)


@contextmanager
def _open_folder(folder: Path) -> Iterator[None]:
    """Lock a folder and complete an interrupted commit, if any; at the end, discard uncommitted files."""
    with lock_folder(folder, _LOCK_FILE, remove=True):
        with report_folder_errors(folder):
            _apply_journal(folder)
            _discard_staging(folder)
        try:
            yield
        finally:
            # If a commit was interrupted, its journal and staged files must remain for the next process.
            if not os.path.lexists(folder / _JOURNAL_FILE):
                # The next process that opens the folder would discard the files as well. An error here must
                # not replace an error of the block.
                with suppress(OSError):
                    _discard_staging(folder)


def _discard_staging(folder: Path) -> None:
    if os.path.lexists(folder / _STAGING_FOLDER):
        shutil.rmtree(folder / _STAGING_FOLDER)


def _find_replaced_files(folder: Path, *, overwrite: bool) -> set[str] | None:
    """Return the files of the result that is to be replaced; None if the folder is empty.

    Raise an error if the content of the folder must not be replaced.
    """
    if not {path.name for path in folder.iterdir()} - {_LOCK_FILE, _STAGING_FOLDER, MANIFEST_FILE}:
        return None
    if not overwrite:
        raise InputError(f"{folder}: the folder is not empty; choose another --out or pass --overwrite")
    result_root, run_name = _find_result_root(folder)
    if run_name:
        raise InputError(f"{folder}: belongs to the comparison in {result_root}; choose another --out")
    owned_files = _list_owned_files(folder)
    if owned_files is None:
        raise InputError(
            f"{folder}: the content of the folder is not a robocov result, so --overwrite does not replace "
            "it; choose another --out"
        )
    return owned_files


def _find_result_root(folder: Path, manifest_name: str = MANIFEST_FILE) -> tuple[Path, str]:
    """Return the folder of the whole result to which a folder belongs, and the name of the run.

    `manifest_name` is `MANIFEST_FILE` or `_JOURNAL_FILE`. A folder with a manifest or journal of its own is
    the root of its result. The folder of a run of a comparison has none; it belongs to the comparison, whose
    manifest or journal lists the files of the run. For any other folder, the folder itself and an empty name
    are returned.
    """
    if os.path.lexists(folder / manifest_name):
        return folder, ""
    real_folder = Path(os.path.realpath(folder))  # Unlike `resolve`, this accepts circular links.
    # A damaged manifest in the folder above does not make this folder part of a comparison.
    with suppress(InputError):
        manifest = _read_manifest(real_folder.parent / manifest_name)
        if manifest is not None:
            files, _ = manifest
            if any(name.startswith(f"{real_folder.name}/") for name in files):
                return real_folder.parent, real_folder.name
    return folder, ""


def _list_owned_files(folder: Path) -> set[str] | None:
    """Return the files of the result in a folder; None if there is no result.

    If there is no readable manifest, for example in a copy without hidden files, the files are identified by
    their names.
    """
    # A damaged manifest still shows that robocov wrote the folder.
    with suppress(InputError):
        manifest = _read_manifest(folder / MANIFEST_FILE)
        if manifest is not None:
            files, _ = manifest
            return files
    kind = _identify_kind(folder)
    if kind is None and not os.path.lexists(folder / MANIFEST_FILE):
        return None
    names = {name for name in _FILES[kind or "run"] if _is_file_or_link(folder / name)}
    signed_files = (METRICS_FILE, REPORT_FILE, FORMER_BRANCH_FILE)
    names |= {name for name in signed_files if _has_signature(folder / name, name)}
    if kind == "comparison":
        for run_folder in _list_run_folders(folder):
            run_files = {*(_list_owned_files(run_folder) or ()), MANIFEST_FILE}
            existing_files = {name for name in run_files if _is_file_or_link(run_folder / name)}
            names |= {f"{run_folder.name}/{name}" for name in existing_files}
    return names | _list_frames(folder)


def _identify_kind(folder: Path) -> ResultKind | None:
    """Return the kind of the result in a folder without a manifest; None if there is no result."""
    for kind, main_file in _MAIN_FILES.items():
        if _has_signature(folder / main_file, main_file):
            return kind
    return "branch" if _has_signature(folder / FORMER_BRANCH_FILE, FORMER_BRANCH_FILE) else None


def _list_frames(folder: Path) -> set[str]:
    frames = folder / FRAMES_FOLDER
    if frames.is_symlink() or not frames.is_dir():
        return set()
    return {f"{FRAMES_FOLDER}/{path.name}" for path in frames.iterdir() if _FRAME_NAME.fullmatch(path.name)}


def _list_run_folders(folder: Path) -> list[Path]:
    """List the folders of the runs of a comparison without a manifest."""
    try:
        names = [str(name) for name in json.loads((folder / COMPARISON_FILE).read_bytes())["folders"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    # Other names could lead out of the folder, or to the folder itself.
    plain_names = [name for name in names if name not in ("", "..") and Path(name).name == name]
    run_folders = [folder / name for name in plain_names]
    return [path for path in run_folders if path.is_dir() and not path.is_symlink()]


def _has_signature(path: Path, name: str) -> bool:
    """Return whether a file has the signature of the files that robocov writes under the given name."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _SIGNATURES[name].search(file.read(_SIGNATURE_BYTES)) is not None
    except OSError:
        return False


def _is_file_or_link(path: Path) -> bool:
    return path.is_symlink() or path.is_file()


def _require_replaceable(folder: Path, name: str, owned_files: set[str]) -> None:
    """Raise an error if a file of a result would replace a file that was not written by robocov."""
    path = _resolve_inside(folder, name)
    if not os.path.lexists(path):
        return
    if name not in owned_files or not _is_file_or_link(path):
        raise OutputError(f"{path}: is in the way, and does not belong to the result; choose another --out")


def _resolve_inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder; raise an error if a parent is a link or not a folder."""
    path = folder
    for step in name.split("/")[:-1]:
        path /= step
        if path.is_symlink():
            raise OutputError(f"{path}: is a link, which is not followed; choose another --out")
        if os.path.lexists(path) and not path.is_dir():
            raise OutputError(f"{path}: is in the way, expected a folder; choose another --out")
    return folder / name
