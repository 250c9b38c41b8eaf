"""What the editor keeps in a map's free keys: notes on obstacles, and the picture underneath.

A note tells of its obstacle by its place in the list and by its name, so that it finds it again when
somebody has edited the file by hand. What others keep under the same key stays untouched.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from robocov_app.editor.model.background import Background

_HOME = "editor"
"""The editor's free key, unless that holds something of somebody else."""

_LOST = "notes of obstacles that are gone"


def annotated(
    extra: Mapping[str, Any],
    notes: Mapping[int, str],
    names: Sequence[str | None],
    background: Background | None,
) -> dict[str, Any]:
    """Return the free keys of a map together with the editor's.

    Parameters
    ----------
    extra : dict
        Of everybody else.
    notes : dict of place to note
    names : sequence of str or None
        Of the obstacles in their order.
    background : Background or None
    """
    ours: dict[str, Any] = {}
    if notes:
        ours["notes"] = [_note(k, names[k], notes[k]) for k in sorted(notes)]
    if background is not None:
        ours["background"] = background.document()
    if not ours:
        return dict(extra)
    home = next(key for key in _homes() if _is_free(extra.get(key, {})))
    return {**extra, home: {**extra.get(home, {}), **ours}}


def taken_apart(
    extra: Mapping[str, Any], names: Sequence[str | None]
) -> tuple[dict[int, str], Background | None, dict[str, Any]]:
    """Return notes by the place of their obstacle, the picture, and the free keys of everybody else."""
    for home, _ in zip(_homes(), range(len(extra) + 1), strict=False):
        held = extra.get(home)
        if not isinstance(held, dict) or _is_free(held):
            continue
        entries = held.get("notes", [])
        background = Background.of_document(held["background"]) if "background" in held else None
        if not _are_notes(entries) or ("background" in held and background is None):
            continue
        notes: dict[int, str] = {}
        rest = {key: value for key, value in held.items() if key not in ("notes", "background")}
        for entry in entries:
            k = _obstacle_of(entry, names)
            if k is None or k in notes:
                rest[_LOST] = [*rest.get(_LOST, []), entry]
            else:
                notes[k] = entry["note"]
        others = {key: value for key, value in extra.items() if key != home}
        return notes, background, {**extra, home: rest} if rest else others
    return {}, None, dict(extra)


def _homes() -> Iterator[str]:
    yield _HOME
    for k in count(2):
        yield f"{_HOME} {k}"


def _note(k: int, name: str | None, note: str) -> dict[str, Any]:
    return {"obstacle": k, "note": note} if name is None else {"obstacle": k, "name": name, "note": note}


def _is_free(held: object) -> bool:
    return isinstance(held, dict) and "notes" not in held and "background" not in held


def _are_notes(entries: object) -> bool:
    return isinstance(entries, list) and all(
        isinstance(entry, dict)
        and type(entry.get("obstacle")) is int
        and isinstance(entry.get("note"), str)
        and isinstance(entry.get("name", ""), str)
        and set(entry) <= {"obstacle", "name", "note"}
        for entry in entries
    )


def _obstacle_of(entry: Mapping[str, Any], names: Sequence[str | None]) -> int | None:
    """Return the place of the obstacle that a note is about; None if it is gone."""
    k, name = int(entry["obstacle"]), entry.get("name")
    if 0 <= k < len(names) and names[k] == name:
        return k
    if name is not None and names.count(name) == 1:
        return names.index(name)
    # it may have got a name, or lost it
    return k if 0 <= k < len(names) and (name is None or names[k] is None) else None
