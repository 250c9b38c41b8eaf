"""Small pictures of maps and runs as SVG without a script, in CSS variables: for light, dark and paper."""

import base64
import io
from collections.abc import Iterable
from html import escape

import numpy as np
import shapely
from PIL import Image

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import format_count
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.look.colors import mix
from robocov_app.look.robot_colors import MAX_OWN_HUES, choose_robot_hues
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.density import density_label, dots, shading
from robocov_app.render.layout import fitted_radii, mark_size
from robocov_app.render.scene import moving_obstacles
from robocov_app.runs.saved_runs import build_roster

_MARGIN = 3.0  # pixels round the region
_FINE = 0.2  # pixels by which a line may be simplified
_DOTS = 80  # dots along the longer side of the picture of a density
# seconds between the first moment and the last, if there are no others, above which they tell no path
SPARSE = 1.5
# robots up to which cells and trajectories are drawn: a larger team would make too large a picture
MOST_ROBOTS = 400


class Frame:
    """Transform from meters to the pixels of a picture of at most `width` by `height`."""

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


def density_picture(environment: Environment) -> str:
    """Return a ``data:image/png`` of the density over the region's box, clear outside; empty without one."""
    if environment.density is None or environment.density.is_uniform:
        return ""
    picture = shading(environment, _DOTS, LIGHT)
    # one color for light and dark: it is between the two
    picture[..., :3] = mix(LIGHT.density, DARK.density, 0.5)
    x, y = np.meshgrid(*dots(environment, _DOTS))
    inside = environment.region.contains(np.column_stack([x.ravel(), y.ravel()]))
    picture[~inside.reshape(x.shape), 3] = 0
    file = io.BytesIO()
    Image.fromarray(picture[::-1]).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def rings_of(area: shapely.Geometry) -> list[Array]:
    """Return the rings of polygons, (k, 2) m each, open, of each polygon the outer one first."""
    return [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(area))]


def has_path(record: Record) -> bool:
    """Return whether there is more than the first moment and the last, to tell where the robots went."""
    return len(record) > 2 or (len(record) == 2 and float(record.time[1] - record.time[0]) <= SPARSE)


def lives(record: Record) -> list[tuple[float, float | None]]:
    """Return when each robot is first there (never: after the end) and fails (never: None), s."""
    since = record.time - record.time[0]
    found: list[tuple[float, float | None]] = []
    for present, working in zip(record.present.T, record.working.T, strict=True):
        begins, failed = np.flatnonzero(present), np.flatnonzero(present & ~working)
        begin = float(since[begins[0]]) if len(begins) else float(since[-1]) + 1.0
        found.append((begin, float(since[failed[0]]) if len(failed) else None))
    return found


def map_picture(environment: Environment, width: float = 300.0, height: float = 220.0) -> str:
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
    n, last = len(record.team), record.positions[-1]
    parts: list[str] = []
    if n <= MOST_ROBOTS:
        cells, working = record.cells(), np.flatnonzero(record.working[-1])
        hues = choose_robot_hues(n, working[cells.adjacency] if n > MAX_OWN_HUES else None).tolist()
        for cell, owner in zip(*cells.outlines, strict=True):
            hue = hues[working[int(owner)]]
            if len(cell) > 2:
                parts.append(f'<path class="cell c{hue}" d="{_path([frame.at(cell)], closed=True)}"/>')
    parts.append(_map_shapes(record.environment, frame, float(record.time[-1])))
    # before it joins, a robot goes nowhere
    began, joined = np.argmax(record.present, axis=0), record.present.any(axis=0)
    if has_path(record) and n <= MOST_ROBOTS:
        tracks = np.moveaxis(frame.at(record.positions), 1, 0)
        there = [track[first:] for track, first in zip(tracks, began, strict=True)]
        lines = [shapely.simplify(shapely.LineString(track), _FINE) for track in there if len(track) > 1]
        parts.append(f'<path class="way" d="{_path(map(shapely.get_coordinates, lines))}"/>')
    starts, ends = frame.at(record.positions[began[joined], np.flatnonzero(joined)]), frame.at(last)
    ring = mark_size(starts, 2.4, 5.0) / 2
    parts += [f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="{ring:.1f}"/>' for x, y in starts]
    radii = fitted_radii(ends, record.team.radius * frame.zoom, 1.5, 9.0 if numbers else 4.5)
    states = zip(record.present[-1], record.working[-1], strict=True)
    for number, (x, y), r, (there, works) in zip(
        build_roster(record).numbers, ends, radii, states, strict=True
    ):
        if not there:
            continue
        kind = "robot" if works else "failed"
        parts.append(f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>')
        size = r * (1.35, 1.15, 0.9, 0.7)[min(len(str(number)), 4) - 1]
        if not works:  # crossed out
            a = 0.62 * r
            ends_of = ((y - s * a, y + s * a) for s in (1, -1))
            cross = "".join(f"M{x - a:.1f} {low:.1f}L{x + a:.1f} {high:.1f}" for low, high in ends_of)
            parts.append(f'<path class="failed" d="{cross}"/>')
        elif numbers and size >= 6.0:
            below = y + 0.36 * size
            parts.append(f'<text x="{x:.1f}" y="{below:.1f}" font-size="{size:.1f}">{number}</text>')
    return _svg(frame, "".join(parts), None if hidden else run_sentence(record, history))


def map_sentence(environment: Environment) -> str:
    low_x, low_y, high_x, high_y = environment.region.bounds
    blocked = 100.0 * (1.0 - environment.free_area / environment.region.area)
    count, weighed = len(environment.obstacles), density_label(environment)
    moving = sum(obstacle.path is not None for obstacle in environment.obstacles)
    obstacles = {0: "without obstacles", 1: "with one obstacle"}.get(count, f"with {count} obstacles")
    obstacles += f" ({moving} moving)" if moving else ""
    return (
        f"Map {environment.name}: {high_x - low_x:.4g} m by {high_y - low_y:.4g} m {obstacles}, "
        f"{environment.free_area:.4g} m² free, {blocked:.0f} % of the known region blocked"
        f"{', ' if weighed else ''}{weighed}."
    )


def run_sentence(record: Record, history: CostHistory | None) -> str:
    robots, span = format_count(len(record.team), "robot"), record.time[-1] - record.time[0]
    start = f" from start {record.start}" if record.start else ""
    head = f"{record.label} on map {record.environment.name}: trajectories of"
    words = [f"{head} {robots}{start} over {span:.4g} s."]
    changes = []  # who joined and who failed
    for number, (begin, failed) in zip(build_roster(record).numbers, lives(record), strict=True):
        if record.conditions is not None and 0.0 < begin <= span:
            changes.append((begin, f"robot {number} joins at {begin:.1f} s"))
        if record.conditions is not None and failed is not None:
            changes.append((failed, f"robot {number} fails at {failed:.1f} s"))
    if changes:
        text = ", ".join(change for _, change in sorted(changes))
        words.append(f"{text[0].upper()}{text[1:]}.")
    if history is not None and np.isfinite(history.mean_distance[[0, -1]]).all():
        first, final = history.mean_distance[[0, -1]]
        goes = "falls" if final < first else "goes"
        weighed = ", weighed by φ," if density_label(record.environment) else ""
        change = f"{goes} from {first:.3f} m to {final:.3f} m"
        words.append(f"The mean distance to the nearest robot{weighed} {change}.")
        if history.mean_time is not None and np.isfinite(history.mean_time[[0, -1]]).all():
            first, final = history.mean_time[[0, -1]]
            words.append(f"The mean time until the first is there goes from {first:.3f} s to {final:.3f} s.")
    return " ".join(words)


def _svg(frame: Frame, content: str, sentence: str | None) -> str:
    label = 'aria-hidden="true"' if sentence is None else f'role="img" aria-label="{escape(sentence)}"'
    # no size of its own: the page gives it a width, and the view box the height
    box = f"0 0 {frame.width:g} {frame.height:g}"
    return f'<svg class="robocov-picture" viewBox="{box}" {label}>{content}</svg>'


def _map_shapes(environment: Environment, frame: Frame, time: float) -> str:
    """Return the shading of the density, what is blocked, what moves, and the boundary of the region."""
    shapes = ""
    if address := density_picture(environment):
        wide, high = frame.width - 2 * _MARGIN, frame.height - 2 * _MARGIN
        box = f'x="{_MARGIN:g}" y="{_MARGIN:g}" width="{wide:g}" height="{high:g}"'
        shapes = f'<image {box} preserveAspectRatio="none" href="{address}"/>'
    rings = rings_of(shapely.simplify(environment.at(time).blocked, _FINE / frame.zoom))
    if rings:
        shapes += f'<path class="blocked" d="{_path(map(frame.at, rings), closed=True)}"/>'
    for obstacle in moving_obstacles(environment, time):
        seen = shapely.intersection(obstacle.polygon, environment.region.polygon)
        along = 7.0 * obstacle.heading * np.array([1.0, -1.0])
        across, middle = 0.45 * along[::-1] * np.array([-1.0, 1.0]), frame.at(obstacle.middle)
        arrow = np.array([middle - along, middle + along])
        head = np.array([middle + 0.2 * along + across, middle + along, middle + 0.2 * along - across])
        shapes += (
            f'<path class="blocked moving" d="{_path(map(frame.at, rings_of(seen)), closed=True)}"/>'
            f'<path class="motion" d="{_path([frame.at(obstacle.path)])}"/>'
            f'<path class="heading" d="{_path([arrow, head])}"/>'
        )
    region = _path([frame.at(environment.region.vertices)], closed=True)
    return f'{shapes}<path class="region" d="{region}"/>'


def _path(lines: Iterable[Array], *, closed: bool = False) -> str:
    """Return the path of lines of (k, 2) px: relative, in tenths of a pixel, that no error adds up."""
    words = []
    for line in lines:
        tenths = np.rint(line * 10).astype(int)
        steps = np.diff(tenths, axis=0)
        steps = steps[(steps != 0).any(axis=1)]
        x, y = (tenths[0] / 10).tolist()
        moves = " ".join(f"{dx / 10:g} {dy / 10:g}" for dx, dy in steps.tolist())
        words.append(f"M{x:g} {y:g}" + (f"l{moves}" if moves else "h0") + ("z" if closed else ""))
    return "".join(words)
