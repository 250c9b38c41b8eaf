"""YAML without tags: mappings, lists and text.

Scalars are returned as text: the caller decides which of them are numbers. Aliases may repeat a value, within
a limit on the total number of values.
"""

from collections.abc import Iterator
from itertools import takewhile
from typing import Any, NamedTuple, TypeAlias

import yaml

from robocov.errors import MapError, quote, to_one_line

Value: TypeAlias = "str | list[Value] | dict[str, Value]"
"""A value as it is written in the file, before numbers are parsed."""
MAX_YAML_BYTES = 262_144
"""Maximum size of a file, which takes a second to parse. A map has 200 bytes, a world a few thousand."""
MAX_YAML_VALUES = 50_000
"""Maximum number of values. A value that aliases repeat counts each time."""
MAX_YAML_DEPTH = 12
"""Deepest nesting of lists and mappings, including nesting through aliases."""


def parse_yaml(text: bytes, source_name: str) -> dict[str, Value]:
    """Parse a YAML text whose top level is a mapping.

    Anchors, aliases and the merge key ``<<`` work as in YAML 1.1.

    Parameters
    ----------
    text : bytes
        Content of the file, in UTF-8.
    source_name : str
        Name of the file for messages.

    Raises
    ------
    MapError
        If the text is not YAML, not a mapping, too large or too deep, or has tags, duplicate keys, or more
        than `MAX_YAML_VALUES` values once its aliases are expanded.
    """
    if len(text) > MAX_YAML_BYTES:
        raise MapError(f"{source_name}: expected at most {MAX_YAML_BYTES // 1024} kB of YAML, got more")
    try:
        decoded = text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MapError(f"{source_name}: byte {error.start}: not UTF-8") from None
    try:
        return _YamlReader(decoded, source_name).read()
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark is not None else ""
        raise MapError(
            f"{source_name}: {line}not YAML: {to_one_line(error.problem or error.context)}"
        ) from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise MapError(f"{source_name}: not YAML: {to_one_line(error)[:200]}") from None


class _SizedValue(NamedTuple):
    """A value, the number of values in it (including itself), and its nesting depth."""

    value: Value
    size: int
    depth: int


class _YamlReader:
    """Builds values from parser events one at a time, so that limits apply before a large file is parsed."""

    def __init__(self, text: str, source_name: str) -> None:
        self.source_name = source_name
        self.events = yaml.parse(text, Loader=yaml.BaseLoader)
        self.anchors: dict[str, _SizedValue] = {}
        self.count = 0

    def read(self) -> dict[str, Value]:
        """Return the mapping in the text; an empty text gives an empty mapping."""
        result: dict[str, Value] = {}
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent) and result:
                raise MapError(f"{self._locate(event)}: expected one document, got a second one")
            if isinstance(event, yaml.SequenceStartEvent | yaml.ScalarEvent):
                actual = quote(event.value) if isinstance(event, yaml.ScalarEvent) else "a list"
                raise MapError(f"{self._locate(event)}: expected a mapping (name: value), got {actual}")
            if isinstance(event, yaml.NodeEvent):
                value = self._build(event, depth=1).value
                assert isinstance(value, dict)
                result = value
        return result

    def _locate(self, event: yaml.Event) -> str:
        line = event.start_mark.line + 1 if event.start_mark else 0
        return f"{self.source_name}: line {line}"

    def _build(self, event: Any, depth: int) -> _SizedValue:
        """Build the value that starts with an event; `depth` is the nesting depth of a list or mapping."""
        if isinstance(event, yaml.AliasEvent):
            return self._follow_alias(event, depth)
        if event.tag is not None:
            raise MapError(f"{self._locate(event)}: expected a plain value, got the tag {quote(event.tag)}")
        count_before = self.count
        inner_depth = 0
        value: Value
        if isinstance(event, yaml.ScalarEvent):
            self._add_to_count(event, 1, 0)
            value = event.value
        elif isinstance(event, yaml.SequenceStartEvent):
            self._add_to_count(event, 1, depth)
            value, inner_depth = self._build_list(depth)
        else:
            self._add_to_count(event, 1, depth)
            value, inner_depth = self._build_mapping(depth)
        sized_value = _SizedValue(value, self.count - count_before, inner_depth)
        if event.anchor is not None:
            self.anchors[str(event.anchor)] = sized_value
        return sized_value

    def _follow_alias(self, event: Any, depth: int) -> _SizedValue:
        target = self.anchors.get(str(event.anchor))
        if target is None:
            expected = "expected the name of an anchor before it"
            raise MapError(f"{self._locate(event)}: {expected}, got the alias {quote(event.anchor)}")
        self._add_to_count(event, target.size, depth - 1 + target.depth)
        return target

    def _add_to_count(self, event: Any, count: int, depth: int) -> None:
        self.count += count
        if self.count > MAX_YAML_VALUES:
            expected = f"expected at most {MAX_YAML_VALUES} values, including those of aliases"
            raise MapError(f"{self._locate(event)}: {expected}, got more")
        if depth > MAX_YAML_DEPTH:
            expected = f"expected at most {MAX_YAML_DEPTH} levels"
            raise MapError(f"{self._locate(event)}: nested too deeply, {expected}")

    def _iterate_collection(self) -> Iterator[Any]:
        """Yield the events up to the end of the current list or mapping."""
        return takewhile(lambda event: not isinstance(event, yaml.CollectionEndEvent), self.events)

    def _build_list(self, depth: int) -> tuple[list[Value], int]:
        """Return the items of a list and the number of levels in it."""
        items = [self._build(event, depth + 1) for event in self._iterate_collection()]
        inner_depth = max((item.depth for item in items), default=0)
        return [item.value for item in items], inner_depth + 1

    def _build_mapping(self, depth: int) -> tuple[dict[str, Value], int]:
        """Return the items of a mapping, with merge keys resolved, and the number of levels in it."""
        mapping: dict[str, Value] = {}
        merged_mappings: list[Value] = []
        inner_depth = 0
        for event in self._iterate_collection():
            # The event is that of a key; the events of its value follow, and are read from the same iterator.
            if not isinstance(event, yaml.ScalarEvent):
                kind = "an alias" if isinstance(event, yaml.AliasEvent) else "a collection"
                raise MapError(f"{self._locate(event)}: expected a scalar as the key, got {kind}")
            key = self._build(event, depth).value
            assert isinstance(key, str)
            item = self._build(next(self.events), depth + 1)
            inner_depth = max(inner_depth, item.depth)
            if key == "<<" and event.style is None:  # no style: not in quotes
                merged_mappings += self._list_merged_mappings(item.value, event)
            elif key in mapping:
                raise MapError(f"{self._locate(event)}: {to_one_line(key)}: duplicate key")
            else:
                mapping[key] = item.value
        for merged_mapping in merged_mappings:
            assert isinstance(merged_mapping, dict)
            # Keys of the mapping itself, and of mappings merged earlier, take precedence.
            mapping = merged_mapping | mapping
        return mapping, inner_depth + 1

    def _list_merged_mappings(self, value: Value, event: Any) -> list[Value]:
        """Return the mappings that are the value of a merge key: one, or a list of them."""
        mappings: list[Value] = value if isinstance(value, list) else [value]
        if not all(isinstance(mapping, dict) for mapping in mappings):
            raise MapError(
                f"{self._locate(event)}: <<: expected a mapping, or a list of them, got another value"
            )
        return mappings
