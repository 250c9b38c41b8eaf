"""Foreign files: size limits, text, JSON, YAML, and files that they name.

YAML has no tags here, so that no text can stand for anything but text: what a value is, who asks for it
decides. Aliases may repeat a value, within a limit on all values together.
"""

import codecs
import stat
import warnings
from collections.abc import Iterator
from contextlib import suppress
from itertools import takewhile
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import yaml
from numpy.typing import NDArray

from robocov.arrays import Array
from robocov.errors import JsonPath as Steps
from robocov.errors import MapError, Mistake, describe_error, quote, quote_json, to_one_line
from robocov.files.strictjson import locate_mistakes, parse_json
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M

MAX_BYTES = 256_000_000  # largest file of a raster, in bytes: `MAX_CELLS` in plain text
MAX_TEXT_BYTES = 50_000_000  # largest file of a vector format, in bytes; as of the project's own maps
MAX_CELLS = 64_000_000  # largest raster, in cells: 8000 x 8000
MAX_VERTICES = 500_000  # most vertices of a foreign map
MAX_SHAPES = 20_000  # of a drawing, of a file: each costs a quarter of a millisecond, whatever its size
MAX_DEPTH = 32  # deepest nesting of collections, groups, blocks, lists
MAX_INCLUDED_FILES = 200  # files that a map may include, counted each time that one is read
MAX_INCLUDED_BYTES = 20_000_000  # size of all of them together, in bytes
HEAD = 1 << 20  # so much of a file is looked at, in bytes, to know its format
_LONG = 400  # longest name of a file, in characters
Value: TypeAlias = "str | list[Value] | dict[str, Value]"  # text is as it is written
MAX_YAML_BYTES = 262_144  # which take a second to read: a map has 200, a world some thousand
MAX_YAML_VALUES = 50_000  # values of a text, each counted as often as an alias repeats it
DEEPEST = 12  # deepest nesting of lists and mappings, also through aliases
_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))


def head(path: Path, most: int = HEAD) -> bytes:
    """Return the first bytes of the file at `path`; a MapError where there is no ordinary one."""
    where = to_one_line(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise MapError(f"{where}: expected a file, got a folder")
        if not stat.S_ISREG(mode):  # opening a pipe would wait for ever
            raise MapError(f"{where}: expected a file, got a pipe or a device")
        with path.open("rb") as file:
            return file.read(most)
    except FileNotFoundError:
        raise MapError(f"{where}: no such file") from None
    except (OSError, ValueError) as error:
        raise MapError(f"{where}: cannot be read: {describe_error(error)}") from None


def content(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of a file; a MapError where it is larger than `most` bytes, or as `head`."""
    head(path, 0)
    if path.stat().st_size > most or len(data := head(path, most + 1)) > most:
        raise MapError(f"{to_one_line(path)}: expected at most {most / 1e6:.3g} MB, got more")
    return data


class IncludeBudget:
    """The files that a map includes, which are limited together: a few kB can name billions of them.

    Parameters
    ----------
    max_files : int
        Number of files that may be read. A file that is included twice counts twice.
    max_bytes : int
        Size of all of them together.
    """

    def __init__(self, max_files: int = MAX_INCLUDED_FILES, max_bytes: int = MAX_INCLUDED_BYTES) -> None:
        self.max_files = max_files
        self.max_bytes = max_bytes
        self.files_read = 0
        self.bytes_read = 0

    def take(self, path: Path, at: str) -> None:
        """Count a file that is about to be read.

        Parameters
        ----------
        path : Path
        at : str
            Place that names the file, for messages.

        Raises
        ------
        MapError
            When the map includes too many files or too many bytes, or there is no such file.
        """
        head(path, 0)
        self.files_read += 1
        self.bytes_read += path.stat().st_size
        if self.files_read > self.max_files:
            found = f"more than {self.max_files} files are included"
            raise MapError(
                f"{at}: {found}, expected at most {self.max_files}, each counted as often as it is read"
            )
        if self.bytes_read > self.max_bytes:
            found = f"the included files have more than {self.max_bytes / 1e6:g} MB together"
            raise MapError(f"{at}: {found}, expected at most that")


def require_cells(width: int, height: int, where: str) -> None:
    if width < 1 or height < 1:
        raise MapError(f"{where}: expected at least 1 x 1, got {width} x {height} cells")
    if width * height > MAX_CELLS:
        most = MAX_CELLS // 1_000_000
        raise MapError(f"{where}: expected at most {most} million, got {width} x {height} cells")


def require_vertices(count: int, where: str) -> None:
    if count > MAX_VERTICES:
        raise MapError(f"{where}: expected at most {MAX_VERTICES}, got about {count} vertices")


def require_shapes(count: int, where: str) -> None:
    if count > MAX_SHAPES:
        raise MapError(f"{where}: expected at most {MAX_SHAPES}, got {count:.6g} shapes")


def require_length(value: float, where: str, smallest: float = 1e-6, largest: float = MAX_SIZE_M) -> None:
    if not smallest <= value <= largest:
        wanted = f"expected a number from {smallest:.10g} to {largest:.10g} (m)"
        raise MapError(f"{where}: {wanted}, got {quote(value)}")


def require_coordinate(value: float, where: str) -> None:
    require_length(value, where, -MAX_COORDINATE_M, MAX_COORDINATE_M)


def read_text(path: Path, separator: bytes) -> tuple[str, str]:
    """Return the text of a file, and what messages call it; `separator` is what stands between vertices."""
    where = to_one_line(path)
    data = content(path, MAX_TEXT_BYTES)
    require_vertices(data.count(separator), where)
    mark, encoding = next((both for both in _MARKS if data.startswith(both[0])), (b"", "utf-8"))
    try:
        return data[len(mark) :].decode(encoding), where
    except UnicodeDecodeError as error:
        raise MapError(f"{where}: byte {error.start}: not {encoding.upper()}, expected text") from None


def name_of_map(path: Path) -> str:
    return to_one_line(path.stem)[:60] or "map"


def named_file(path: Path, name: str, what: str, at: str, notes: list[str], anywhere: bool) -> Path:
    """Return the file that the one at `path` names, a `what`, at the place `at`.

    It must be in the file's folder or below, unless it may be `anywhere`. Programs write where it was when it
    was saved, and it may have moved with the file: one of the same name beside it is as good, as `notes` say.
    """
    if not name:
        raise MapError(f"{at}: empty, expected the name of a {what}")
    if len(name) > _LONG:
        raise MapError(f"{at}: {quote(name)}: expected a shorter name, got {len(name)} characters")
    named = path.parent / name
    beside = path.parent / PureWindowsPath(name).name
    try:
        allowed = anywhere or _inside(named, path.parent)
        if not (allowed and _exists(named)) and beside.is_file() and _inside(beside, path.parent):
            key = at.rpartition(": ")[2]
            note = f"{key}: {quote(name)} is not there, {quote(beside.name)} beside the file taken"
            notes += [] if note in notes else [note]
            return beside
    except (OSError, ValueError, RuntimeError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else "no name of a file"
        raise MapError(f"{at}: {quote(name)}: {why}") from None
    if not allowed:
        wanted = f"expected a {what} in it (--anywhere allows it)"
        raise MapError(f"{at}: {quote(name)} is outside the folder of the file, {wanted}")
    return named


def _inside(named: Path, folder: Path) -> bool:
    return named.resolve().is_relative_to(folder.resolve())


def _exists(named: Path) -> bool:
    """Return whether there is such a file; an OSError where that cannot be known, as from a name too long."""
    with suppress(FileNotFoundError, NotADirectoryError):
        named.stat()
        return True
    return False


def number(text: str) -> float:
    """Return the number that a text is, nan where it is none."""
    try:
        return float(text)
    except ValueError:
        return np.nan


def whole_numbers(text: str | bytes, separator: str) -> NDArray[np.int64] | None:
    """Return the numbers in a text, None where there is anything else."""
    with warnings.catch_warnings(), suppress(DeprecationWarning, ValueError, OverflowError):
        warnings.simplefilter("error", DeprecationWarning)
        return np.fromstring(text, dtype=np.int64, sep=separator) if text.strip() else np.empty(0, np.int64)
    return None


def begins_with(head: bytes, bracket: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == bracket


class JsonFile:
    """The `document` in a JSON file, what messages call the file, and errors with lines and columns.

    Parameters
    ----------
    path : Path
        Its name; for a part of an archive, the path of the archive and the name in it.
    text : bytes, optional
        What it contains, if it was read already.
    """

    def __init__(self, path: Path, text: bytes | None = None) -> None:
        self.where = to_one_line(path)
        self._content = content(path, MAX_TEXT_BYTES) if text is None else text
        # each point is a list of two or three: to count takes a moment, to parse minutes
        require_vertices(max(self._content.count(b"["), self._content.count(b",") // 3), self.where)
        self.document: Any = parse_json(self._content, self.where)

    def refused(self, at: Steps, value: object, wanted: str) -> MapError:
        """Return the error of a value at a place: what was expected, and what is there."""
        mistake = Mistake.at_path(at, f"expected {wanted}, got {quote_json(value)}")
        return locate_mistakes(MapError.from_mistakes(self.where, [mistake]), self._content, self.where)

    def positions(self, value: Any, at: Steps, least: int, fewest: int, most: int) -> Array:
        """Return the points of a list as (k, d), d from `fewest` to `most`; missing dimensions are nan."""
        if not isinstance(value, list) or len(value) < least:
            points = "point" if least == 1 else "points"
            raise self.refused(at, value, f"a list of at least {least} {points} [x, y]")
        for k, point in enumerate(value):
            if not (isinstance(point, list) and fewest <= len(point) <= most and all(map(is_number, point))):
                raise self.refused((*at, k), point, "a point [x, y] of finite numbers")
        wide = max(map(len, value))
        if min(map(len, value)) < wide:
            value = [[*point, *[np.nan] * (wide - len(point))] for point in value]
        return np.array(value, dtype=float)


def is_number(value: object) -> bool:
    """Return whether a JSON value is a number, of a size that can be calculated with."""
    return type(value) in (int, float) and -1e100 < value < 1e100  # type: ignore[operator]


def parse_yaml(text: bytes, where: str) -> dict[str, Value]:
    """Return the mapping in a YAML text.

    Anchors and aliases, and the merge key ``<<``, mean what they mean in YAML 1.1.

    Parameters
    ----------
    text : bytes
        UTF-8.
    where : str
        What messages call the file.

    Raises
    ------
    MapError
        When the text is no YAML, no mapping, too large or too deep, or has tags, keys that are given twice,
        or more than `MAX_YAML_VALUES` values once its aliases are followed.
    """
    if len(text) > MAX_YAML_BYTES:
        raise MapError(f"{where}: expected at most {MAX_YAML_BYTES // 1024} kB of YAML, got more")
    try:
        decoded = text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MapError(f"{where}: byte {error.start}: not UTF-8") from None
    try:
        return _YamlReader(decoded, where).read()
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark is not None else ""
        raise MapError(f"{where}: {line}not YAML: {to_one_line(error.problem or error.context)}") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise MapError(f"{where}: not YAML: {to_one_line(error)[:200]}") from None


class _Counted(NamedTuple):
    """A value, how many values are in it, itself included, and how deep lists and mappings are nested."""

    value: Value
    size: int
    depth: int


class _YamlReader:
    """Builds values from the events of the parser as they come: what is too much is refused at once."""

    def __init__(self, text: str, where: str) -> None:
        self.where = where
        self.events = yaml.parse(text, Loader=yaml.BaseLoader)
        self.anchors: dict[str, _Counted] = {}
        self.count = 0

    def read(self) -> dict[str, Value]:
        result: dict[str, Value] = {}
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent) and result:
                raise MapError(f"{self._line(event)}: expected one document, got a second one")
            if isinstance(event, yaml.SequenceStartEvent | yaml.ScalarEvent):
                found = quote(event.value) if isinstance(event, yaml.ScalarEvent) else "a list"
                raise MapError(f"{self._line(event)}: expected a mapping (name: value), got {found}")
            if isinstance(event, yaml.NodeEvent):
                value = self._build(event, depth=1).value
                assert isinstance(value, dict)
                result = value
        return result

    def _line(self, event: yaml.Event) -> str:
        return f"{self.where}: line {event.start_mark.line + 1 if event.start_mark else 0}"

    def _build(self, event: Any, depth: int) -> _Counted:
        """Return the value that begins with an event; `depth` is that of a list or mapping there."""
        if isinstance(event, yaml.AliasEvent):
            found = self.anchors.get(str(event.anchor))
            if found is None:
                known = "expected the name of an anchor before it"
                raise MapError(f"{self._line(event)}: {known}, got the alias {quote(event.anchor)}")
            self._require_few(event, found.size, depth - 1 + found.depth)
            return found
        if event.tag is not None:
            raise MapError(f"{self._line(event)}: expected a plain value, got the tag {quote(event.tag)}")
        before = self.count
        if isinstance(event, yaml.ScalarEvent):
            self._require_few(event, 1, 0)
            value: Value = event.value
            inner_depth = 0
        else:
            self._require_few(event, 1, depth)
            is_list = isinstance(event, yaml.SequenceStartEvent)
            value, inner_depth = self._list(depth) if is_list else self._mapping(depth)
            inner_depth += 1
        counted_value = _Counted(value, self.count - before, inner_depth)
        if event.anchor is not None:
            self.anchors[str(event.anchor)] = counted_value
        return counted_value

    def _require_few(self, event: Any, count: int, depth: int) -> None:
        self.count += count
        if self.count > MAX_YAML_VALUES:
            many = f"more than {MAX_YAML_VALUES} values, aliases followed"
            raise MapError(f"{self._line(event)}: expected a smaller file, got {many}")
        if depth > DEEPEST:
            raise MapError(f"{self._line(event)}: nested too deeply, expected at most {DEEPEST} levels")

    def _inside(self) -> Iterator[Any]:
        """Yield the events up to the end of the list or mapping that has begun."""
        return takewhile(lambda event: not isinstance(event, yaml.CollectionEndEvent), self.events)

    def _list(self, depth: int) -> tuple[list[Value], int]:
        items = [self._build(event, depth + 1) for event in self._inside()]
        return [item.value for item in items], max((item.depth for item in items), default=0)

    def _mapping(self, depth: int) -> tuple[dict[str, Value], int]:
        found: dict[str, Value] = {}
        merged: list[Value] = []
        deepest = 0
        for event in self._inside():
            if not isinstance(event, yaml.ScalarEvent):
                kind = "an alias" if isinstance(event, yaml.AliasEvent) else "a collection"
                raise MapError(f"{self._line(event)}: expected a word as the name, got {kind}")
            name = self._build(event, depth).value
            assert isinstance(name, str)
            item = self._build(next(self.events), depth + 1)
            deepest = max(deepest, item.depth)
            if name == "<<" and event.style is None:
                merged += self._merged(item.value, event)
            elif name in found:
                raise MapError(f"{self._line(event)}: {to_one_line(name)}: duplicate key")
            else:
                found[name] = item.value
        for other in merged:
            assert isinstance(other, dict)
            found = other | found
        return found, deepest

    def _merged(self, value: Value, event: Any) -> list[Value]:
        """Return the mappings that a merge key names, those that count more first."""
        mappings: list[Value] = value if isinstance(value, list) else [value]
        if not all(isinstance(each, dict) for each in mappings):
            raise MapError(
                f"{self._line(event)}: <<: expected a mapping, or a list of them, got another value"
            )
        return mappings
