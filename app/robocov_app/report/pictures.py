"""Small pictures of maps and runs as SVG without a script: they print, and stand where no script may run.

Colours are CSS variables (`robocov_app.report.theme_css`): one picture suits light and dark.
"""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.render.density import density_label
from robocov_app.render.layout import fitted_radii, mark_size
from robocov_app.render.scene import MovingObstacle, moving_obstacles
from robocov_app.render.theme import ONE_HUE_EACH, robot_hues
from robocov_app.report.embedding import density_picture, has_path, lives
from robocov_app.runs.saved import roster_of

_MARGIN = 3.0  # pixels round the region
_FINE = 0.2  # pixels by which a line may be simplified
# robots up to which cells and trajectories are drawn: a larger team would make too large a picture
MOST_ROBOTS = 400


class Frame:
    """Transform from metres to the pixels of a picture of at most `width` by `height`."""

    def __init__(self, environment: Environment, width: float, height: float) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        room_x, room_y = width - 2 * _MARGIN, height - 2 * _MARGIN
        self.zoom = min(room_x / (high_x - low_x), room_y / (high_y - low_y))
        self.corner = np.array([low_x, high_y])
        self.width = round(self.zoom * (high_x - low_x) + 2 * _MARGIN, 1)
        self.height = round(self.zoom * (high_y - low_y) + 2 * _MARGIN, 1)

    def at(self, points: Array) -> Array:
        """Return (..., 2) m as pixels from the upper left corner."""
        return np.asarray((points - self.corner) * np.array([self.zoom, -self.zoom]) + _MARGIN)


def map_picture(environment: Environment, width: float = 300.0, height: float = 220.0) -> str:
    """Return a picture of a map as an SVG element, with its facts as its text."""
    frame = Frame(environment, width, height)
    return _svg(frame, _map_shapes(environment, frame, 0.0), map_sentence(environment))


def run_picture(
    record: Record,
    history: CostHistory | None,
    width: float = 300.0,
    height: float = 220.0,
    *,
    numbers: bool = False,
    hidden: bool = False,
) -> str:
    """Return a run as an SVG element; with `numbers` on robots, or `hidden` from screen readers."""
    frame = Frame(record.environment, width, height)
    n = len(record.team)
    last = record.positions[-1]
    parts: list[str] = []
    if n <= MOST_ROBOTS:
        cells, working = record.cells(), np.flatnonzero(record.working[-1])
        hues = robot_hues(n, working[cells.adjacency] if n > ONE_HUE_EACH else None).tolist()
        for cell, owner in zip(*cells.outlines, strict=True):
            hue = hues[working[int(owner)]]
            if len(cell) > 2:
                parts.append(f'<path class="cell c{hue}" d="{_path([frame.at(cell)], closed=True)}"/>')
    parts.append(_map_shapes(record.environment, frame, float(record.time[-1])))
    tracks = np.moveaxis(frame.at(record.positions), 1, 0)
    if has_path(record) and n <= MOST_ROBOTS:
        # before it joins, a robot goes nowhere
        began = np.argmax(record.present, axis=0).tolist()
        there = [track[first:] for track, first in zip(tracks, began, strict=True)]
        lines = [shapely.simplify(shapely.LineString(track), _FINE) for track in there if len(track) > 1]
        parts.append(f'<path class="way" d="{_path([np.asarray(line.coords) for line in lines])}"/>')
    joined = record.present.any(axis=0)
    began = np.argmax(record.present, axis=0)[joined]
    starts, ends = frame.at(record.positions[began, np.flatnonzero(joined)]), frame.at(last)
    ring = mark_size(starts, 2.4, 5.0) / 2
    parts += [f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="{ring:.1f}"/>' for x, y in starts]
    most = 9.0 if numbers else 4.5
    radii = fitted_radii(ends, record.team.radius * frame.zoom, 1.5, most)
    present, failed = record.present[-1], record.present[-1] & ~record.working[-1]
    for row, (number, (x, y), r) in enumerate(zip(roster_of(record).numbers, ends, radii, strict=True)):
        if failed[row]:
            parts.append(_wreck(x, y, r))
        if failed[row] or not present[row]:
            continue
        parts.append(f'<circle class="robot" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>')
        size = r * (1.35, 1.15, 0.9, 0.7)[min(len(str(number)), 4) - 1]
        if numbers and size >= 6.0:
            parts.append(
                f'<text x="{x:.1f}" y="{y + 0.36 * size:.1f}" font-size="{size:.1f}">{number}</text>'
            )
    return _svg(frame, "".join(parts), None if hidden else run_sentence(record, history))


def _wreck(x: float, y: float, radius: float) -> str:
    """Return a robot that has failed, crossed out."""
    arm = 0.62 * radius
    cross = "".join(f"M{x - arm:.1f} {y - s * arm:.1f}L{x + arm:.1f} {y + s * arm:.1f}" for s in (1, -1))
    disc = f'<circle class="failed" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"/>'
    return f'{disc}<path class="failed" d="{cross}"/>'


def changes_sentence(record: Record) -> str:
    """Return when robots joined and failed, in words; empty where all were there and worked."""
    numbers, end = roster_of(record).numbers, float(record.time[-1] - record.time[0])
    words = []
    for number, (begin, failed) in zip(numbers, lives(record), strict=True):
        if 0.0 < begin <= end:
            words.append((begin, f"robot {number} joins at {begin:.1f} s"))
        if failed is not None:
            words.append((failed, f"robot {number} fails at {failed:.1f} s"))
    text = ", ".join(change for _, change in sorted(words))
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def map_sentence(environment: Environment) -> str:
    """Return what a picture of a map shows, in words."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    blocked = 100.0 * (1.0 - environment.free_area / environment.region.area)
    count = len(environment.obstacles)
    weighed = density_label(environment)
    moving = sum(obstacle.path is not None for obstacle in environment.obstacles)
    obstacles = {0: "without obstacles", 1: "with one obstacle"}.get(count, f"with {count} obstacles")
    obstacles += f" ({moving} moving)" if moving else ""
    return (
        f"Map {environment.name}: {high_x - low_x:.4g} m by {high_y - low_y:.4g} m {obstacles}, "
        f"{environment.free_area:.4g} m² free, {blocked:.0f} % of the known region blocked"
        f"{', ' if weighed else ''}{weighed}."
    )


def run_sentence(record: Record, history: CostHistory | None) -> str:
    """Return what a picture of a run shows, in words."""
    n = len(record.team)
    span = record.time[-1] - record.time[0]
    start = f" from start {record.start}" if record.start else ""
    text = (
        f"{record.label} on map {record.environment.name}: trajectories of {n} robot{'s' if n > 1 else ''}"
        f"{start} over {span:.4g} s."
    )
    if record.conditions is not None and (changes := changes_sentence(record)):
        text += f" {changes}"
    if history is not None and np.isfinite(history.mean_distance[[0, -1]]).all():
        first, final = history.mean_distance[[0, -1]]
        word = "falls" if final < first else "goes"
        weighed = ", weighed by φ," if density_label(record.environment) else ""
        text += (
            f" The mean distance to the nearest robot{weighed} {word} from {first:.3f} m to {final:.3f} m."
        )
        if history.mean_time is not None and np.isfinite(history.mean_time[[0, -1]]).all():
            first, final = history.mean_time[[0, -1]]
            text += f" The mean time until the first is there goes from {first:.3f} s to {final:.3f} s."
    return text


def _svg(frame: Frame, content: str, sentence: str | None) -> str:
    label = 'aria-hidden="true"' if sentence is None else f'role="img" aria-label="{escape(sentence)}"'
    # no size of its own: the page gives it a width, and the view box the height
    return (
        f'<svg class="robocov-picture" viewBox="0 0 {frame.width:g} {frame.height:g}" {label}>{content}</svg>'
    )


def _map_shapes(environment: Environment, frame: Frame, time: float) -> str:
    region = _path([frame.at(environment.region.vertices)], closed=True)
    blocked = shapely.simplify(environment.at(time).blocked, _FINE / frame.zoom)
    rings = [
        frame.at(np.asarray(ring.coords)[:-1])
        for part in shapely.get_parts(blocked)
        for ring in (part.exterior, *part.interiors)
    ]
    shapes = f'<path class="blocked" d="{_path(rings, closed=True)}"/>' if rings else ""
    for obstacle in moving_obstacles(environment, time):
        shapes += _motion(obstacle, environment, frame)
    return f'{_density_image(environment, frame)}{shapes}<path class="region" d="{region}"/>'


def _motion(obstacle: MovingObstacle, environment: Environment, frame: Frame) -> str:
    """Return a moving obstacle: its shape, its path as a dashed line, and an arrow where it heads."""
    seen = shapely.get_parts(shapely.intersection(obstacle.polygon, environment.region.polygon))
    rings = [
        frame.at(np.asarray(ring.coords)[:-1])
        for part in seen
        if isinstance(part, shapely.Polygon)
        for ring in (part.exterior, *part.interiors)
    ]
    along = 7.0 * obstacle.heading * np.array([1.0, -1.0])
    across, middle = 0.45 * along[::-1] * np.array([-1.0, 1.0]), frame.at(obstacle.middle)
    arrow = [middle - along, middle + along]
    head = [middle + 0.2 * along + across, middle + along, middle + 0.2 * along - across]
    return (
        f'<path class="blocked moving" d="{_path(rings, closed=True)}"/>'
        f'<path class="motion" d="{_path([frame.at(obstacle.path)])}"/>'
        f'<path class="heading" d="{_path([np.array(arrow), np.array(head)])}"/>'
    )


def _density_image(environment: Environment, frame: Frame) -> str:
    """Return the shading of the density as an image within the picture; empty without one."""
    address = density_picture(environment)
    wide, high = frame.width - 2 * _MARGIN, frame.height - 2 * _MARGIN
    return (
        f'<image x="{_MARGIN:g}" y="{_MARGIN:g}" width="{wide:g}" height="{high:g}" '
        f'preserveAspectRatio="none" href="{address}"/>'
        if address
        else ""
    )


def _path(lines: Iterable[Array], *, closed: bool = False) -> str:
    """Return the path of lines of (k, 2) px: relative, in tenths of a pixel, that no error adds up."""
    words = []
    for line in lines:
        if len(line) == 0:
            continue
        tenths = np.rint(line * 10).astype(int)
        steps = np.diff(tenths, axis=0)
        steps = steps[(steps != 0).any(axis=1)]
        x, y = (tenths[0] / 10).tolist()
        moves = " ".join(f"{dx / 10:g} {dy / 10:g}" for dx, dy in steps.tolist())
        words.append(f"M{x:g} {y:g}" + (f"l{moves}" if moves else "h0") + ("z" if closed else ""))
    return "".join(words)
