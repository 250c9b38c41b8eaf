"""Robots drawn with matplotlib: discs of their true sizes, with numbers in them or next to them."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from robocov.typing import BoolArray, FloatArray
from robocov_app.figures.map_drawing import compute_points_per_meter, to_meters, to_points
from robocov_app.figures.number_placement import Discs, place_numbers, select_discs
from robocov_app.figures.page import to_plot_color
from robocov_app.look.colors import Color, choose_text_color
from robocov_app.look.theme import Theme
from robocov_app.render.crowding import fit_radii

MAX_NUMBERED_ROBOTS = 30
"""In a larger team, numbers next to robots and starts would hide the trajectories."""
NUMBER_PT = 7.6
"""Text size of the number next to a robot."""
ROBOTS_ORDER = 7
"""Drawing order of robots."""
NUMBERS_ORDER = 9
"""Drawing order of numbers, above all marks."""
_MIN_DISC_PT = 2.4
"""Radius of the disc of a robot that would otherwise be too small to see."""
_MIN_CROWDED_DISC_PT = 1.2
"""The same where robots are close to each other."""
_MIN_INNER_NUMBER_PT = 6.2
"""Numbers that would be smaller are next to their robots instead of in them."""
_MAX_INNER_NUMBER_PT = 15.0
_NUMBER_SIZES = (1.25, 1.1, 0.85, 0.65)
"""Text sizes of numbers of one, two, three and more digits, in radii of the robot."""
_MAX_RING_WIDTH_PT = 1.1
_MAX_RING_WIDTH_FRACTION = 0.25
"""Maximum width of the ring of a robot, as a fraction of its radius."""
_NUMBER_HALO_PT = 1.8
"""Width of the edge in the color of the background that separates a number from what is below it."""


def draw_robots(
    axes: Axes, positions: FloatArray, radius: FloatArray, numbers: Sequence[int], theme: Theme
) -> None:
    """Draw robots as discs in a single color, with numbers.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    positions : (n, 2) array, m
    radius : (n,) array, m
    numbers : sequence of int
    theme : Theme
    """
    fills = [theme.final] * len(positions)
    discs = draw_discs(axes, positions, radius, fills, theme)
    is_inside = write_numbers_in_discs(axes, positions, discs.radii, numbers, fills)
    if len(positions) > MAX_NUMBERED_ROBOTS:
        return
    outside = np.flatnonzero(~is_inside)
    centers = place_numbers(select_discs(discs, outside), discs, text_size=NUMBER_PT)
    texts = [str(numbers[robot]) for robot in outside.tolist()]
    write_numbers(axes, centers, texts, [theme.ink] * len(texts), theme, size=NUMBER_PT)


def draw_discs(
    axes: Axes, positions: FloatArray, radius: FloatArray, fills: Sequence[Color], theme: Theme
) -> Discs:
    """Draw robots as discs of their true sizes, or of the minimum visible size.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    positions : (n, 2) array, m
    radius : (n,) array, m
    fills : sequence of Color
    theme : Theme

    Returns
    -------
    Discs
        The discs, in points of the page.
    """
    centers = to_points(axes, positions)
    true_radii = radius * compute_points_per_meter(axes)
    radii = fit_radii(centers, true_radii, _MIN_CROWDED_DISC_PT, _MIN_DISC_PT)
    axes.scatter(
        positions[:, 0],
        positions[:, 1],
        # The size of a scatter mark is the square of its diameter, in points.
        s=(2.0 * radii) ** 2,
        c=[to_plot_color(fill) for fill in fills],
        edgecolors=to_plot_color(theme.robot_ring),
        linewidths=np.minimum(_MAX_RING_WIDTH_PT, _MAX_RING_WIDTH_FRACTION * radii).tolist(),
        zorder=ROBOTS_ORDER,
        clip_on=False,
    )
    return Discs(centers, radii)


def write_numbers_in_discs(
    axes: Axes, positions: FloatArray, radii: FloatArray, numbers: Sequence[int], fills: Sequence[Color]
) -> BoolArray:
    """Write the numbers of the robots whose discs are large enough.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    positions : (n, 2) array, m
    radii : (n,) array
        Radii of the discs, points.
    numbers : sequence of int
    fills : sequence of Color
        Colors of the discs.

    Returns
    -------
    (n,) bool array
        Whether each number was written.
    """
    is_written = np.zeros(len(positions), dtype=bool)
    for row, (number, fill) in enumerate(zip(numbers, fills, strict=True)):
        digits = min(len(str(number)), len(_NUMBER_SIZES))
        size = min(radii[row] * _NUMBER_SIZES[digits - 1], _MAX_INNER_NUMBER_PT)
        if size >= _MIN_INNER_NUMBER_PT:
            is_written[row] = True
            axes.text(
                positions[row, 0],
                positions[row, 1],
                str(number),
                fontsize=size,
                fontweight="bold",
                color=to_plot_color(choose_text_color(fill)),
                ha="center",
                va="center_baseline",
                zorder=NUMBERS_ORDER,
            )
    return is_written


def write_numbers(
    axes: Axes,
    centers: FloatArray,
    texts: Sequence[str],
    colors: Sequence[Color],
    theme: Theme,
    *,
    size: float,
) -> None:
    """Write numbers next to robots or starts, with a halo that separates them from what is below.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    centers : (n, 2) array
        Centers of the texts, points from the lower left corner of the page.
    texts : sequence of str
    colors : sequence of Color
    theme : Theme
    size : float
        Text size, points.
    """
    halo = [withStroke(linewidth=_NUMBER_HALO_PT, foreground=to_plot_color(theme.background))]
    for (x, y), text, color in zip(to_meters(axes, centers).tolist(), texts, colors, strict=True):
        axes.text(
            x,
            y,
            text,
            fontsize=size,
            fontweight="bold",
            color=to_plot_color(color),
            ha="center",
            va="center_baseline",
            path_effects=halo,
            zorder=NUMBERS_ORDER,
        )


def build_robot_handle(label: str, fill: Color, theme: Theme) -> Artist:
    """Build a legend entry with a disc, for robots of one color."""
    return Line2D(
        [],
        [],
        label=label,
        linestyle="none",
        marker="o",
        markersize=8.0,
        markerfacecolor=to_plot_color(fill),
        markeredgecolor=to_plot_color(theme.robot_ring),
    )
