"""What a plot shows of the world: the map, and a whole run in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robocov_app.page import tone
from robocov_app.view.theme import ONE_HUE_EACH, Colour, Theme, mix, readable_on, robot_hues

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from robocov.environment import Environment
    from robocov.record import Record


def draw_map(axes: Axes, environment: Environment, theme: Theme) -> None:
    """Draw the obstacles, what of the region lies outside the boundary, and the region's outline."""
    from matplotlib.patches import PathPatch, Polygon
    from matplotlib.path import Path as Outline

    for part in environment.blocked.geoms:
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))
        axes.add_patch(
            PathPatch(
                outline,
                facecolor=tone(theme.obstacle),
                edgecolor=tone(theme.obstacle_edge),
                linewidth=0.8,
                zorder=2,
            )
        )
    axes.add_patch(
        Polygon(
            environment.region.vertices,
            closed=True,
            fill=False,
            edgecolor=tone(theme.boundary),
            linewidth=1.6,
            joinstyle="miter",
            clip_on=False,
            zorder=3,
        )
    )


def draw_run(axes: Axes, record: Record, theme: Theme, colours: str) -> None:
    """Draw map, final cells, trajectories, starts, final positions and centroids."""
    from matplotlib.collections import LineCollection, PolyCollection

    from robocov.voronoi import partition

    draw_map(axes, record.environment, theme)
    last, n = record.positions[-1], record.positions.shape[1]
    cells = partition(last, record.environment.region)
    hues = robot_hues(n, cells.adjacency)
    paper = colours == "paper"
    tint = 0.12 if paper else 0.9 * theme.tint
    polygons = [(cell, hue) for cell, hue in zip(cells.polygons, hues.tolist(), strict=True) if len(cell) > 2]
    axes.add_collection(
        PolyCollection(
            [cell for cell, _ in polygons],
            facecolors=[tone(mix(theme.background, theme.robots[hue], tint)) for _, hue in polygons],
            edgecolors=tone(mix(theme.background, theme.cell_edge, 0.75)),
            linewidths=0.7,
            zorder=1,
        ),
        autolim=False,
    )
    crowd = min(1.0, (30 / n) ** 0.5)
    lines = LineCollection(
        list(np.moveaxis(record.positions, 1, 0)),
        colors=[tone(colour) for colour in _line_colours(n, hues.tolist(), theme, paper)],
        linewidths=max(1.4 * crowd, 0.6),
        capstyle="round",
        joinstyle="round",
        zorder=4,
    )
    axes.add_collection(lines, autolim=False)
    begin = record.positions[0]
    axes.plot(*begin.T, zorder=5, **_start_style(theme, crowd))
    radius = _disc_points(axes, record)
    fills = [theme.final if paper else theme.robots[hue] for hue in hues.tolist()]
    axes.scatter(
        last[:, 0],
        last[:, 1],
        s=[(2 * r) ** 2 for r in radius],
        c=[tone(fill) for fill in fills],
        edgecolors=tone(theme.robot_ring),
        linewidths=max(1.1 * crowd, 0.5),
        zorder=7,
        clip_on=False,
    )
    axes.plot(*cells.centroid.T, zorder=6, **_centroid_style(theme, crowd))
    for robot, (point, r, fill) in enumerate(zip(last, radius, fills, strict=True), start=1):
        digits = len(str(robot))
        size = r * (1.25, 1.1, 0.85, 0.65)[min(digits, 4) - 1]
        if size >= 2.8:
            axes.text(
                float(point[0]),
                float(point[1]),
                str(robot),
                fontsize=size,
                fontweight="bold",
                color=tone(readable_on(fill)),
                ha="center",
                va="center_baseline",
                zorder=8,
            )


def _line_colours(n: int, hues: list[int], theme: Theme, paper: bool) -> list[Colour]:
    if paper:
        return [theme.trajectory] * n
    if n > ONE_HUE_EACH:
        return [mix(theme.trajectory, theme.background, 0.25)] * n
    return [mix(theme.robots[hue], theme.ink, 0.12) for hue in hues]


def _disc_points(axes: Axes, record: Record) -> list[float]:
    """Return each robot's radius in points: true to scale, but not below what can be read."""
    axes.apply_aspect()
    corners = axes.transData.transform([(0.0, 0.0), (1.0, 0.0)])
    zoom = float(corners[1, 0] - corners[0, 0]) * 72 / axes.figure.dpi
    area = record.environment.region.area * zoom**2
    least = float(np.clip(0.3 * np.sqrt(area / len(record.team)), 2.2, 6.4))
    return [float(max(r * zoom, least)) for r in record.team.radius]


def _start_style(theme: Theme, crowd: float = 1.0) -> dict[str, Any]:
    return {
        "linestyle": "none",
        "marker": "o",
        "markersize": 6.0 * max(crowd, 0.5),
        "markerfacecolor": "none",
        "markeredgecolor": tone(theme.start),
        "markeredgewidth": 1.4 * max(crowd, 0.6),
    }


def _centroid_style(theme: Theme, crowd: float = 1.0) -> dict[str, Any]:
    return {
        "linestyle": "none",
        "marker": "+",
        "markersize": 7.5 * max(crowd, 0.5),
        "markeredgecolor": tone(theme.ink),
        "markeredgewidth": 1.1 * max(crowd, 0.6),
    }


def map_handles(environment: Environment, theme: Theme) -> list[Artist]:
    """Return the legend's entries for what `draw_map` draws."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [Line2D([], [], color=tone(theme.boundary), linewidth=1.6, label="known region")]
    if not environment.blocked.is_empty:
        handles.append(
            Patch(
                facecolor=tone(theme.obstacle),
                edgecolor=tone(theme.obstacle_edge),
                linewidth=0.8,
                label="obstacle (unknown to robots)",
            )
        )
    return handles


def run_handles(record: Record, theme: Theme, colours: str) -> list[Artist]:
    """Return the legend's entries for what `draw_run` draws."""
    from matplotlib.lines import Line2D

    paper, n = colours == "paper", record.positions.shape[1]
    line = _line_colours(n, list(range(n)), theme, paper)[0]
    final: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markersize": 8.0,
        "markerfacecolor": tone(theme.final if paper else theme.robots[0]),
        "markeredgecolor": tone(theme.robot_ring),
    }
    return [
        Line2D([], [], label="start", **_start_style(theme)),
        Line2D([], [], color=tone(line), linewidth=1.4, label="trajectory"),
        Line2D([], [], label="final position", **final),
        Line2D([], [], label="cell centroid", **_centroid_style(theme)),
        Line2D([], [], color=tone(theme.cell_edge), linewidth=0.9, label="final Voronoi cell"),
        *map_handles(record.environment, theme)[1:],
    ]
