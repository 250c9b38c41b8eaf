"""Layers on top of the sheet, in drawing order."""

from functools import partial
from typing import Protocol

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.hatching import render_hatching
from robocov_app.editor.canvas.scene import EditorScene
from robocov_app.editor.canvas.sheet import Sheet
from robocov_app.editor.canvas.start_labels import draw_start_label
from robocov_app.editor.edits import paths
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch
from robocov_app.editor.tools.handles import compute_frame, list_handles
from robocov_app.editor.tools.tool_overlay import DraggedImage
from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.crowding import fit_radii
from robocov_app.render.layers.robots import READABLE_RADIUS_PX
from robocov_app.render.surface_cache import LatestValue

# Shares of the strong color in a mix with the background.
PATH_SHARE = 0.6
EDGE_SHARE = 0.55  # a thin gray line around each robot separates robots that touch
HOVERED_SHARE = 0.7
FRAME_SHARE = 0.6

# Lengths in pixels at scale 1.
OUTLINE_WIDTH_PX = 2.0  # of selected and dragged objects
HOVERED_WIDTH_PX = 1.5
BOUNDARY_EXTRA_WIDTH_PX = 0.5  # the outline of the boundary is wider by this
FRAME_DASH_PX = 3.0
ROBOT_GAP_PX = 2.4  # between enlarged robots
MIN_ROBOT_RADIUS_PX = 3.0  # at any scale
ROBOT_RING_PX = 1.4
MAX_RING_RADII = 0.3  # maximum width of the ring, relative to the radius of the robot

OUTLINED_DOT_SCALE = 1.3  # enlargement of the rings of a selected start
MANY_OBJECTS = 200  # the outlines of more selected objects are cached as an image
DRAGGED_TINT = 0.22  # share of the accent color in obstacles that are dragged
MAX_RADIUS_PX = 400.0  # maximum radius of a robot that is drawn as a sprite
MIN_NUMBER_PX = 7.5  # at scale 1; robots too small for this text size have no number
_PREMULTIPLIED = pygame.BLEND_PREMULTIPLIED


class OverlayLayer(Protocol):
    """A layer on top of the sheet."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the layer."""


class DraggedObstacles:
    """Obstacles that the active tool drags, changes or copies, and the outlines of dragged starts."""

    def __init__(self, sheet: Sheet) -> None:
        self._sheet = sheet
        self._image: LatestValue[Surface] = LatestValue()

    def draw(self, scene: EditorScene) -> None:
        """Draw the obstacles."""
        if scene.tool_overlay.dragged_image is not None:
            self._draw_dragged_image(scene, scene.tool_overlay.dragged_image)
        elif scene.sketch is not scene.committed_sketch:
            theme = scene.canvas.theme
            # The sheet shows all obstacles of the committed map except for the hidden ones.
            keys_on_sheet = scene.committed_sketch.index_by_key.keys() - scene.hidden_keys
            items = [item for item in scene.sketch.obstacles if item.key not in keys_on_sheet]
            self._sheet.draw_items(scene.canvas, items, mix(theme.obstacle, theme.accent, DRAGGED_TINT))

    def _draw_dragged_image(self, scene: EditorScene, dragged: DraggedImage) -> None:
        camera = scene.view.camera
        image = self._image.get_or_compute(
            scene.committed_sketch,
            (dragged.selection, camera, scene.view.theme.name),
            lambda: self._render_image(scene, dragged.selection),
        )
        dx = round(camera.zoom * dragged.offset[0])
        dy = round(-(camera.zoom * dragged.offset[1]))
        scene.surface.blit(image, (dx, dy), special_flags=_PREMULTIPLIED)

    def _render_image(self, scene: EditorScene, selection: Selection) -> Surface:
        """Render the selected objects onto a transparent surface, at their positions before the drag."""
        theme = scene.view.theme
        canvas = scene.view.build_transparent_canvas()
        items = [item for item in scene.committed_sketch.obstacles if item.key in selection.items]
        fill = mix(theme.obstacle, theme.accent, DRAGGED_TINT)
        self._sheet.draw_items(canvas, items, fill, theme.accent)
        for owner in selection.owners - selection.items:
            draw_object_outline(
                canvas, self._sheet, scene.committed_sketch, owner, color=theme.accent, width=OUTLINE_WIDTH_PX
            )
        return canvas.surface


class Passages:
    """Hatching of areas that robots cannot reach, and the narrowest gap."""

    def __init__(self) -> None:
        self._hatching: LatestValue[tuple[Surface, Rect] | None] = LatestValue()

    def draw(self, scene: EditorScene) -> None:
        """Draw the hatching and the gap."""
        measurement = scene.measurement
        if measurement is None:
            return
        view = scene.view
        look = (view.camera, view.theme.name, view.scale, view.size)
        hatching = self._hatching.get_or_compute(
            measurement, look, lambda: render_hatching(view, measurement)
        )
        if hatching is not None:
            surface, position = hatching
            scene.surface.blit(surface, position, special_flags=_PREMULTIPLIED)
        if measurement.gap is not None:
            overlay.draw_gap(scene.canvas, measurement.gap, measurement.radius)


class Paths:
    """Paths of moving obstacles, and the obstacles along them while their motion is shown."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the paths and, while motion is shown, each obstacle at its current position."""
        sketch = scene.tool_overlay.pending or scene.sketch
        theme = scene.canvas.theme
        for key in paths.list_moving_obstacles(sketch):
            item = sketch.get_item(key)
            path = item.shape.path
            assert path is not None
            color = mix(theme.background, theme.ink, PATH_SHARE)
            if key in scene.editor.selection.items:
                color = theme.accent
            overlay.draw_path(scene.canvas, path, color)
            if scene.editor.motion_start_s is not None and paths.is_moving(path):
                shift = path.compute_displacement(scene.editor.now - scene.editor.motion_start_s)
                moved = shapely.transform(item.geometry, lambda points, by=shift: points + by)
                overlay.draw_ghost(scene.canvas, moved)


class StartMarkers:
    """The starts of the map."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the starts with their names; the first one is the default."""
        for number, (name, start) in enumerate(scene.sketch.starts):
            label = name
            if name and number == 0:
                label = f"{name}, default"
            is_selected = name in scene.editor.selection.starts
            overlay.draw_start(scene.canvas, start, is_selected=is_selected)
            # Labels stay in place while obstacles are dragged.
            draw_start_label(scene.canvas, scene.committed_sketch, start, label)


class TeamAtStart:
    """The robots of the team, placed at a start."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the robots as discs with their numbers."""
        team = scene.team
        if team is None or not team.positions or "robots" not in scene.view.shown:
            return
        canvas = scene.canvas
        theme = canvas.theme
        scale = canvas.scale
        centers = canvas.camera.to_pixels(np.array(team.positions))
        true_radii = np.full(len(centers), team.radius * canvas.camera.zoom)
        readable = min(READABLE_RADIUS_PX * scale, MAX_RADIUS_PX)
        radii = np.minimum(
            fit_radii(centers, true_radii, ROBOT_GAP_PX * scale, readable),
            true_radii.clip(MIN_ROBOT_RADIUS_PX),
        )
        edge = mix(theme.background, theme.ink, EDGE_SHARE)
        for k, (center, radius) in enumerate(zip(centers.tolist(), radii.tolist(), strict=True)):
            # Half pixels, so that sprites can be reused.
            size = round(2 * min(radius, MAX_RADIUS_PX)) / 2
            sprite = partial(
                sprites.render_disc,
                size,
                fill=theme.robots[k % len(theme.robots)],
                ring=theme.robot_ring,
                ring_width=min(ROBOT_RING_PX * scale, MAX_RING_RADII * size),
                edge=edge,
                text=_choose_number(k + 1, size, scale),
            )
            canvas.draw_sprite(sprite, center)


def _choose_number(number: int, radius: float, scale: float) -> str:
    """Return the number of a robot as text; empty if its disc, with a radius in px, is too small."""
    text = str(number)
    text_size = sprites.choose_number_size(radius, min(len(text), 4))
    if text_size > MIN_NUMBER_PX * scale:
        return text
    return ""


class SelectedObjects:
    """Outlines of the selected objects and the hovered one, with the frame and handles of the selection."""

    def __init__(self, sheet: Sheet) -> None:
        self._sheet = sheet
        self._outlines: LatestValue[Surface] = LatestValue()

    def draw(self, scene: EditorScene) -> None:
        """Draw outlines, frame and handles. Objects that are dragged have outlines already."""
        if scene.tool_overlay.dragged_image is not None:
            return
        selection = scene.selection.restrict_to(scene.sketch)
        owners: set[Owner] = set(selection.owners) | {vertex.owner for vertex in selection.vertices}
        self._draw_hovered_object(scene, owners)
        self._draw_outlines(scene, selection, owners)
        if "handles" in scene.view.shown and scene.tool_overlay.shows_handles and selection:
            self._draw_handles(scene, selection)

    def _draw_hovered_object(self, scene: EditorScene, selected: set[Owner]) -> None:
        hovered = scene.tool_overlay.hovered
        if hovered is None or hovered in selected or not scene.cursor:
            return
        if Selection.of(hovered).restrict_to(scene.sketch):
            theme = scene.canvas.theme
            color = mix(theme.background, theme.accent, HOVERED_SHARE)
            draw_object_outline(
                scene.canvas, self._sheet, scene.sketch, hovered, color=color, width=HOVERED_WIDTH_PX
            )

    def _draw_outlines(self, scene: EditorScene, selection: Selection, owners: set[Owner]) -> None:
        """Draw the outlines of the selected objects; those of many are cached as an image."""
        if len(owners) <= MANY_OBJECTS:
            self._draw_all(scene.canvas, scene.sketch, owners)
            return

        def render_image() -> Surface:
            canvas = scene.view.build_transparent_canvas()
            self._draw_all(canvas, scene.sketch, owners)
            return canvas.surface

        look = (selection, scene.view.camera, scene.view.theme.name, scene.view.scale)
        image = self._outlines.get_or_compute(scene.sketch, look, render_image)
        scene.canvas.surface.blit(image, (0, 0), special_flags=_PREMULTIPLIED)

    def _draw_all(self, canvas: Canvas, sketch: Sketch, owners: set[Owner]) -> None:
        for owner in owners:
            draw_object_outline(
                canvas, self._sheet, sketch, owner, color=canvas.theme.accent, width=OUTLINE_WIDTH_PX
            )

    def _draw_handles(self, scene: EditorScene, selection: Selection) -> None:
        """Draw the dashed frame of a selection, and its handles."""
        canvas = scene.canvas
        editor = scene.editor
        frame = compute_frame(scene.sketch, selection, scene.pixel)
        if frame is not None:
            corners = overlay.to_pixels(canvas, shapely.box(*frame).exterior.coords).tolist()
            color = mix(canvas.theme.background, canvas.theme.accent, FRAME_SHARE)
            overlay.draw_dashes(canvas, corners, color, FRAME_DASH_PX)
        handles = editor.handles
        if scene.sketch is not editor.sketch or scene.pixel != editor.pixel:
            handles = list_handles(scene.sketch, selection, scene.pixel)
        overlay.draw_handles(canvas, handles, selection.vertices, scene.tool_overlay.hovered_handle)


class GapLabel:
    """Label of the narrowest gap with its width."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the label; it avoids the label of a tool at the cursor."""
        measurement = scene.measurement
        if measurement is not None and measurement.gap is not None:
            cursor = None
            if scene.tool_overlay.labels_cursor:
                cursor = scene.cursor
            overlay.draw_gap_label(scene.canvas, measurement.gap, measurement.radius, cursor)


class Problems:
    """Badges of the problems, with the messages of the chosen and the hovered one."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the problems."""
        if "problems" in scene.view.shown:
            editor = scene.editor
            overlay.draw_problems(scene.canvas, scene.view, editor.problems, editor.problem, scene.hovered)


class Guides:
    """Guides that show the snap targets of the cursor."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the guides."""
        overlay.draw_guides(scene.canvas, scene.editor.tool.guides)


class ToolPreview:
    """Preview of the edit that the active tool would make."""

    def draw(self, scene: EditorScene) -> None:
        """Draw the preview."""
        overlay.draw_preview(scene.canvas, scene.tool_overlay, scene.cursor)


class TypedText:
    """The value that is being typed, next to the cursor."""

    def draw(self, scene: EditorScene) -> None:
        """Write the text."""
        if scene.editor.typed:
            position = scene.cursor or Rect(scene.view.camera.view).center
            overlay.draw_typed_text(scene.canvas, scene.editor.typed, position)


def build_layers(sheet: Sheet) -> tuple[OverlayLayer, ...]:
    """Build the layers on top of a sheet, from bottom to top."""
    return (
        DraggedObstacles(sheet),
        Passages(),
        Paths(),
        StartMarkers(),
        TeamAtStart(),
        SelectedObjects(sheet),
        GapLabel(),
        Problems(),
        Guides(),
        ToolPreview(),
        TypedText(),
    )


def draw_object_outline(
    canvas: Canvas, sheet: Sheet, sketch: Sketch, owner: Owner, *, color: Color, width: float
) -> None:
    """Draw the outline of an obstacle, a start or the boundary; `width` in px at scale 1."""
    if isinstance(owner, str):
        overlay.draw_start(canvas, sketch.get_start(owner), is_selected=True, dot_scale=OUTLINED_DOT_SCALE)
    elif owner == BOUNDARY:
        corners = overlay.to_pixels(canvas, sketch.boundary or ())
        canvas.draw_outline(corners, color, canvas.scale_width(width + BOUNDARY_EXTRA_WIDTH_PX))
    else:
        for ring in sheet.outlines.get(sketch.get_item(owner)).rings:
            canvas.draw_outline(canvas.camera.to_pixels(ring), color, canvas.scale_width(width))
