"""JSON files, with the line and column of errors in them."""

from pathlib import Path
from typing import Any

import numpy as np

from robocov.errors import Issue, JsonPath, MapError, quote_json, to_one_line
from robocov.files.strictjson import locate_issues, parse_json
from robocov.typing import FloatArray
from robocov_app.formats.files.limits import MAX_TEXT_BYTES, require_vertices
from robocov_app.formats.files.reading import read_content


class JsonFile:
    """A parsed JSON file.

    Parameters
    ----------
    path : Path
        The file. For a file in an archive: the path of the archive, followed by the name in the archive.
    text : bytes, optional
        Content of the file, if it has been read already.

    Attributes
    ----------
    source_name : str
        Name of the file for messages.
    document : object
        The parsed content.
    """

    def __init__(self, path: Path, text: bytes | None = None) -> None:
        self.source_name = to_one_line(path)
        self._content = read_content(path, MAX_TEXT_BYTES) if text is None else text
        # Each point is a list of two or three numbers, so brackets and commas bound the number of points.
        # Counting them takes milliseconds, parsing a huge file takes minutes.
        require_vertices(max(self._content.count(b"["), self._content.count(b",") // 3), self.source_name)
        self.document: Any = parse_json(self._content, self.source_name)

    def build_error(self, location: JsonPath, value: object, expected: str) -> MapError:
        """Build the error for an invalid value, with its line and column.

        Parameters
        ----------
        location : JsonPath
            Keys and indices that lead to the value.
        value : object
            The value in the file.
        expected : str
            Description of the values that are accepted.
        """
        issue = Issue.at_path(location, f"expected {expected}, got {quote_json(value)}")
        return locate_issues(MapError.from_issues(self.source_name, [issue]), self._content, self.source_name)

    def parse_points(
        self, value: Any, location: JsonPath, *, min_count: int, min_dimensions: int, max_dimensions: int
    ) -> FloatArray:
        """Convert a JSON list of points to a (k, d) array.

        The number of coordinates d is that of the longest point; missing coordinates of others are nan.

        Parameters
        ----------
        value : object
            The list of points.
        location : JsonPath
            Keys and indices that lead to the list.
        min_count : int
            Minimum number of points.
        min_dimensions, max_dimensions : int
            Range of the number of coordinates of a point.

        Raises
        ------
        MapError
            If the value is not a list of at least `min_count` points.
        """
        if not isinstance(value, list) or len(value) < min_count:
            points = "point" if min_count == 1 else "points"
            raise self.build_error(location, value, f"a list of at least {min_count} {points} [x, y]")
        for k, point in enumerate(value):
            if not isinstance(point, list) or not min_dimensions <= len(point) <= max_dimensions:
                raise self.build_error((*location, k), point, "a point [x, y] of finite numbers")
            if not all(map(is_number, point)):
                raise self.build_error((*location, k), point, "a point [x, y] of finite numbers")
        dimensions = max(map(len, value))
        if min(map(len, value)) < dimensions:
            value = [_pad_point(point, dimensions) for point in value]
        return np.array(value, dtype=float)


def _pad_point(point: list[float], dimensions: int) -> list[float]:
    """Return the coordinates of a point, followed by nan for each missing one."""
    missing_count = dimensions - len(point)
    return point + [float("nan")] * missing_count


def get_member(value: object, name: str) -> Any:
    """Return a member of a JSON object, or None if it is missing or `value` is not an object."""
    return value.get(name) if isinstance(value, dict) else None


def is_number(value: object) -> bool:
    """Return whether a JSON value is a number that is small enough to compute with."""
    return type(value) in (int, float) and -1e100 < value < 1e100  # type: ignore[operator]
