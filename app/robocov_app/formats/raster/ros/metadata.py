"""The YAML of a ROS map: picture, scale, position and thresholds."""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, cast, get_args

from robocov.errors import MapError, quote, to_one_line
from robocov_app.formats import files

Mode: TypeAlias = Literal["trinary", "scale", "raw"]
"""Encoding of occupancy in pixels; see `classification`."""
OCCUPIED_THRESHOLD = 0.65
FREE_THRESHOLD = 0.196
"""Thresholds that map_server writes."""
DEFAULT_THRESHOLDS = {"occupied_thresh": OCCUPIED_THRESHOLD, "free_thresh": FREE_THRESHOLD}
UNKNOWN_LEVEL = 205
"""Level (0 to 255) that map savers write for unknown cells."""
_KNOWN_KEYS = ("image", "resolution", "origin", "negate", "mode", *DEFAULT_THRESHOLDS)
_MIN_RESOLUTION_M = 1e-4
_MAX_RESOLUTION_M = 1000.0
_TRUE_WORDS = ("1", "true", "yes", "on")
_FALSE_WORDS = ("0", "false", "no", "off")


@dataclass(frozen=True)
class Metadata:
    """The checked values of the YAML of a map.

    Attributes
    ----------
    image : str
        Name of the picture.
    mode : "trinary", "scale" or "raw"
    resolution : float, m
        Side of a cell.
    origin : (x, y), m
        Lower left corner.
    yaw : float, rad
        Angle by which the map is rotated about that corner.
    negate : bool
        Whether light pixels are occupied, not dark ones.
    occupied, free : float
        Thresholds of darkness, from 0 to 1.
    missing_thresholds, unknown_keys : tuple of str
        Thresholds missing in the file, and keys in the file that ROS does not define.
    """

    image: str
    mode: Mode
    resolution: float
    origin: tuple[float, float]
    yaw: float
    negate: bool
    occupied: float
    free: float
    missing_thresholds: tuple[str, ...]
    unknown_keys: tuple[str, ...]


def parse_metadata(document: dict[str, files.Value], source_name: str) -> Metadata:
    """Parse and check the YAML of a map.

    Parameters
    ----------
    document : dict
    source_name : str
        The file, for messages.

    Raises
    ------
    MapError
        If a value is missing or invalid.
    """
    parser = _MetadataParser(document, source_name)
    mode = parser.parse_mode()
    resolution = parser.parse_number("resolution")
    files.require_length(
        resolution, f"{source_name}: resolution", minimum=_MIN_RESOLUTION_M, maximum=_MAX_RESOLUTION_M
    )
    x, y, yaw = parser.parse_origin()
    negate = parser.parse_negate()
    occupied, free = parser.parse_thresholds()
    return Metadata(
        image=parser.get_text("image", expected="one file name"),
        mode=mode,
        resolution=resolution,
        origin=(x, y),
        yaw=yaw,
        negate=negate,
        occupied=occupied,
        free=free,
        missing_thresholds=tuple(key for key in DEFAULT_THRESHOLDS if key not in document),
        unknown_keys=tuple(to_one_line(key) for key in document if key not in _KNOWN_KEYS),
    )


class _MetadataParser:
    """Parses the values in the YAML of a map."""

    def __init__(self, document: dict[str, files.Value], source_name: str) -> None:
        self._document = document
        self._source_name = source_name

    def get_text(self, key: str, default: str | None = None, *, expected: str = "one value") -> str:
        """Return the text of a key; raise MapError if the key is missing and has no default.

        `expected` describes the value in the messages.
        """
        value = self._document.get(key, default)
        if value is None:
            raise MapError(f"{self._source_name}: {key}: missing, expected {expected}")
        if not isinstance(value, str):
            raise MapError(f"{self._source_name}: {key}: expected {expected}, got {quote(value)}")
        return value

    def parse_number(self, key: str, default: str | None = None) -> float:
        """Return the number of a key; raise MapError if it is invalid, or missing without a default."""
        text = self.get_text(key, default, expected="a number")
        return _parse_number(text, f"{self._source_name}: {key}")

    def parse_mode(self) -> Mode:
        """Return the mode of a map."""
        name = self.get_text("mode", "trinary").lower()
        for mode in get_args(Mode):
            if name == mode:
                return cast(Mode, mode)
        raise MapError(f"{self._source_name}: mode: expected one of trinary, scale, raw, got {quote(name)}")

    def parse_origin(self) -> tuple[float, float, float]:
        """Return the pose of the lower left corner: x and y in m, and the yaw in rad."""
        location = f"{self._source_name}: origin"
        origin = self._document.get("origin", ["0", "0", "0"])
        if not isinstance(origin, list) or not 2 <= len(origin) <= 3:
            raise MapError(f"{location}: expected [x, y, yaw], got {quote(origin)}")
        texts = [*origin, "0"]  # the yaw may be missing
        x = _parse_number(texts[0], f"{location}[0]")
        y = _parse_number(texts[1], f"{location}[1]")
        yaw = _parse_number(texts[2], f"{location}[2]")
        files.require_coordinate(x, f"{location}[0]")
        files.require_coordinate(y, f"{location}[1]")
        return x, y, yaw

    def parse_negate(self) -> bool:
        """Return whether light pixels are occupied."""
        word = self.get_text("negate", "0").lower()
        if word not in _TRUE_WORDS + _FALSE_WORDS:
            raise MapError(f"{self._source_name}: negate: expected 0 or 1, got {quote(word)}")
        return word in _TRUE_WORDS

    def parse_thresholds(self) -> tuple[float, float]:
        """Return the thresholds of darkness for occupied cells and for free cells."""
        occupied = self.parse_number("occupied_thresh", str(OCCUPIED_THRESHOLD))
        free = self.parse_number("free_thresh", str(FREE_THRESHOLD))
        if not 0.0 <= free <= occupied <= 1.0:
            expected = "expected 0 <= free_thresh <= occupied_thresh <= 1"
            raise MapError(f"{self._source_name}: {expected}, got {free:g} and {occupied:g}")
        return occupied, free


def _parse_number(value: files.Value, place: str) -> float:
    """Convert a text to a finite number; raise MapError if that is impossible."""
    number = files.parse_number(value) if isinstance(value, str) else math.nan
    if not math.isfinite(number):
        raise MapError(f"{place}: expected a number, got {quote(value)}")
    return number
