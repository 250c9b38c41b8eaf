"""Colors, line widths and text sizes, shared by the window, the films and the plots."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from heapq import heapify, heappop, heappush
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import IntArray
from robocov.errors import ParameterError, describe_unknown_name

Color: TypeAlias = tuple[int, int, int]  # red, green, blue, 0 to 255
ONE_HUE_EACH = 9  # up to so many robots each have a hue of their own; no eye tells more hues apart
MAP_COLORS = 6  # hues for larger teams, where only cells that share an edge must differ


def rgb(code: str) -> Color:
    return int(code[0:2], 16), int(code[2:4], 16), int(code[4:6], 16)


@lru_cache(maxsize=1000)  # for each of many robots in each frame
def mix(first: Color, second: Color, part: float) -> Color:
    """Return `first` with `part` (0 to 1) of `second` mixed in."""
    red, green, blue = (round(a + (b - a) * part) for a, b in zip(first, second, strict=True))
    return red, green, blue


def luminance(color: Color) -> float:
    """Return the relative luminance of WCAG 2, 0 for black to 1 for white."""
    channels = [c / 255 for c in color]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first: Color, second: Color) -> float:
    """Return the contrast ratio of WCAG 2, 1 (none) to 21 (black on white)."""
    low, high = sorted([luminance(first), luminance(second)])
    return (high + 0.05) / (low + 0.05)


def readable_on(color: Color) -> Color:
    """Return near-black or white, whichever is read better on `color`."""
    dark, light = (22, 27, 34), (255, 255, 255)
    return light if contrast(color, light) >= contrast(color, dark) else dark


# Paul Tol's "muted" scheme: nine hues that color-blind readers tell apart. The first six are also
# far apart as tints of cells, where sand and olive would be one, and serve as map colors.
_MUTED = ("CC6677", "88CCEE", "DDCC77", "44AA99", "332288", "AA4499", "117733", "882255", "999933")

HEAT_LEVELS = 12  # steps of the scale of colors of a grid of numbers
_QUIET_PART = 0.55  # of the scale of heat, so much is used for them: on all of it the ink can be read
TRAIL_CONTRAST = 2.4  # least contrast of a robot's trajectory with its own cell


@dataclass(frozen=True)
class Theme:
    """One look. Widths and text sizes are pixels at scale 1.

    `start`, `final`, `trajectory`: the paper's green, blue and red. `robots`: one for each of a small team;
    the first `MAP_COLORS` for cells of a large one. `heat`: from near to far. `tint`: of cells.
    """

    name: str
    background: Color
    panel: Color
    ink: Color
    faint: Color
    grid: Color
    boundary: Color
    obstacle: Color
    obstacle_edge: Color
    cell_edge: Color
    robot_ring: Color
    start: Color
    final: Color
    trajectory: Color
    velocity: Color
    controllers: dict[str, Color]
    others: tuple[Color, ...]
    forces: dict[str, Color]
    robots: tuple[Color, ...]
    heat: tuple[Color, ...]
    unreached: Color
    density: Color
    density_strength: float
    tint: float
    paper_tint: float
    text: float = 12.0
    small_text: float = 11.0
    line: float = 1.0
    trajectory_line: float = 1.8
    boundary_line: float = 2.0
    arrow_line: float = 2.0

    @property
    def moving_obstacle(self) -> Color:
        return mix(self.obstacle, self.background, 0.5)

    def cell(self, hue: int) -> Color:
        return mix(self.background, self.robots[hue], self.tint)

    def heat_table(self, count: int) -> NDArray[np.uint8]:
        """Return colors from near to far, (count, 3)."""
        anchors = np.array(self.heat, dtype=float)
        place = np.linspace(0.0, len(anchors) - 1.0, count)
        channels = [np.interp(place, np.arange(len(anchors)), channel) for channel in anchors.T]
        return np.asarray(np.rint(np.column_stack(channels)), dtype=np.uint8)

    @property
    def quiet_heat(self) -> list[Color]:
        """The `HEAT_LEVELS` colors of a grid from low to high, all quiet enough for text in ink."""
        rows = [round(_QUIET_PART * 199 * k / (HEAT_LEVELS - 1)) for k in range(HEAT_LEVELS)]
        return [(int(r), int(g), int(b)) for r, g, b in self.heat_table(200)[rows]]

    def controller(self, name: str) -> Color:
        return self.controllers.get(name, self.others[0])

    def trails(self, hues: list[int], paper: bool) -> list[Color]:
        if paper or len(hues) > ONE_HUE_EACH:
            return [self.trajectory if paper else mix(self.trajectory, self.background, 0.25)] * len(hues)
        return [self.trail(hue) for hue in hues]

    def trail(self, hue: int) -> Color:
        """Return the color of a robot's trajectory: its hue, but never too pale to be followed."""
        part = 0.12
        while contrast(color := mix(self.robots[hue], self.ink, part), self.cell(hue)) < TRAIL_CONTRAST:
            part += 0.04
        return color


_COLORS = {  # codes of the light look and of the dark one
    "background": ("FFFFFF", "13181F"),
    "panel": ("F4F6FA", "1B212B"),
    "ink": ("1B2330", "E8ECF2"),
    "faint": ("5A6678", "9AA6B8"),
    "grid": ("C3CCD8", "4A5566"),
    "boundary": ("414D60", "A3AEC0"),
    "obstacle": ("8C95A5", "485366"),
    "obstacle_edge": ("5B6576", "8793A6"),
    "cell_edge": ("66738A", "7A879B"),
    "robot_ring": ("FFFFFF", "FFFFFF"),
    "start": ("1E9E36", "46D160"),
    "final": ("1F5FE0", "5B9BFF"),
    "trajectory": ("D62222", "FF6B63"),
    "velocity": ("1F5FE0", "5B9BFF"),
    "unreached": ("E3DED4", "332E28"),
    "density": ("B4550A", "FFB45A"),
}
_CONTROLLERS = {"rapf": ("1F5FE0", "5B9BFF"), "rpf": ("D62222", "FF6B63"), "lloyd": ("118038", "46C46A")}
_FORCES = {
    "attraction": ("0B7A6F", "2DD4BF"),
    "repulsion_robots": ("D9480F", "FF9354"),
    "repulsion_obstacle": ("A81E62", "FF7AB6"),
    "viscosity": ("6B7280", "A9B4C4"),
    "resultant": ("1B2330", "FFFFFF"),
}
_OTHERS = "8A3FA8 7A5C00 28303C 007A8A D4127E", "CF8BE8 F0A94A E8ECF2 2DD4BF FF5CA4"
_HEAT = "FBFCFE DCE6F2 B4CBE4 86A9D3 5D84BF 3F60A2 2A3F78", "141B26 1B2F4B 23486F 31668F 4B88A6 78ADB8 B8D3C8"


def _theme(look: int, name: str, robots: Iterable[Color], **numbers: Any) -> Theme:
    def named(codes: dict[str, tuple[str, str]]) -> dict[str, Any]:
        return {key: rgb(code[look]) for key, code in codes.items()}

    others, heat = (tuple(map(rgb, codes[look].split())) for codes in (_OTHERS, _HEAT))
    looks: Any = {"controllers": named(_CONTROLLERS), "forces": named(_FORCES), "others": others}
    return Theme(name, robots=tuple(robots), heat=heat, **named(_COLORS), **looks, **numbers)


_HUES = [rgb(code) for code in _MUTED]
LIGHT = _theme(0, "light", _HUES, density_strength=0.5, tint=0.25, paper_tint=0.13)
# the darkest three hues would sink into the background
_PALER = [mix(hue, (255, 255, 255), 0.38 if luminance(hue) < 0.16 else 0.0) for hue in _HUES]
DARK = _theme(1, "dark", _PALER, density_strength=0.45, tint=0.26, paper_tint=0.19)
THEMES: dict[str, Theme] = {"light": LIGHT, "dark": DARK}


def theme_named(name: str | Theme) -> Theme:
    if isinstance(name, Theme):
        return name
    if name not in THEMES:
        raise ParameterError(describe_unknown_name("theme", name, THEMES))
    return THEMES[name]


def robot_hues(n: int, adjacency: IntArray | None = None, previous: IntArray | None = None) -> IntArray:
    """Return for each robot the row of its color: its own up to `ONE_HUE_EACH`, else shared.

    Cells that share an edge, (m, 2) `adjacency`, differ; hues of the frame before stay where they can.
    """
    if n <= ONE_HUE_EACH:
        return np.arange(n, dtype=np.intp)
    known = previous if previous is not None and len(previous) == n else None
    if adjacency is None:
        return np.arange(n, dtype=np.intp) % MAP_COLORS if known is None else known
    hues = None if known is None else _repaired(known.copy(), adjacency)
    return _dsatur(n, adjacency) if hues is None else hues


def _repaired(hues: IntArray, adjacency: IntArray) -> IntArray | None:
    """Recolor the vertices that conflict, and few others; None when that goes round in circles."""
    visits = np.zeros(len(hues), dtype=int)
    pairs, flat = hues[adjacency], adjacency.ravel()
    waiting = np.unique(adjacency[pairs[:, 0] == pairs[:, 1]]).tolist()
    while waiting:
        vertex = waiting.pop()
        neighbors = flat[np.flatnonzero(flat == vertex) ^ 1]
        around = hues[neighbors].tolist()
        if hues[vertex] not in around:
            continue
        visits[vertex] += 1
        if visits[vertex] > MAP_COLORS:
            return None
        turn = vertex + int(visits[vertex])
        hues[vertex] = min(range(MAP_COLORS), key=lambda h: (around.count(h), (h + turn) % MAP_COLORS))
        waiting += neighbors[hues[neighbors] == hues[vertex]].tolist()
    return hues


def _dsatur(n: int, adjacency: IntArray) -> IntArray:
    """Color a graph by DSATUR, all colors used alike; where neighbors show all, the rarest of them."""
    neighbors: list[list[int]] = [[] for _ in range(n)]
    for first, second in adjacency.tolist():
        neighbors[first].append(second)
        neighbors[second].append(first)
    hues = [-1] * n
    uses = [0] * MAP_COLORS
    seen: list[set[int]] = [set() for _ in range(n)]
    # what is in it of a vertex that is colored, or of whose neighbors more are by now, is passed over
    waiting = [(0, -len(neighbors[v]), v) for v in range(n)]
    heapify(waiting)
    while waiting:
        colors, _, vertex = heappop(waiting)
        if hues[vertex] >= 0 or -colors < len(seen[vertex]):
            continue
        around = [hues[other] for other in neighbors[vertex]]
        hue = min(range(MAP_COLORS), key=lambda h: (around.count(h), uses[h], h))
        hues[vertex] = hue
        uses[hue] += 1
        for other in neighbors[vertex]:
            if hues[other] < 0 and hue not in seen[other]:
                seen[other].add(hue)
                heappush(waiting, (-len(seen[other]), -len(neighbors[other]), other))
    return np.array(hues, dtype=np.intp)


def border_color(theme: Theme) -> Color:
    return mix(theme.ink, theme.background, 0.1)
