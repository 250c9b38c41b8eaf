"""YAML as the files of maps need it: mappings, lists and plain values, and no more.

Tags, anchors and aliases are refused, so that no text can stand for more than what is written, nor for
anything but text: what a value is, who asks for it decides.
"""

from __future__ import annotations

from typing import TypeAlias

import yaml

from robocov.errors import MapError, one_line, shown

Value: TypeAlias = "str | list[Value] | dict[str, Value]"
"""Text as it is written, or a list or a mapping of values."""

MAX_BYTES = 262_144
"""Longest text that is read, in bytes, which takes a second: a map has 200, a world some thousand."""

DEEPEST = 12
"""Deepest nesting of lists and mappings."""


def parse(text: bytes, where: str) -> dict[str, Value]:
    """Return the mapping in `text`.

    Parameters
    ----------
    text : bytes
        UTF-8, with or without a byte order mark.
    where : str
        What messages call it: a file's name.

    Raises
    ------
    MapError
        When it is not YAML (with the line), no mapping, has a key twice, or has tags, anchors or aliases.

    Examples
    --------
    >>> parse(b"image: a.pgm\\norigin: [0, 1.5, 0]", "map.yaml")
    {'image': 'a.pgm', 'origin': ['0', '1.5', '0']}
    """
    if len(text) > MAX_BYTES:
        raise MapError(f"{where}: larger than {MAX_BYTES // 1024} kB, but the YAML of a map was wanted")
    try:
        decoded = text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MapError(f"{where}: byte {error.start}: not UTF-8, but YAML in UTF-8 was wanted") from None
    try:
        return _mapping(decoded, where)
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark is not None else ""
        raise MapError(f"{where}: {line}not YAML: {one_line(error.problem or error.context)}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise MapError(f"{where}: not YAML: {one_line(error)[:200]}") from None


def _mapping(text: str, where: str) -> dict[str, Value]:
    result: dict[str, Value] = {}
    # the collections that are open, each with the name that waits for its value
    path: list[tuple[list[Value] | dict[str, Value], str | None]] = []
    # the events come as they are read: a bomb is refused at its first fuse
    for event in yaml.parse(text, Loader=yaml.BaseLoader):
        line = f"{where}: line {event.start_mark.line + 1 if event.start_mark else 0}"
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            raise MapError(f"{line}: an anchor or alias, but a plain value was wanted")
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise MapError(f"{line}: the tag {shown(tag)}, but a plain value was wanted")
        if isinstance(event, yaml.DocumentStartEvent) and result:
            raise MapError(f"{line}: a second document, but one was wanted")
        if isinstance(event, yaml.CollectionEndEvent):
            path.pop()
            continue
        if not isinstance(event, yaml.CollectionStartEvent | yaml.ScalarEvent):
            continue
        value: Value = {} if isinstance(event, yaml.MappingStartEvent) else []
        if isinstance(event, yaml.ScalarEvent):
            value = event.value
        if not path:
            if not isinstance(value, dict):
                found = "a list" if isinstance(value, list) else shown(value)
                raise MapError(f"{line}: {found}, but a mapping (name: value) was wanted")
            result = value
        else:
            _put(path, value, line)
        if not isinstance(value, str):
            path.append((value, None))
        if len(path) > DEEPEST:
            raise MapError(f"{line}: nested too deeply, but at most {DEEPEST} levels were wanted")
    return result


def _put(path: list[tuple[list[Value] | dict[str, Value], str | None]], value: Value, line: str) -> None:
    """Put a value into the innermost collection that is open: an item, a name, or what a name stands for."""
    inside, key = path[-1]
    if isinstance(inside, list):
        inside.append(value)
    elif key is not None:
        inside[key] = value
        path[-1] = (inside, None)
    elif not isinstance(value, str):
        raise MapError(f"{line}: a name that is a collection, but a word was wanted")
    elif value in inside:
        raise MapError(f"{line}: {one_line(value)}: given twice, but once was wanted")
    else:
        path[-1] = (inside, value)
