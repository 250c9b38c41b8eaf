"""Choosing a file by typing its path."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from robocov_app.toolkit.dialogs.choice import Choice, Option

MAX_FOLDER_ENTRIES = 5000
"""Maximum number of files and folders that are listed."""
_HINT = "↑ ↓ choose · Tab completes · Enter accepts · Esc closes"


def create_file_choice(
    title: str,
    folder: Path,
    accept: Callable[[Path], object],
    *,
    suffixes: Sequence[str] = (),
    recent: Sequence[Path] = (),
    text: str = "",
    hides_folder: bool = False,
) -> Choice:
    """Create a dialog in which the user chooses a file.

    Parameters
    ----------
    title : str
    folder : Path
        Folder to which relative paths refer.
    accept : callable
        Called with the chosen path.
    suffixes : sequence of str
        Suffixes of the files that are listed; by default all files are listed.
    recent : sequence of Path
        Files that are listed before anything is typed.
    text : str
        Proposed name of a file to be saved; empty to choose an existing file.
    hides_folder : bool
        Whether the path of the folder is not shown, because the user of a browser cannot open it.

    Returns
    -------
    Choice
    """
    browser = _FileBrowser(folder, tuple(suffixes), tuple(recent), shows_names_only=hides_folder)
    saves = bool(text)  # A proposed name means that the dialog saves a file rather than opens one.

    def accept_text(typed: str, option: Option | None) -> object:
        """Accept a file, or return the completion of a folder so that the dialog lists its content."""
        path = browser.resolve(typed.strip())
        is_new_file = saves and typed.strip() and not typed.endswith("/")
        if is_new_file:
            accept(path)
        elif option is not None and option.text.endswith("/"):
            return option.completion
        elif option is not None and isinstance(option.value, Path):
            accept(option.value)
        elif typed.strip():
            accept(path)
        return None

    empty_text = Choice.empty_text
    if saves:
        empty_text = "Press Enter to save here"
    placeholder = f"a path from {folder.absolute()}"
    if hides_folder:
        placeholder = "a file name"
    return Choice(
        title,
        browser.list_options,
        accept_text,
        placeholder=placeholder,
        hint=_HINT,
        empty_text=empty_text,
        text=text,
    )


@dataclass
class _FileBrowser:
    """Lists files and folders for typed paths."""

    folder: Path
    suffixes: tuple[str, ...]
    recent: tuple[Path, ...]
    shows_names_only: bool
    _options: dict[str, list[Option]] = field(default_factory=dict)

    def resolve(self, text: str) -> Path:
        """Return the path for a typed text: relative to the folder, with ~ expanded."""
        # Unlike Path.expanduser, this does not raise if the user does not exist.
        return self.folder / os.path.expanduser(text)  # noqa: PTH111

    def list_options(self, text: str) -> list[Option]:
        """List the completions of a typed path. Results are cached while the dialog is open."""
        if text not in self._options:
            self._options[text] = self._build_options(text)
        return self._options[text]

    def _build_options(self, text: str) -> list[Option]:
        """Read the folder of a typed path, and list its entries: folders first, then files."""
        name = text.rpartition("/")[2]
        prefix = text.removesuffix(name)
        folder = self.resolve(prefix)
        try:
            entries = list(islice(folder.iterdir(), MAX_FOLDER_ENTRIES))
            subfolders = {path for path in entries if path.is_dir()}
        except (OSError, ValueError):
            return []
        entries.sort(key=lambda path: (path not in subfolders, path.name.lower()))
        options = []
        if not text:
            options += [self._build_recent_option(path) for path in self.recent]
        for path in entries:
            is_file = path not in subfolders
            if not self._is_listed(path, name, is_file=is_file):
                continue
            if is_file:
                options.append(Option(path.name, completion=prefix + path.name, value=path))
            else:
                options.append(Option(f"{path.name}/", "folder", f"{prefix}{path.name}/", value=path))
        if not name and not self.shows_names_only:
            parent = folder.resolve().parent.as_posix().rstrip("/")
            options.append(Option("../", "folder", f"{parent}/"))
        return options

    def _build_recent_option(self, path: Path) -> Option:
        """Build the option of a recent file."""
        text = path.name if self.shows_names_only else str(path)
        return Option(text, "recent", text, value=path)

    def _is_listed(self, path: Path, name: str, *, is_file: bool) -> bool:
        """Return whether a file or folder matches the typed part of its name."""
        is_hidden = path.name.startswith(".") and not name.startswith(".")
        has_suffix = not is_file or not self.suffixes or path.suffix.lower() in self.suffixes
        return has_suffix and not is_hidden and name.lower() in path.name.lower()
