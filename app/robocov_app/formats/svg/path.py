"""The language of SVG: numbers, lengths, transforms, paths, and how elements are painted."""

import cmath
import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array, concatenate_ranges
from robocov.errors import MapError
from robocov_app.formats.colours import Colour, mix_with_white, parse_css_colour
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.geometry.curves import flatten_arcs, flatten_beziers
from robocov_app.formats.geometry.frames import build_frame

# nothing is given back once it is taken (++, *+): else a million digits before a wrong letter take for ever
_DECIMAL = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?"
NUMBER = re.compile(rf"[\s,]*+({_DECIMAL})", re.ASCII)
_LENGTH = re.compile(rf"\s*+({_DECIMAL})\s*+([A-Za-z]*+|%)\s*+", re.ASCII)
_FUNCTION = re.compile(r"[\s,]*([A-Za-z]+)\s*\(([^()]*)\)")
_MAX_NUMBER = 1e30
_PIXELS = {  # user units in a unit of length (CSS Values 4, section 6.2)
    "": 1.0, "px": 1.0, "in": 96.0, "cm": 96 / 2.54, "mm": 96 / 25.4, "q": 96 / 101.6, "pt": 4 / 3, "pc": 16.0
}  # fmt: skip
PIXEL = 0.0254 / 96  # a user unit in metres, where nothing says otherwise
MAX_DRAWS = 150_000  # commands of all paths, with or without their letter; vertices of polylines are none
_REFERENCE = re.compile(r"""\s*url\(\s*["']?#([^"')]*)["']?\s*\)""")
_COMMAND = re.compile(r"[\s,]*([MmZzLlHhVvCcSsQqTtAa])", re.ASCII)
_FLAG = re.compile(r"[\s,]*([01])")
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def parse_number(text: str) -> float:
    value = float(text)
    if not abs(value) <= _MAX_NUMBER:
        raise ValueError(f"expected a number up to {_MAX_NUMBER:g}, got {text[:20]}")
    return 0.0 if abs(value) < 1.0 / _MAX_NUMBER else value


def parse_numbers(text: str) -> list[float]:
    """Return the numbers of a list as that of ``points``; ValueError when something else is in it."""
    found, at = [], 0
    while match := NUMBER.match(text, at):
        found.append(parse_number(match[1]))
        at = match.end()
    if text[at:].strip(" \t\r\n\f,"):
        raise ValueError(f"expected a number, got {text[at : at + 20].strip()!r}")
    return found


def parse_length(text: str, whole: float | None = None) -> float:
    """Return a length in user units; `whole`: what a percentage is of. ValueError when it is none."""
    match = _LENGTH.fullmatch(text)
    unit = match[2].lower() if match else ""
    if match is None or not (unit in _PIXELS or (unit == "%" and whole is not None)):
        raise ValueError(f"expected a length in px, mm, cm, in, pt, pc or %, got {text[:30]!r}")
    value = parse_number(match[1])
    return value * whole / 100.0 if unit == "%" and whole is not None else value * _PIXELS[unit]


def build_affine(
    a: float = 1.0, b: float = 0.0, c: float = 0.0, d: float = 1.0, e: float = 0.0, f: float = 0.0
) -> Array:
    """Return the (3, 3) matrix that takes (x, y, 1) to (a x + c y + e, b x + d y + f, 1)."""
    return np.array([[a, c, e], [b, d, f], [0.0, 0.0, 1.0]])


def compose(outer: Array, inner: Array) -> Array:
    """Return the matrix of both, the inner one first; ValueError when it makes things too large."""
    both = outer @ inner
    if not (np.abs(both) <= _MAX_NUMBER).all():
        raise ValueError(f"a transform to coordinates beyond {_MAX_NUMBER:g}")
    return np.asarray(both)


def compute_stretch(matrix: Array) -> tuple[float, float]:
    """Return by how much a matrix makes lengths longer, at least and at most: its singular values."""
    (a, c), (b, d) = matrix[:2, :2].tolist()
    # by hand: a decomposition by LAPACK, for each shape, takes as long as all else that is read of it
    half, turned = math.hypot(a + d, b - c) / 2, math.hypot(a - d, b + c) / 2
    return abs(half - turned), half + turned


def parse_transform(text: str) -> Array:
    """Return the matrix of a ``transform``, whose last function comes first; ValueError on anything else."""
    matrix, at = build_affine(), 0
    while match := _FUNCTION.match(text, at):
        function = _FUNCTIONS.get(match[1].lower())
        # CSS writes units where attributes have none
        values = parse_numbers(re.sub(r"(?<=[\d.])(?:px|deg)\b", "", match[2]))
        if function is None or len(values) not in function[0]:
            raise ValueError(f"expected a transform, got {match[0].strip()[:40]!r}")
        matrix = compose(matrix, function[1](*values))
        at = match.end()
    if text[at:].strip(" \t\r\n,") not in ("", "none"):
        raise ValueError(f"expected a transform, got {text[at:].strip()[:40]!r}")
    return matrix


_FUNCTIONS: dict[str, tuple[tuple[int, ...], Callable[..., Array]]] = {  # counts of numbers, and matrix
    "matrix": ((6,), build_affine),
    "translate": ((1, 2), lambda x, y=0.0: build_affine(e=x, f=y)),
    "translatex": ((1,), lambda x: build_affine(e=x)),
    "translatey": ((1,), lambda y: build_affine(f=y)),
    "scale": ((1, 2), lambda x, y=None: build_affine(x, d=x if y is None else y)),
    "scalex": ((1,), lambda x: build_affine(a=x)),
    "scaley": ((1,), lambda y: build_affine(d=y)),
    "rotate": (
        (1, 3),
        lambda turn, x=0.0, y=0.0: build_frame(x, y, math.radians(turn)) @ build_affine(e=-x, f=-y),
    ),
    "skewx": ((1,), lambda angle: build_affine(c=math.tan(math.radians(angle)))),
    "skewy": ((1,), lambda angle: build_affine(b=math.tan(math.radians(angle)))),
}


def fit_view_box(box: tuple[float, float, float, float], width: float, height: float, how: str = "") -> Array:
    """Return the matrix that fits a ``viewBox`` into a viewport from [0, 0] on (SVG 2, section 8.2).

    `how`: ``preserveAspectRatio``; empty is the default, ``xMidYMid meet``.
    """
    align, _, rule = how.strip().partition(" ")
    x, y = width / box[2], height / box[3]
    if align.lower() == "none":
        return build_affine(x, d=y) @ build_affine(e=-box[0], f=-box[1])
    scale = max(x, y) if rule.strip() == "slice" else min(x, y)
    align = align or "xMidYMid"
    parts = {"xmin": 0.0, "xmid": 0.5, "xmax": 1.0, "ymin": 0.0, "ymid": 0.5, "ymax": 1.0}
    left = (width - scale * box[2]) * parts.get(align[:4].lower(), 0.5)
    top = (height - scale * box[3]) * parts.get(align[4:].lower(), 0.5)
    return build_affine(scale, d=scale, e=left, f=top) @ build_affine(e=-box[0], f=-box[1])


def parse_path(
    text: str, tolerance: float, most: int, draws: int = MAX_DRAWS
) -> tuple[list[tuple[Array, bool]], int]:
    """Return the subpaths of path data, (k, 2) points and whether they were closed; and how many commands.

    `tolerance`: largest distance of a curve from its points. `most`, `draws`: points and commands at most.
    Raises ValueError where it is no path data, or has more; the message says which character.
    """
    if sum(text.count(letter) for command in _ARGUMENTS for letter in (command, command.lower())) > draws:
        raise ValueError(f"expected at most {draws} commands, got more")
    pen = _Pen()
    at = 0
    while match := _COMMAND.match(text, at):
        command, at = match[1], match.end()
        if not pen.draws and command not in "Mm":
            raise ValueError(f"character {at}: expected M, got {command} first")
        if command in "Zz":
            pen.close()
            continue
        values, at = pen.arguments(text, at, command, most, draws)
        count = _ARGUMENTS[command.upper()]
        if command in "MmLl":
            pen.draw(command, values[:2])
            if len(values) > 2:  # lines through all that follow
                pen.polyline(values[2:], relative=command.islower())
        else:
            for k in range(0, len(values), count):
                pen.draw(command, values[k : k + count])
    if text[at : at + 1].strip(" \t\r\n\f,") or text[at:].strip(" \t\r\n\f,"):
        raise ValueError(f"character {at + 1}: expected a command, got {text[at : at + 12].strip()!r}")
    return pen.finished(tolerance, most), pen.draws


class _Pen:
    """Pen position and path so far, as x + i y; curves become points all together at the end, for speed."""

    def __init__(self) -> None:
        self.draws = 0
        self.vertices: list[complex] = []
        self.at = self.start = self.handle = 0j
        self.last = ""
        self._begins: list[int] = []
        self._closed: list[bool] = []
        self._beziers: list[tuple[complex, ...]] = []
        self._arcs: list[tuple[complex, ...]] = []

    def arguments(self, text: str, at: int, command: str, most: int, draws: int) -> tuple[list[float], int]:
        values: list[float] = []
        kind = command.upper()
        count, flags = _ARGUMENTS[kind], (3, 4) if kind == "A" else ()
        points, commands = most - len(self.vertices), draws - self.draws
        room = count * (points if kind in "ML" else min(points, commands))
        while match := (_FLAG if len(values) % count in flags else NUMBER).match(text, at):
            values.append(parse_number(match[1]))
            at = match.end()
            if len(values) > room:
                many = f"{most} points" if room == count * points else f"{draws} commands"
                raise ValueError(f"character {at}: expected at most {many}, got more")
        if not values or len(values) % count:
            found = text[at : at + 12].strip() or "the end"
            raise ValueError(f"character {at + 1}: expected a number, got {found!r}")
        return values, at

    def draw(self, command: str, v: list[float]) -> None:
        kind, origin = command.upper(), self.at if command.islower() else 0j
        self.draws += 1
        if kind == "M":
            self.at = self.start = origin + complex(*v)
        if kind == "M" or self.last == "Z":  # after a Z the next subpath begins where the last did
            self._begins.append(len(self.vertices))
            self._closed.append(False)
            self.vertices.append(self.at)
        match kind:
            case "L":
                self._line(origin + complex(*v))
            case "H":
                self._line(complex(origin.real + v[0], self.at.imag))
            case "V":
                self._line(complex(self.at.real, origin.imag + v[0]))
            case "A":
                self._arc(v, origin + complex(*v[5:]))
            case "C" | "S" | "Q" | "T":
                self._curve(kind, [origin + complex(*pair) for pair in zip(v[::2], v[1::2], strict=True)])
        self.last = kind

    def polyline(self, values: list[float], *, relative: bool) -> None:
        points = np.array(values).view(complex)
        self.vertices += (np.cumsum(points) + self.at if relative else points).tolist()
        self.at = self.vertices[-1]
        self.last = "L"

    def close(self) -> None:
        self._closed[-1] = True
        self.at = self.start
        self.last = "Z"

    def finished(self, tolerance: float, most: int) -> list[tuple[Array, bool]]:
        vertices = np.array(self.vertices, complex).view(float).reshape(-1, 2)
        count = np.ones(len(vertices), dtype=np.intp)
        curves = []
        if self._beziers:
            rows = np.array(self._beziers)
            flat = flatten_beziers(rows[:, 1:].copy().view(float).reshape(-1, 4, 2), tolerance, most)
            curves.append((rows[:, 0].real.astype(np.intp), *flat))
        if self._arcs:
            rows = np.array(self._arcs)
            centre, u, v = (rows[:, k : k + 1].copy().view(float) for k in (1, 2, 3))
            flat = flatten_arcs(
                centre, u, v, rows[:, 4].real, rows[:, 5].real, tolerance=tolerance, maximum=most
            )
            curves.append((rows[:, 0].real.astype(np.intp), *flat))
        for index, _, steps in curves:
            count[index] = steps
        end = np.cumsum(count)
        all_points = vertices.repeat(count, axis=0)
        for index, points, _ in curves:
            all_points[concatenate_ranges(end[index] - count[index], count[index])] = points
        all_points[end - 1] = vertices
        parts = np.split(all_points, (end - count)[self._begins[1:]]) if self._begins else []
        return [(part, closed) for part, closed in zip(parts, self._closed, strict=True) if len(part) > 1]

    def _line(self, end: complex) -> None:
        self.at = end
        self.vertices.append(end)

    def _curve(self, kind: str, points: list[complex]) -> None:
        """Draw a Bézier curve; S and T begin with the mirror image of the handle before them."""
        if kind in "ST":
            smooth = self.last in ("CS" if kind == "S" else "QT")
            points = [2 * self.at - self.handle if smooth else self.at, *points]
        *handles, end = points
        self.handle = handles[-1]
        if len(handles) == 1:  # the same curve as one of degree 3
            handles = [place + 2 * (handles[0] - place) / 3 for place in (self.at, end)]
        self._beziers.append((len(self.vertices), self.at, *handles, end))
        self._line(end)

    def _arc(self, given: list[float], end: complex) -> None:
        """Draw an elliptic arc (SVG 2, appendix B.2.4 and B.2.5)."""
        rx, ry, angle = abs(given[0]), abs(given[1]), math.radians(given[2])
        if end == self.at:
            return
        if rx == 0.0 or ry == 0.0:
            self._line(end)
            return
        turn = complex(math.cos(angle), math.sin(angle))
        half = (self.at - end) / 2 * turn.conjugate()
        # along the axes, where the ellipse is a circle of radius 1
        place = complex(half.real / rx, half.imag / ry)
        size = abs(place)
        if size > 1.0:  # too small to reach: as large as it takes
            rx, ry, place = rx * size, ry * size, place / size
        ratio = math.sqrt(max(1.0 / max(min(size, 1.0), 1e-150) ** 2 - 1.0, 0.0))
        middle = (1j if given[3] == given[4] else -1j) * ratio * place
        # the chord is twice the size: exact for huge radii too
        sweep = 2.0 * math.asin(min(size, 1.0))
        sweep = math.copysign(math.tau - sweep if given[3] else sweep, 1.0 if given[4] else -1.0)
        u, v = turn * rx, turn * (1j * ry)
        centre = (self.at + end) / 2 + u * middle.real + v * middle.imag
        self._arcs.append((len(self.vertices), centre, u, v, cmath.phase(place - middle), sweep))
        self._line(end)


Style: TypeAlias = Mapping[str, str]  # properties by name, as they are written
INHERITED = {  # by elements from groups, with their defaults (SVG 2, section 13)
    "color": "black", "fill": "black", "fill-opacity": "1", "fill-rule": "nonzero",
    "stroke": "none", "stroke-opacity": "1", "stroke-width": "1", "stroke-dasharray": "none",
    "stroke-linecap": "butt", "stroke-linejoin": "miter", "stroke-miterlimit": "4",
    "visibility": "visible",
}  # fmt: skip
_PROPERTIES = (*INHERITED, "display", "opacity", "transform", "clip-path", "mask")
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)")
_IMPORTANT = re.compile(r"!\s*important\s*$", re.IGNORECASE)
_HARMLESS = re.compile(r"@(?:charset|font-face|keyframes|media|namespace|page)\b", re.IGNORECASE)
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_AT_RULE_PARTS = re.compile(r"[{};]")
MAX_TEXT, MAX_RULES, MAX_WORK = 1_000_000, 10_000, 500_000  # letters, rules, rules looked at


class _Rule(NamedTuple):
    """A rule of a style sheet, for what has all `marks`; the second of its properties are important."""

    marks: frozenset[str]
    weight: tuple[int, int, int, int]
    properties: tuple[dict[str, str], dict[str, str]]


class StyleSheet:
    """The rules of the file `where`, of tags, classes and ids; others, as in @supports, are `strange`."""

    def __init__(self, where: str) -> None:
        self.where, self.strange = where, 0
        self._keyed: dict[str, list[_Rule]] = {}
        self._count = self._size = self._work = 0

    def add(self, text: str) -> None:
        """Add the rules of a text. Raises MapError when there are too many."""
        self._size += len(text)
        if self._size > MAX_TEXT:
            raise MapError(f"{self.where}: expected style sheets of at most {MAX_TEXT} characters, got more")
        text = text.replace("<!--", " ").replace("-->", " ")
        # up to the last end of a comment: to look for one that is not there takes for ever
        commented, end, text = text.rpartition("*/")
        text = _COMMENT.sub(" ", commented + end) + text
        for rule in self._without_at_rules(text).split("}")[:-1]:
            before, brace, body = rule.rpartition("{")
            if not brace:
                continue
            properties = _by_importance(parse_declarations(body))
            for selector in before.rpartition("{")[2].split(","):
                self._add(selector.strip(), properties)

    def of(self, element: Element) -> dict[str, str]:
        """Return an element's own properties; MapError when there are too many rules for too many."""
        attributes = element.attributes
        found = {name: attributes[name].strip() for name in _PROPERTIES if name in attributes}
        marks = {element.tag, f"#{attributes.get('id', '')}"}
        marks |= {f".{name}" for name in attributes.get("class", "").split()}
        looked_at = [rule for key in ("", *marks) for rule in self._keyed.get(key, ())]
        self._work += len(looked_at)
        if self._work > MAX_WORK:
            raise MapError(f"{self.where}: too many rules for too many elements")
        rules = [rule for rule in looked_at if rule.marks <= marks]
        chosen = [rule.properties for rule in sorted(rules, key=lambda rule: rule.weight)]
        chosen.append(_by_importance(parse_declarations(attributes.get("style", ""))))
        for k in (0, 1):
            for properties in chosen:
                found |= properties[k]
        return found

    def _without_at_rules(self, text: str) -> str:
        """Return a style sheet without its @ rules, which hold for other media, or name other files."""
        kept, at = [], 0
        while (begin := text.find("@", at)) >= 0:
            kept.append(text[at:begin])
            # other media and fonts change no shape
            self.strange += not _HARMLESS.match(text, begin)
            at, depth = len(text), 0
            for part in _AT_RULE_PARTS.finditer(text, begin):
                depth += (part[0] == "{") - (part[0] == "}")
                if depth <= 0 and part[0] != "{":
                    at = part.end()
                    break
        return "".join([*kept, text[at:]])

    def _add(self, selector: str, properties: tuple[dict[str, str], dict[str, str]]) -> None:
        match = _SELECTOR.fullmatch(selector)
        if match is None or not selector or self._count >= MAX_RULES:
            self.strange += 1
            return
        tag = [match[1]] if match[1] not in (None, "*") else []
        marks = re.findall(r"[.#][\w-]+", match[2])
        ids = sum(mark[0] == "#" for mark in marks)
        self._count += 1
        weight = ids, len(marks) - ids, len(tag), self._count
        key = [*tag, *marks][-1] if tag or marks else ""
        self._keyed.setdefault(key, []).append(_Rule(frozenset([*tag, *marks]), weight, properties))


def parse_declarations(text: str) -> dict[str, str]:
    pairs = (part.partition(":") for part in text.split(";") if ":" in part)
    return {name.strip().lower(): value.strip() for name, _, value in pairs}


def _by_importance(properties: dict[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the properties that are not marked as important, and those that are, without the mark."""
    important = {name: value for name, value in properties.items() if _IMPORTANT.search(value)}
    plain = {name: value for name, value in properties.items() if name not in important}
    return plain, {name: _IMPORTANT.sub("", value).rstrip() for name, value in important.items()}


def inherit_style(parent: Style, own: Style) -> dict[str, str]:
    return {
        name: parent[name] if (value := own.get(name, "inherit")) in ("inherit", "unset") else value
        for name in INHERITED
    }


def is_painted(style: Style, what: str) -> bool:
    """Return whether a fill or a stroke is seen at all."""
    if style[what].lower() in ("none", "transparent") or _is_zero(style[f"{what}-opacity"]):
        return False
    paint = parse_css_colour(style[what])
    return paint is None or paint[1] > 0.0


def compute_visible_colour(
    style: Style, what: str, opacity: float, gradient_colour: Callable[[str], str | None]
) -> Colour | None:
    """Return the colour of a fill or a stroke, mixed with white where it is translucent.

    Parameters
    ----------
    style : Style
    what : str
        ``fill`` or ``stroke``.
    opacity : float
        Of the element and of the groups around it.
    gradient_colour : callable
        Gives the colour of the gradient with a name, as it is written, or None.

    Returns
    -------
    colour : Colour or None
        None where it is not known, as of a pattern.
    """
    written = style[what]
    if match := _REFERENCE.match(written):
        written = gradient_colour(match[1]) or written[match.end() :].strip()
    if written.casefold() == "currentcolor":
        written = style["color"]
    paint = parse_css_colour(written)
    if paint is None:
        return None
    colour, alpha = paint
    return mix_with_white(colour, alpha * opacity * parse_opacity(style[f"{what}-opacity"]))


def parse_opacity(text: str) -> float:
    """Return an opacity from 0 to 1; what is no number is 1."""
    text = text.strip()
    try:
        value = float(text.rstrip("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        return 1.0
    return min(max(value, 0.0), 1.0) if value == value else 1.0


def is_hidden(own: Style) -> bool:
    return own.get("display", "").lower() == "none" or _is_zero(own.get("opacity", "1"))


def _is_zero(number: str) -> bool:
    with suppress(ValueError):
        return float(number.strip().rstrip("%")) == 0.0
    return False
