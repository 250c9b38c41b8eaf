"""The two maps in the import dialog: as read from the file, and as imported."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.environment import Point
from robocov.errors import format_area
from robocov_app.editor.ui.importing.file_colors import ColorSheet
from robocov_app.editor.ui.importing.service import Imported
from robocov_app.formats.geometry.conversion.comparison import ImportComparison
from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.render.camera import Camera
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.render.panel_grid import choose_column_count
from robocov_app.render.surface_cache import LatestValue
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX

MAP_COUNT = 2  # as read and as imported

# Lengths in pixels at scale 1.
CAPTION_HEIGHT_PX = 40  # above each map
MAPS_GAP_PX = 20
MAP_MARGIN_PX = 2
MIN_GAP_LENGTH_PX = 20  # shorter gaps have a circle around them
MARK_ARM_PX = 7
MARK_OPACITY = 150
VEIL_OPACITY = 140
_CLEAR = (0, 0, 0, 0)


class _Caption(NamedTuple):
    """Caption of a map: title, facts, and label and color of the marked areas."""

    title: str
    facts: str
    mark: str
    mark_color: Color


class ImportPreview:
    """Draws the map before and after the import.

    Attributes
    ----------
    cameras : list of Camera
        Cameras of the map as read and as imported.
    """

    def __init__(self) -> None:
        self.cameras: list[Camera] = []
        self._width = 0  # maximum width of a caption, px
        self._image: LatestValue[Surface] = LatestValue()

    def arrange(self, box: Rect, imported: Imported, scale: float) -> float:
        """Place the two maps at the top of a box, next to or below each other.

        Parameters
        ----------
        box : Rect
            Box for both maps with their captions, px.
        imported : Imported
            The maps.
        scale : float
            Scale of the window.

        Returns
        -------
        float
            Height that they take, px.
        """
        low_x, low_y, high_x, high_y = imported.comparison.bounds
        aspect = (high_x - low_x) / (high_y - low_y)
        caption_height = round(CAPTION_HEIGHT_PX * scale)
        gap = round(MAPS_GAP_PX * scale)
        columns = choose_column_count(MAP_COUNT, aspect, box.size, row_margin=caption_height)
        width = (box.width - (columns - 1) * gap) // columns
        rows = MAP_COUNT // columns
        free_height = (box.height - (rows - 1) * gap) // rows
        height = min(free_height - caption_height, round(width / aspect))
        second_top = box.top + (rows - 1) * (caption_height + height + gap)
        # With one column, the second map is below the first one; with two, to the right of it.
        corners = [box.topleft, (box.right - width, second_top)]
        map_width = float(min(width, round(height * aspect)))
        self.cameras = []
        for x, y in corners:
            view = (float(x), float(y + caption_height), map_width, float(height))
            self.cameras.append(Camera.fit(imported.comparison.bounds, view, MAP_MARGIN_PX * scale))
        self._width = width
        return second_top + caption_height + height - box.top

    def draw(
        self, screen: Surface, imported: Imported, scale: float, theme: Theme, sheet: ColorSheet | None
    ) -> None:
        """Draw both maps with captions; if `sheet` is not None, draw the first map in its own colors."""
        look = (*(camera.view for camera in self.cameras), scale, theme, sheet is not None)

        def render_maps() -> Surface:
            image = _draw_comparison(screen.get_size(), imported.comparison, self.cameras, scale, theme)
            if sheet is not None:
                sheet.draw(image, self.cameras[0], imported.comparison.bounds)
            return image

        screen.blit(self._image.get_or_compute(imported, look, render_maps), (0, 0))
        captions = _list_captions(imported, theme, has_own_colors=sheet is not None)
        for camera, caption in zip(self.cameras, captions, strict=True):
            self._draw_caption(screen, camera, caption, scale, theme)

    def _draw_caption(
        self, screen: Surface, camera: Camera, caption: _Caption, scale: float, theme: Theme
    ) -> None:
        """Draw the caption above a map: the title with the label of marked areas, and the facts below it."""
        title_size = round(13 * scale)
        text_size = round(SMALL_TEXT_PX * scale)
        x = round(camera.view[0])
        y = round(camera.view[1] - CAPTION_HEIGHT_PX * scale)
        screen.blit(render_text(caption.title, title_size, theme.ink, bold=True), (x, y))
        if caption.mark:
            left = x + measure_text(caption.title, title_size, bold=True) + round(10 * scale)
            square = Rect(left, y + round(4 * scale), round(9 * scale), round(9 * scale))
            pygame.draw.rect(screen, caption.mark_color, square)
            mark = render_text(caption.mark, text_size, theme.ink)
            screen.blit(mark, (left + round(14 * scale), y + round(2 * scale)))
        facts = shorten_to_width(caption.facts, text_size, self._width)
        screen.blit(render_text(facts, text_size, theme.faint), (x, y + round(20 * scale)))

    def draw_mark(self, screen: Surface, position: Point, scale: float, theme: Theme) -> None:
        """Draw a cross at a position, m, on both maps."""
        for camera in self.cameras:
            x, y = camera.to_pixels(np.array(position)).tolist()
            # A wide line in the background color under a thin one makes the cross visible everywhere.
            for line_width, color in ((5, theme.background), (2, theme.accent)):
                arm = MARK_ARM_PX * scale + line_width / 2
                width = round(line_width * scale)
                pygame.draw.line(screen, color, (x - arm, y), (x + arm, y), width)
                pygame.draw.line(screen, color, (x, y - arm), (x, y + arm), width)

    def draw_veil(self, screen: Surface, theme: Theme) -> None:
        """Cover both maps with a translucent veil, to show that they are outdated."""
        for camera in self.cameras:
            left, top, width, height = camera.view
            veil = Surface((width, height), pygame.SRCALPHA)
            veil.fill((*theme.panel, VEIL_OPACITY))
            screen.blit(veil, (left, top))


def _list_captions(imported: Imported, theme: Theme, *, has_own_colors: bool) -> list[_Caption]:
    """Return the captions of the map as read and as imported."""
    comparison = imported.comparison
    lost = _describe_difference(comparison.lost, "left out")
    opened = _describe_difference(comparison.opened, "opened")
    facts_before = f"{format_area(comparison.before.area)} free"
    facts_after = f"{format_area(comparison.after.area)} free"
    if comparison.gap is not None:
        facts_after += f", narrowest {comparison.gap.width:.3g} m"
    if has_own_colors:
        before = _Caption("In its colors", facts_before, "", theme.error)
    else:
        before = _Caption("As read", facts_before, lost, theme.error)
    return [before, _Caption("As imported", facts_after, opened, theme.start)]


def _describe_difference(area: shapely.Geometry, verb: str) -> str:
    if area.is_empty:
        return ""
    return f"{format_area(area.area, 3)} {verb}"


def _draw_comparison(
    size: tuple[int, int], comparison: ImportComparison, cameras: list[Camera], scale: float, theme: Theme
) -> Surface:
    """Draw the free space before and after the import, with the differences, on a transparent image."""
    image = Surface(size, pygame.SRCALPHA)
    before, after = cameras
    _draw_map(image, before, comparison, comparison.before, theme)
    _draw_marked_area(image, before, comparison.lost, theme.error)
    _draw_map(image, after, comparison, comparison.after, theme)
    _draw_marked_area(image, after, comparison.opened, theme.start)
    if comparison.gap is not None:
        ends = after.to_pixels(np.array(comparison.gap.between))
        width = round(2 * scale)
        pygame.draw.line(image, theme.accent, ends[0].tolist(), ends[1].tolist(), width)
        if math.dist(*ends) < MIN_GAP_LENGTH_PX * scale:
            pygame.draw.circle(image, theme.accent, ends.mean(axis=0).tolist(), 10 * scale, width)
    return image


def _draw_map(
    image: Surface, camera: Camera, comparison: ImportComparison, free: shapely.Geometry, theme: Theme
) -> None:
    _fill_polygons(image, camera, comparison.region, theme.obstacle, theme.obstacle)
    _fill_polygons(image, camera, free, theme.background, theme.obstacle)
    for ring in shapely.get_rings(shapely.get_parts(free)):
        points = camera.to_pixels(shapely.get_coordinates(ring)).tolist()
        pygame.draw.aalines(image, theme.obstacle_edge, True, points)


def _draw_marked_area(image: Surface, camera: Camera, area: shapely.Geometry, color: Color) -> None:
    layer = Surface(image.get_size(), pygame.SRCALPHA)
    _fill_polygons(layer, camera, area, (*color, MARK_OPACITY), _CLEAR)
    image.blit(layer, (0, 0))


def _fill_polygons(
    surface: Surface, camera: Camera, area: shapely.Geometry, inside: Sequence[int], holes: Sequence[int]
) -> None:
    """Fill polygons and their holes; large polygons first, because small ones may lie in their holes."""
    polygons = [part for part in shapely.get_parts(area).tolist() if part.geom_type == "Polygon"]
    polygons.sort(key=lambda polygon: -shapely.Polygon(polygon.exterior).area)
    for polygon in polygons:
        _fill_ring(surface, camera, polygon.exterior, inside)
        for hole in polygon.interiors:
            _fill_ring(surface, camera, hole, holes)


def _fill_ring(surface: Surface, camera: Camera, ring: shapely.LinearRing, color: Sequence[int]) -> None:
    points = camera.to_pixels(shapely.get_coordinates(ring)).tolist()
    pygame.draw.polygon(surface, color, points)
