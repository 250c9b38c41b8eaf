"""YAML as the files of maps need it: one mapping of names to values and flat lists, and no more.

Tags, anchors and aliases are refused, so that no text can stand for more than what is written, nor for
anything but text: what a value is, who asks for it decides.
"""

from __future__ import annotations

from typing import TypeAlias

import yaml

from robocov.errors import MapError, shown
from robocov.files.strictjson import one_line

Value: TypeAlias = str | list[str] | None
"""Text, a flat list of it, or None for what is nested deeper."""

MAX_BYTES = 65_536
"""Longest text that is read, in bytes: the YAML of a map has about 200."""


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
    depth = 0
    key: str | None = None
    items: list[str] | None = None
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
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth == 1 and not isinstance(event, yaml.MappingStartEvent):
                raise MapError(f"{line}: a list, but a mapping (name: value) was wanted")
            if depth > 1 and key is None:
                raise MapError(f"{line}: a name that is a collection, but a word was wanted")
            if depth > 3:
                raise MapError(f"{line}: nested too deeply, but at most 3 levels were wanted")
            items = [] if depth == 2 and isinstance(event, yaml.SequenceStartEvent) else None
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
            if depth == 1 and key is not None:
                result[key] = items
                key = None
        elif isinstance(event, yaml.ScalarEvent):
            if depth == 0:
                raise MapError(f"{line}: {shown(event.value)}, but a mapping (name: value) was wanted")
            if depth > 1:
                if depth == 2 and items is not None:
                    items.append(event.value)
            elif key is None:
                key = event.value
                if key in result:
                    raise MapError(f"{line}: {one_line(key)}: given twice, but once was wanted")
            else:
                result[key] = event.value
                key = None
    return result
