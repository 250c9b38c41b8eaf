"""What the editor keeps in a map's free keys: notes, groups, locks, and the picture underneath.

An entry names its obstacle by place and name, which survives edits by hand; what others keep there stays.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from robocov_app.editor.model.background import Background

MARKS = {"note": str, "group": str, "locked": bool, "hidden": bool}
"""What is kept of an obstacle besides its shape, and its kind; the falsy is not written."""

_HOME = "editor"  # the editor's free key, unless that holds something of somebody else
_LISTS = {"notes": ("note",), "outline": ("group", "locked", "hidden")}
_OURS = {*_LISTS, "background"}
_LOST = "notes of obstacles that are gone"


def annotated(
    extra: Mapping[str, Any],
    marks: Mapping[int, Mapping[str, Any]],
    names: Sequence[str | None],
    background: Background | None,
) -> dict[str, Any]:
    """Return the free keys of a map, `extra`, with the editor's; marks come by the place of an obstacle."""
    ours: dict[str, Any] = {}
    for key, kept in _LISTS.items():
        entries = []
        for k in sorted(marks):
            of = {"obstacle": k} if names[k] is None else {"obstacle": k, "name": names[k]}
            held = {name: marks[k][name] for name in kept if name in marks[k]}
            entries += [{**of, **held}] if held else []
        if entries:
            ours[key] = entries
    if background is not None:
        ours["background"] = background.document()
    if not ours:
        return dict(extra)
    home = next(key for key in _homes() if _is_free(extra.get(key, {})))
    return {**extra, home: {**extra.get(home, {}), **ours}}


def taken_apart(
    extra: Mapping[str, Any], names: Sequence[str | None]
) -> tuple[dict[int, dict[str, Any]], Background | None, dict[str, Any]]:
    """Return marks by the place of their obstacle, the picture, and the free keys of everybody else."""
    for home, _ in zip(_homes(), range(len(extra) + 1), strict=False):
        held = extra.get(home)
        if not isinstance(held, dict) or _is_free(held):
            continue
        background = Background.of_document(held["background"]) if "background" in held else None
        sound = all(_are_entries(held.get(key, []), kept) for key, kept in _LISTS.items())
        if not sound or ("background" in held and background is None):
            continue
        marks: dict[int, dict[str, Any]] = {}
        rest = {key: value for key, value in held.items() if key not in _OURS}
        for key, kept in _LISTS.items():
            taken = set()
            for entry in held.get(key, []):
                k = _obstacle_of(entry, names)
                if k is not None and k not in taken:
                    taken.add(k)
                    marks.setdefault(k, {}).update((name, entry[name]) for name in kept if name in entry)
                elif key == "notes":
                    rest[_LOST] = [*rest.get(_LOST, []), entry]
        others = {key: value for key, value in extra.items() if key != home}
        return marks, background, {**extra, home: rest} if rest else others
    return {}, None, dict(extra)


def _homes() -> Iterator[str]:
    yield _HOME
    for k in count(2):
        yield f"{_HOME} {k}"


def _is_free(held: object) -> bool:
    return isinstance(held, dict) and not _OURS & held.keys()


def _are_entries(entries: object, kept: tuple[str, ...]) -> bool:
    return isinstance(entries, list) and all(
        isinstance(entry, dict)
        and type(entry.get("obstacle")) is int
        and isinstance(entry.get("name", ""), str)
        and set(entry) <= {"obstacle", "name", *kept}
        and any(name in entry for name in kept)
        and all(type(entry[name]) is MARKS[name] for name in kept if name in entry)
        for entry in entries
    )


def _obstacle_of(entry: Mapping[str, Any], names: Sequence[str | None]) -> int | None:
    """Return the place of the obstacle that an entry is about; None if it is gone."""
    k, name = int(entry["obstacle"]), entry.get("name")
    if 0 <= k < len(names) and names[k] == name:
        return k
    if name is not None and names.count(name) == 1:
        return names.index(name)
    # it may have got a name, or lost it
    return k if 0 <= k < len(names) and (name is None or names[k] is None) else None
