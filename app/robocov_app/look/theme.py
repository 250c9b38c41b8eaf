"""The light and the dark theme: colors, line widths and text sizes of all pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocov.errors import ParameterError, describe_unknown_name
from robocov_app.look.colors import Color, compute_luminance, mix, parse_hex_color

HEAT_LEVELS = 12
"""Number of colors in a grid of numbers."""
_MUTED_FRACTION = 0.55
"""Fraction of the heat scale that grids of numbers use; on the rest, their text would be illegible."""
_MIN_HUE_LUMINANCE = 0.16
"""Luminance below which a hue can hardly be distinguished from the background of the dark theme."""


@dataclass(frozen=True)
class Theme:
    """Colors and sizes of pictures. Line widths and text sizes are pixels at scale 1.

    Attributes
    ----------
    name : str
        "light" or "dark".
    background, panel : Color
        Colors behind maps and curves, and behind the controls of windows.
    ink, faint : Color
        Colors of primary and of secondary texts.
    grid, boundary, obstacle, obstacle_edge, cell_edge, robot_ring, velocity, unreached, warning : Color
        Colors of these elements. `unreached` is free space that no robot can reach.
    start, final, trajectory : Color
        The article's green, blue and red.
    controllers : dict of str to Color
        Colors of the curves of the article's controllers.
    others : tuple of Color
        Colors of the curves of other controllers.
    forces : dict of str to Color
        Colors of the arrows of force terms, by the name of the term.
    robots : tuple of Color
        Hues of robots; see `hues`.
    heat : tuple of Color
        Color scale of distances, from near to far.
    density, density_strength : Color, float
        Color of the density, and its opacity where it is highest.
    fine_grid_share, coarse_grid_share : float
        Fractions of the grid color in the lines of a grid under a map.
    tints : tuple of float
        Fraction of each robot's hue in the color of its cell. They differ, so that cells differ in lightness
        and color-blind readers tell neighbors apart.
    paper_tint : float
        Factor of the tints in the paler scheme of the paper.
    text, small_text, line, trajectory_line, boundary_line, arrow_line : float
        Sizes of texts and widths of lines.
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
    warning: Color
    density: Color
    density_strength: float
    fine_grid_share: float
    coarse_grid_share: float
    tints: tuple[float, ...]
    paper_tint: float
    text: float = 12.0
    small_text: float = 11.0
    line: float = 1.0
    trajectory_line: float = 1.8
    boundary_line: float = 2.0
    arrow_line: float = 2.0

    @property
    def accent(self) -> Color:
        """Color of selections and of other highlights in windows."""
        return self.final

    @property
    def error(self) -> Color:
        """Color of errors."""
        return self.trajectory

    @property
    def cut_off(self) -> Color:
        """Color of the hatching on areas that no robot can reach from the start."""
        return self.others[0]

    @property
    def moving_obstacle(self) -> Color:
        """Color of moving obstacles."""
        return mix(self.obstacle, self.background, 0.5)

    @property
    def failed_robot(self) -> Color:
        """Color of failed robots."""
        return mix(self.background, self.ink, 0.3)

    @property
    def failed_trajectory(self) -> Color:
        """Color of trajectories of failed robots, which is visible on all cells."""
        return mix(self.background, self.ink, 0.55)

    @property
    def legend_cell(self) -> Color:
        """Color of a cell in legends: that with the strongest tint."""
        return self.get_cell_color(self.tints.index(max(self.tints)))

    @property
    def geodesic_border(self) -> Color:
        """Color of the borders of geodesic cells on a distance map."""
        return mix(self.ink, self.background, 0.1)

    @property
    def muted_heat(self) -> list[Color]:
        """Colors of a grid of numbers from low to high; text in `ink` is legible on all of them."""
        # Evenly spaced rows of the first part of a table with 200 colors.
        rows = [round(_MUTED_FRACTION * 199 * level / (HEAT_LEVELS - 1)) for level in range(HEAT_LEVELS)]
        return [(int(red), int(green), int(blue)) for red, green, blue in self.build_heat_table(200)[rows]]

    def get_cell_color(self, hue: int) -> Color:
        """Return the color of the cell of a robot with a hue, an index into `robots`."""
        return mix(self.background, self.robots[hue], self.tints[hue])

    def get_paper_cell_color(self, hue: int) -> Color:
        """Return the paler color of a cell in the scheme of the paper."""
        return mix(self.background, self.robots[hue], self.paper_tint * self.tints[hue])

    def get_controller_color(self, name: str) -> Color:
        """Return the color of the curves of a controller; all that are not from the article share one."""
        return self.controllers.get(name, self.others[0])

    def build_heat_table(self, count: int) -> NDArray[np.uint8]:
        """Interpolate the color scale of distances to a number of colors.

        Parameters
        ----------
        count : int

        Returns
        -------
        (count, 3) uint8 array
            Red, green and blue from near to far.
        """
        anchors = np.array(self.heat, dtype=float)
        positions = np.linspace(0.0, len(anchors) - 1.0, count)
        channels = [np.interp(positions, np.arange(len(anchors)), channel) for channel in anchors.T]
        return np.asarray(np.rint(np.column_stack(channels)), dtype=np.uint8)


# Codes of each color in the light theme and in the dark theme.
_COLORS = {
    "background": ("FFFFFF", "13181F"),
    "panel": ("F4F6FA", "1B212B"),
    "ink": ("1B2330", "E8ECF2"),
    "faint": ("5A6678", "9AA6B8"),
    "grid": ("C3CCD8", "4A5566"),
    "boundary": ("414D60", "A3AEC0"),
    "obstacle": ("525C6F", "9AA6BA"),
    "obstacle_edge": ("3E485A", "C3CBD8"),
    "cell_edge": ("66738A", "7A879B"),
    "robot_ring": ("FFFFFF", "FFFFFF"),
    "start": ("17862C", "46D160"),
    "final": ("1F5FE0", "5B9BFF"),
    "trajectory": ("D62222", "FF6B63"),
    "velocity": ("1F5FE0", "5B9BFF"),
    "unreached": ("E3DED4", "332E28"),
    "warning": ("B86A00", "FFC04D"),
    "density": ("B4550A", "FFB45A"),
}
_CONTROLLERS = {
    "rapf": ("1F5FE0", "5B9BFF"),
    "rpf": ("D62222", "FF6B63"),
    "lloyd": ("00795E", "2EC4A0"),
}
_FORCES = {
    "attraction": ("0B7A6F", "2DD4BF"),
    "repulsion_robots": ("D9480F", "FF9354"),
    "repulsion_obstacle": ("A81E62", "FF7AB6"),
    "viscosity": ("6B7280", "A9B4C4"),
    "resultant": ("1B2330", "FFFFFF"),
}
_OTHERS = (
    ("8A3FA8", "CF8BE8"),
    ("7A5C00", "F0A94A"),
    ("28303C", "E8ECF2"),
    ("005F9E", "A8D8FF"),
    ("D4127E", "FF5CA4"),
)
_HEAT = (
    ("FBFCFE", "141B26"),
    ("DCE6F2", "1B2F4B"),
    ("B4CBE4", "23486F"),
    ("86A9D3", "31668F"),
    ("5D84BF", "4B88A6"),
    ("3F60A2", "78ADB8"),
    ("2A3F78", "B8D3C8"),
)
# Paul Tol's "muted" scheme: nine hues that color-blind readers can distinguish. The first six are also far
# apart as tints of cells, where sand and olive would look alike, so large teams use these.
_MUTED = ("CC6677", "88CCEE", "DDCC77", "44AA99", "332288", "AA4499", "117733", "882255", "999933")

_LIGHT_CODES = 0
_DARK_CODES = 1


def _build_theme(name: str, codes: int, robots: Sequence[Color], **numbers: Any) -> Theme:
    """Build a theme from the first or the second of each pair of codes."""
    return Theme(
        name=name,
        controllers=_select_named(_CONTROLLERS, codes),
        forces=_select_named(_FORCES, codes),
        others=tuple(parse_hex_color(pair[codes]) for pair in _OTHERS),
        heat=tuple(parse_hex_color(pair[codes]) for pair in _HEAT),
        robots=tuple(robots),
        **_select_named(_COLORS, codes),
        **numbers,
    )


def _select_named(colors: dict[str, tuple[str, str]], codes: int) -> dict[str, Any]:
    """Return the first or the second of each pair of colors, by name."""
    return {name: parse_hex_color(pair[codes]) for name, pair in colors.items()}


def _lighten(hue: Color) -> Color:
    """Return a hue, lightened if it would hardly be visible on the background of the dark theme."""
    return mix(hue, (255, 255, 255), 0.38 if compute_luminance(hue) < _MIN_HUE_LUMINANCE else 0.0)


_HUES = [parse_hex_color(code) for code in _MUTED]
# Found by a search: the smallest color difference between two of the first six cells, for readers with normal
# and with color-deficient vision, is as large as possible, while obstacles stand out on every cell, and cells
# stand out on the background.
_LIGHT_TINTS = (0.42, 0.40, 0.23, 0.17, 0.36, 0.34, 0.42, 0.33, 0.33)
_DARK_TINTS = (0.39, 0.30, 0.27, 0.47, 0.55, 0.16, 0.14, 0.39, 0.38)
LIGHT = _build_theme(
    "light",
    _LIGHT_CODES,
    _HUES,
    density_strength=0.4,
    fine_grid_share=0.32,
    coarse_grid_share=0.75,
    tints=_LIGHT_TINTS,
    paper_tint=0.55,
)
# Equal shares of the grid color would look stronger on a dark background.
DARK = _build_theme(
    "dark",
    _DARK_CODES,
    [_lighten(hue) for hue in _HUES],
    density_strength=0.28,
    fine_grid_share=0.2,
    coarse_grid_share=0.5,
    tints=_DARK_TINTS,
    paper_tint=0.75,
)
THEMES: dict[str, Theme] = {"light": LIGHT, "dark": DARK}


def get_theme(name: str | Theme) -> Theme:
    """Return the theme with a name; a theme is returned as it is.

    Raises
    ------
    ParameterError
        If there is no theme with this name.
    """
    if isinstance(name, Theme):
        return name
    if name not in THEMES:
        raise ParameterError(describe_unknown_name("theme", name, THEMES))
    return THEMES[name]
