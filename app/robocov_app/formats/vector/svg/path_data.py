"""Conversion of SVG path data (the attribute ``d``) to points."""

import cmath
import math
import re
from typing import NamedTuple

import numpy as np

from robocov.arrays import concatenate_ranges
from robocov.typing import FloatArray, IntArray
from robocov_app.formats.geometry.curves import flatten_arcs, flatten_beziers
from robocov_app.formats.vector.svg.numbers import NUMBER, parse_number

MAX_COMMANDS = 150_000
"""Maximum number of commands of all paths in a file, counting repetitions without a letter, except lines."""
_COMMAND = re.compile(r"[\s,]*([MmZzLlHhVvCcSsQqTtAa])", re.ASCII)
_FLAG = re.compile(r"[\s,]*([01])")
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
"""Number of arguments of each command."""
_ARC_FLAGS = (3, 4)
"""Indices of the arguments of an arc that are flags, 0 or 1, which need no separator after them."""
_MIN_HALF_LENGTH = 1e-150
"""Half the length of the shortest chord of an arc, in semi-axes; the square of this is not yet zero."""


class Subpath(NamedTuple):
    """Points of a subpath, (k, 2), and whether it is closed."""

    points: FloatArray
    is_closed: bool


def parse_path(
    text: str, tolerance: float, max_points: int, max_commands: int = MAX_COMMANDS
) -> tuple[list[Subpath], int]:
    """Parse path data.

    Parameters
    ----------
    text : str
    tolerance : float
        Maximum distance between a curve and the lines that approximate it.
    max_points, max_commands : int

    Returns
    -------
    subpaths : list of Subpath
    commands : int
        Number of commands.

    Raises
    ------
    ValueError
        If the text is not valid path data, or if there are too many points or commands.
    """
    letters = sum(text.count(letter) + text.count(letter.lower()) for letter in _ARGUMENTS)
    if letters > max_commands:
        raise ValueError(f"expected at most {max_commands} commands, got more")
    pen = _Pen(max_points, max_commands)
    position = 0
    while match := _COMMAND.match(text, position):
        command = match[1]
        position = match.end()
        if not pen.commands and command not in "Mm":
            raise ValueError(f"character {position}: expected M, got {command} first")
        if command in "Zz":
            pen.close()
        else:
            values, position = _parse_arguments(text, position, command, pen)
            pen.execute(command, values)
    if text[position:].strip(" \t\r\n\f,"):
        got = text[position : position + 12].strip()
        raise ValueError(f"character {position + 1}: expected a command, got {got!r}")
    return pen.build_subpaths(tolerance), pen.commands


def _parse_arguments(text: str, position: int, command: str, pen: "_Pen") -> tuple[list[float], int]:
    """Parse the arguments of a command and of its repetitions without a letter.

    Returned are all arguments, and the position in the text after them.
    """
    kind = command.upper()
    count = _ARGUMENTS[kind]
    max_values = count * pen.count_remaining(kind)
    values: list[float] = []
    while True:
        is_flag = kind == "A" and len(values) % count in _ARC_FLAGS
        match = (_FLAG if is_flag else NUMBER).match(text, position)
        if match is None:
            break
        values.append(parse_number(match[1]))
        position = match.end()
        if len(values) > max_values:
            raise ValueError(f"character {position}: expected at most {pen.describe_limit(kind)}, got more")
    if not values or len(values) % count:
        got = text[position : position + 12].strip() or "the end"
        raise ValueError(f"character {position + 1}: expected a number, got {got!r}")
    return values, position


class _Bezier(NamedTuple):
    """A cubic Bézier curve, and the index of the vertex at its end."""

    end_vertex: int
    start: complex
    first_handle: complex
    second_handle: complex
    end: complex


class _Arc(NamedTuple):
    """An elliptic arc, center + u cos(a) + v sin(a), and the index of the vertex at its end."""

    end_vertex: int
    center: complex
    u: complex
    v: complex
    start: float
    sweep: float


class _FlatCurves(NamedTuple):
    """Curves as points.

    Attributes
    ----------
    end_vertices : (n,) int array
        Index of the vertex at the end of each curve.
    points : (k, 2) array
        Points of all curves, one curve after the other.
    counts : (n,) int array
        Number of points of each curve.
    """

    end_vertices: IntArray
    points: FloatArray
    counts: IntArray


class _Pen:
    """The pen and the path drawn so far. Positions are complex numbers, x + i y.

    Curves are only recorded while drawing, and all of them are converted to points at once at the end.
    """

    def __init__(self, max_points: int, max_commands: int) -> None:
        """Start without a path; points and commands of the path are limited."""
        self.commands = 0
        self._max_points = max_points
        self._max_commands = max_commands
        self._vertices: list[complex] = []
        self._position = 0j
        self._subpath_start = 0j
        self._handle = 0j
        self._last_kind = ""
        self._subpath_indices: list[int] = []
        self._is_closed: list[bool] = []
        self._beziers: list[_Bezier] = []
        self._arcs: list[_Arc] = []

    def count_remaining(self, kind: str) -> int:
        """Return the maximum number of further repetitions of a command."""
        points = self._max_points - len(self._vertices)
        if kind in "ML":
            return points
        return min(points, self._max_commands - self.commands)

    def describe_limit(self, kind: str) -> str:
        """Describe the limit on which the result of `count_remaining` is based."""
        points = self._max_points - len(self._vertices)
        if self.count_remaining(kind) == points:
            return f"{self._max_points} points"
        return f"{self._max_commands} commands"

    def execute(self, command: str, values: list[float]) -> None:
        """Execute a command with the arguments of one or several repetitions."""
        if command in "MmLl":
            self._draw(command, values[:2])
            if len(values) > 2:
                # Further positions after M or L are lines to them.
                self._draw_polyline(values[2:], is_relative=command.islower())
            return
        count = _ARGUMENTS[command.upper()]
        for start in range(0, len(values), count):
            self._draw(command, values[start : start + count])

    def close(self) -> None:
        """Close the subpath."""
        self._is_closed[-1] = True
        self._position = self._subpath_start
        self._last_kind = "Z"

    def build_subpaths(self, tolerance: float) -> list[Subpath]:
        """Return all subpaths with at least two points."""
        vertices = np.array(self._vertices, complex).view(float).reshape(-1, 2)
        curves = self._flatten_curves(tolerance)
        # A vertex at the end of a curve is repeated, and then replaced by the points of the curve.
        count = np.ones(len(vertices), dtype=np.intp)
        for flat in curves:
            count[flat.end_vertices] = flat.counts
        end = np.cumsum(count)
        points = vertices.repeat(count, axis=0)
        for flat in curves:
            first = end[flat.end_vertices] - count[flat.end_vertices]
            points[concatenate_ranges(first, count[flat.end_vertices])] = flat.points
        points[end - 1] = vertices
        if not self._subpath_indices:
            return []
        parts = np.split(points, (end - count)[self._subpath_indices[1:]])
        subpaths = [Subpath(part, closed) for part, closed in zip(parts, self._is_closed, strict=True)]
        return [subpath for subpath in subpaths if len(subpath.points) > 1]

    def _flatten_curves(self, tolerance: float) -> list[_FlatCurves]:
        """Approximate all Bézier curves, and all arcs, by points."""
        curves = []
        if self._beziers:
            # Complex rows; column 0 is the index of the vertex.
            rows = np.array(self._beziers)
            control = rows[:, 1:].copy().view(float).reshape(-1, 4, 2)
            points, counts = flatten_beziers(control, tolerance, self._max_points)
            curves.append(_FlatCurves(rows[:, 0].real.astype(np.intp), points, counts))
        if self._arcs:
            # Complex rows, whose columns are the attributes of `_Arc`.
            rows = np.array(self._arcs)
            centers, u, v = [rows[:, k : k + 1].copy().view(float) for k in (1, 2, 3)]
            points, counts = flatten_arcs(
                centers,
                u,
                v,
                starts=rows[:, 4].real,
                sweeps=rows[:, 5].real,
                tolerance=tolerance,
                maximum=self._max_points,
            )
            curves.append(_FlatCurves(rows[:, 0].real.astype(np.intp), points, counts))
        return curves

    def _draw(self, command: str, values: list[float]) -> None:
        """Execute a command with the arguments of one repetition."""
        kind = command.upper()
        origin = self._position if command.islower() else 0j
        self.commands += 1
        if kind == "M":
            self._position = origin + complex(*values)
            self._subpath_start = self._position
        if kind == "M" or self._last_kind == "Z":
            # After a Z without an M, the next subpath starts where the last one did.
            self._subpath_indices.append(len(self._vertices))
            self._is_closed.append(False)
            self._vertices.append(self._position)
        match kind:
            case "L":
                self._draw_line(origin + complex(*values))
            case "H":
                self._draw_line(complex(origin.real + values[0], self._position.imag))
            case "V":
                self._draw_line(complex(self._position.real, origin.imag + values[0]))
            case "A":
                self._draw_arc(values, origin + complex(*values[5:]))
            case "C" | "S" | "Q" | "T":
                pairs = zip(values[::2], values[1::2], strict=True)
                self._draw_bezier(kind, [origin + complex(x, y) for x, y in pairs])
        self._last_kind = kind

    def _draw_polyline(self, values: list[float], *, is_relative: bool) -> None:
        """Draw lines through positions x, y, x, y, ..., which may each be relative to the previous one."""
        points = np.array(values).view(complex)
        if is_relative:
            points = np.cumsum(points) + self._position
        self._vertices += points.tolist()
        self._position = self._vertices[-1]
        self._last_kind = "L"

    def _draw_line(self, end: complex) -> None:
        self._position = end
        self._vertices.append(end)

    def _draw_bezier(self, kind: str, points: list[complex]) -> None:
        """Draw a Bézier curve; S and T start with the mirror image of the previous handle."""
        start = self._position
        if kind in "ST":
            smooth_kinds = "CS" if kind == "S" else "QT"
            is_smooth = self._last_kind in smooth_kinds
            points = [2 * start - self._handle if is_smooth else start, *points]
        *handles, end = points
        self._handle = handles[-1]
        if len(handles) == 1:
            # A quadratic curve (Q, T) is raised to degree 3.
            handles = [point + 2 * (handles[0] - point) / 3 for point in (start, end)]
        first_handle, second_handle = handles
        self._beziers.append(_Bezier(len(self._vertices), start, first_handle, second_handle, end))
        self._draw_line(end)

    def _draw_arc(self, values: list[float], end: complex) -> None:
        """Draw an elliptic arc (SVG 2, appendix B.2.4 and B.2.5)."""
        rx = abs(values[0])
        ry = abs(values[1])
        angle = math.radians(values[2])
        is_large_arc = bool(values[3])
        is_positive_sweep = bool(values[4])
        start = self._position
        if end == start:
            return
        if rx == 0.0 or ry == 0.0:
            self._draw_line(end)
            return
        turn = complex(math.cos(angle), math.sin(angle))
        half_chord = (start - end) / 2 * turn.conjugate()
        # In units of the semi-axes, the ellipse is a circle of radius 1.
        point = complex(half_chord.real / rx, half_chord.imag / ry)
        half_length = abs(point)
        if half_length > 1.0:
            # The ellipse is too small to reach the end, and is scaled up until it does.
            rx = rx * half_length
            ry = ry * half_length
            point = point / half_length
            half_length = 1.0
        # Distance of the center from the middle of the chord, as a multiple of half the chord.
        distance = math.sqrt(1.0 / max(half_length, _MIN_HALF_LENGTH) ** 2 - 1.0)
        side = 1j if is_large_arc == is_positive_sweep else -1j
        middle = side * distance * point
        # Computed from the length of the chord, the sweep is accurate even for huge radii.
        sweep = 2.0 * math.asin(half_length)
        if is_large_arc:
            sweep = math.tau - sweep
        sweep = math.copysign(sweep, 1.0 if is_positive_sweep else -1.0)
        u = turn * rx
        v = turn * (1j * ry)
        center = (start + end) / 2 + u * middle.real + v * middle.imag
        self._arcs.append(_Arc(len(self._vertices), center, u, v, cmath.phase(point - middle), sweep))
        self._draw_line(end)
