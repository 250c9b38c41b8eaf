"""Marks of single robots: themselves, where they began and head, which failed, which one is selected."""

from functools import lru_cache, partial
from typing import Any

import numpy as np
import pygame

from robocov.arrays import Array
from robocov.voronoi import VoronoiPartition
from robocov_app.look import legend
from robocov_app.look.colors import mix
from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas, Glyph, LegendEntry, PlacedSprites, Sprite
from robocov_app.render.layers import says
from robocov_app.render.layout import fitted_radii, mark_size
from robocov_app.render.scene import Scene, are_centroids
from robocov_app.render.surface_cache import LatestValue

READABLE = 9.0  # radius of a drawn robot in pixels at scale 1 where it has room: a number can be read in it
SMALLEST_NUMBER = 6.6  # least size of a robot's number in pixels at scale 1
SMALLEST = 2.4  # radius below which no robot is drawn in pixels at scale 1


def drawn_radii(canvas: Canvas, scene: Scene) -> Array:
    """Return radii in steps of half a pixel: readable where there is room, in a crowd down to true size."""
    return _drawn_radii(scene, canvas.camera, canvas.scale)


@lru_cache(maxsize=8)  # several layers ask in each frame
def _drawn_radii(scene: Scene, camera: Camera, scale: float) -> Array:
    if scene.snapshot is None:
        return np.empty(0)
    centers, true = camera.to_pixels(scene.snapshot.positions), scene.team.radius * camera.zoom
    fitted = fitted_radii(centers, true, SMALLEST * scale, READABLE * scale)
    return np.asarray(rounded(np.minimum(fitted, 400.0)))


def rounded(pixels: Any) -> Any:
    """Return sizes in steps of half a pixel, so that few sprites are made."""
    return np.round(pixels * 2) / 2


class Starts:
    """Green rings where the robots began; their places are kept until the view changes."""

    def __init__(self) -> None:
        self._rings = LatestValue[PlacedSprites]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        def rings() -> PlacedSprites:
            assert scene.starts is not None
            centers = canvas.camera.to_pixels(scene.starts)
            radius = rounded(0.5 * mark_size(centers, 5.0 * canvas.scale, 9.0 * canvas.scale))
            return canvas.place_sprites([_ring(canvas, radius)], centers)

        view = canvas.camera, canvas.scale, canvas.theme.name, canvas.surface.get_size()
        canvas.surface.fblits(self._rings.get(scene.starts, view, rings), pygame.BLEND_PREMULTIPLIED)


def _ring(canvas: Canvas, radius: float) -> Sprite:
    return partial(sprites.render_ring, radius, canvas.theme.start, min(1.6 * canvas.scale, 0.4 * radius))


starts_legend = says(
    legend.START, lambda canvas, x, y: canvas.draw_sprite(_ring(canvas, 4.5 * canvas.scale), (x, y))
)


def draw_robots(canvas: Canvas, scene: Scene) -> None:
    scale, radii = canvas.scale, drawn_radii(canvas, scene)
    numbers = np.arange(len(radii)) + 1 if scene.numbers is None else np.array(scene.numbers)
    rings = np.minimum(1.6 * scale, rounded(0.3 * radii))
    sizes = sprites.choose_number_size(radii - rings, 1 + np.digitize(numbers, [10, 100, 1000]))
    written = np.where(sizes < SMALLEST_NUMBER * scale, 0, numbers)
    # in a crowd many look the same
    looks: dict[tuple[float, float, int, int], int] = {}
    columns = radii.tolist(), rings.tolist(), canvas.hues.tolist(), written.tolist()
    which = [looks.setdefault(look, len(looks)) for look in zip(*columns, strict=True)]
    discs = [_disc(canvas, radius, ring, hue, str(number or "")) for radius, ring, hue, number in looks]
    centers = canvas.camera.to_pixels(scene.now.positions)
    if scene.now.steering is not None:
        turns = np.rint(scene.now.steering[:, 0] * (sprites.N_NOSE_DIRECTIONS / (2.0 * np.pi))).astype(int)
        noses = [
            partial(
                sprites.render_nose,
                min(radius, sprites.MAX_FINE_RADIUS_PX),
                canvas.theme.ink,
                canvas.theme.background,
                turn,
            )
            for radius, turn in zip(radii.tolist(), (turns % sprites.N_NOSE_DIRECTIONS).tolist(), strict=True)
        ]
        unicycles = np.flatnonzero(scene.team.is_unicycle)
        canvas.draw_sprites(noses, centers[unicycles], unicycles)
    canvas.draw_sprites(discs, centers, np.array(which, dtype=int))


def _disc(canvas: Canvas, radius: float, ring: float, hue: int, number: str) -> Sprite:
    theme, edge = canvas.theme, mix(canvas.theme.background, canvas.theme.ink, 0.55)
    return partial(
        sprites.render_disc,
        radius,
        fill=theme.robots[hue],
        ring=theme.robot_ring,
        ring_width=ring,
        edge=edge,
        text=number,
    )


robots_legend = says(
    "robot",
    lambda canvas, x, y: canvas.draw_sprite(
        _disc(canvas, 6.5 * canvas.scale, 1.4 * canvas.scale, 0, ""), (x, y)
    ),
)


def draw_centroids(canvas: Canvas, scene: Scene) -> None:
    """Draw a plus at each centroid, or a times sign at each goal, but not where a robot has arrived."""
    kind, goals = _aims(scene)
    if not kind:
        return
    centers = canvas.camera.to_pixels(goals)
    away = np.hypot(*(centers - canvas.camera.to_pixels(scene.now.positions)).T)
    there = np.isfinite(away)
    arm = rounded(0.5 * mark_size(centers[there], 5.0 * canvas.scale, 11.0 * canvas.scale))
    canvas.draw_sprites([_cross(canvas, kind, arm)], centers[there & (away > drawn_radii(canvas, scene))])


def centroids_legend(scene: Scene) -> list[LegendEntry]:
    kind, _ = _aims(scene)
    return [LegendEntry(kind, _aim_glyph(kind))] if kind else []


def draw_goals(canvas: Canvas, scene: Scene) -> None:
    if scene.now.decision.goals is None:
        return
    goals = canvas.camera.to_pixels(scene.now.decision.goals)
    centers = canvas.camera.to_pixels(scene.now.positions)
    there = np.isfinite(goals).all(axis=1)
    for center, goal in zip(centers[there].tolist(), goals[there].tolist(), strict=True):
        canvas.draw_dashed_line(center, goal, canvas.theme.faint)
    canvas.draw_sprites([_cross(canvas, legend.GOAL)], goals)


def _aims(scene: Scene) -> tuple[str, Array]:
    """Return what the crosses are called, and where they are, (n, 2) m; an empty word for none."""
    goals = None if scene.snapshot is None else scene.snapshot.decision.goals
    if goals is None or scene.centroids is None:
        return "", np.empty((0, 2))
    cells = scene.now.decision.cells
    # those of what robots take for their cells, where they hear only some of the others: else the word would
    # change with each message that gets lost
    believed = scene.centroids if cells is None else cells.centroid
    if believed.shape == goals.shape and are_centroids(goals, believed):
        return legend.CELL_CENTROID, scene.centroids
    return legend.GOAL, goals


def _cross(canvas: Canvas, kind: str, arm: float | None = None) -> Sprite:
    arm, theme = 5.5 * canvas.scale if arm is None else arm, canvas.theme
    color, width, part = (theme.final, 1.8, 0.4) if kind == legend.GOAL else (theme.ink, 1.3, 0.3)
    width = min(width * canvas.scale, part * arm)
    return partial(
        sprites.render_cross,
        arm,
        color=color,
        halo=theme.background,
        width=width,
        is_diagonal=kind == legend.GOAL,
    )


def _aim_glyph(kind: str) -> Glyph:
    return lambda canvas, x, y: canvas.draw_sprite(_cross(canvas, kind), (x, y))


goals_legend = says(legend.GOAL, _aim_glyph(legend.GOAL), lambda scene: scene.now.decision.goals is not None)


def draw_failed(canvas: Canvas, scene: Scene) -> None:
    failed = canvas.camera.to_pixels(np.array(list(scene.failed.values())))
    working = canvas.camera.to_pixels(scene.snapshot.positions) if scene.snapshot else np.empty((0, 2))
    centers = np.concatenate([failed, working])
    own = [scene.get_failed_radius(number) for number in scene.failed]
    true = np.array([*own, *(scene.team.radius if scene.snapshot else ())]) * canvas.camera.zoom
    fitted = fitted_radii(centers, true, SMALLEST * canvas.scale, 0.85 * READABLE * canvas.scale)
    radii = rounded(np.minimum(fitted[: len(failed)], 400.0)).tolist()
    around = np.concatenate([radii, drawn_radii(canvas, scene)])
    for number, place, radius in zip(scene.failed, failed, radii, strict=True):
        _draw_wreck(canvas, place[0], place[1], radius)
        _label(canvas, str(number), place, radius, centers, around)


def _label(canvas: Canvas, text: str, at: Array, radius: float, centers: Array, around: Array) -> None:
    size = canvas.theme.small_text
    wide, high = canvas.measure_text(text, size, bold=True), canvas.scale_text_size(size)
    gap = 3.0 * canvas.scale
    rooms = []
    for side, up in ((1, 0), (-1, 0), (0, -1), (0, 1)):
        middle = at + np.array([side * (radius + gap + wide / 2), up * (radius + gap + 0.4 * high)])
        apart = np.maximum(np.abs(centers - middle) - np.array([wide / 2, 0.4 * high]), 0.0)
        room = float((np.hypot(apart[:, 0], apart[:, 1]) - around).min())
        # the first that is good enough: numbers do not hop as others pass by
        rooms.append((min(room, 0.5 * gap), middle.tolist()))
    canvas.draw_text(text, max(rooms, key=lambda each: each[0])[1], size=size, bold=True, anchor="middle")


def _draw_wreck(canvas: Canvas, x: float, y: float, radius: float) -> None:
    theme, scale = canvas.theme, canvas.scale
    fill, edge = mix(theme.background, theme.ink, 0.3), mix(theme.background, theme.ink, 0.75)
    ring_width = min(1.2 * scale, 0.25 * radius)
    disc = partial(sprites.render_disc, radius, fill=fill, ring=edge, ring_width=ring_width, edge=edge)
    canvas.draw_sprite(disc, (x, y))
    # beyond the edge: crossed out, not a sign on a button
    arm, width = rounded(1.1 * radius), min(1.7 * scale, 0.35 * radius)
    cross = partial(
        sprites.render_cross, arm, color=theme.ink, halo=theme.background, width=width, is_diagonal=True
    )
    canvas.draw_sprite(cross, (x, y))


failed_legend = says(legend.FAILED_ROBOT, lambda canvas, x, y: _draw_wreck(canvas, x, y, 6.0 * canvas.scale))


def draw_selection(canvas: Canvas, scene: Scene) -> None:
    """Draw a ring around the robot that is asked about; where messages fail, also what it believes."""
    assert scene.selected is not None
    robot, seen, cells, theme = scene.selected, scene.now.seen, scene.now.decision.cells, canvas.theme
    there = canvas.camera.to_pixels(scene.now.positions).tolist()
    if seen.reported_positions is not None:
        if isinstance(cells, VoronoiPartition) and len(cells.polygons[robot]) > 2:
            corners = canvas.camera.to_pixels(cells.polygons[robot])
            canvas.draw_outline(corners, theme.ink, canvas.scale_width(1.6 * theme.line))
        known = [robot, *seen.neighbors.list_neighbors(robot).tolist()]
        places = np.concatenate([seen.positions[[robot]], seen.get_neighbor_positions(robot)])
        for other, place in zip(known, canvas.camera.to_pixels(places).tolist(), strict=True):
            hue = int(canvas.hues[other])
            canvas.draw_dashed_line(there[other], place, mix(theme.robots[hue], theme.ink, 0.2), dash=3.0)
            _stamp_belief(canvas, hue, place)
    radius = drawn_radii(canvas, scene)[robot] + 4.0 * canvas.scale
    canvas.draw_sprite(partial(sprites.render_ring, radius, theme.ink, 2.2 * canvas.scale), there[robot])


def belief_legend(scene: Scene) -> list[LegendEntry]:
    assert scene.selected is not None
    if scene.now.seen.reported_positions is None:
        return []
    words = f"as robot {scene.get_number(scene.selected)} believes"
    return [LegendEntry(words, lambda canvas, x, y: _stamp_belief(canvas, 0, [x, y]))]


def _stamp_belief(canvas: Canvas, hue: int, place: list[float]) -> None:
    color = mix(canvas.theme.robots[hue], canvas.theme.ink, 0.2)
    canvas.draw_sprite(partial(sprites.render_ring, 5.0 * canvas.scale, color, 1.6 * canvas.scale), place)
