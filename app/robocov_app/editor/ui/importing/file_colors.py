"""A file in its own colors, as shown in the import dialog, and the roles of these colors."""

from collections import defaultdict
from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov_app.formats import ForeignMap
from robocov_app.formats.colors import (
    ROLES,
    WHITE,
    Color,
    ColorKey,
    Role,
    name_color,
    parse_css_color_on_white,
)
from robocov_app.formats.foreign_map import Painted, Thumbnail
from robocov_app.render.camera import Box, Camera

MAX_COLORS = 12  # number of colors that are listed; others can be chosen by a click on the image
COLOR_TOLERANCE = 24.0  # colors of an image that differ by at most this in each channel count as one
MIN_LISTED_SHARE = 0.001  # of the pixels of an image; rarer colors are not listed
_ROLE_CYCLE: tuple[Role | None, ...] = (None, "free", "solid", "ignore")


@dataclass(frozen=True, eq=False)
class ColorSheet:
    """A file in its own colors.

    Attributes
    ----------
    painted : tuple of Painted
        Shapes of a drawing, from bottom to top.
    thumbnail : Thumbnail or None
        The image, if the file is one.
    colors : tuple of Color
        Colors of the file, the most frequent first.
    """

    painted: tuple[Painted, ...]
    thumbnail: Thumbnail | None
    colors: tuple[Color, ...]

    def find_color(self, x: float, y: float) -> Color | None:
        """Return the color at a position, m; None if there is none."""
        if self.thumbnail is not None:
            return self._find_pixel(self.thumbnail, x, y)
        point = shapely.Point(x, y)
        for shape in reversed(self.painted):
            if shapely.intersects(shape.area, point):
                return shape.color
        return None

    def _find_pixel(self, thumbnail: Thumbnail, x: float, y: float) -> Color | None:
        """Return the color of an image at a position, m; None outside the image."""
        left, bottom, right, top = thumbnail.bounds
        rows, columns = thumbnail.pixels.shape[:2]
        column = int((x - left) / (right - left) * columns // 1)
        row = int((top - y) / (top - bottom) * rows // 1)
        if not (0 <= row < rows and 0 <= column < columns):
            return None
        red, green, blue = thumbnail.pixels[row, column].tolist()
        # Soft edges and noise have many colors, so the nearest of the frequent colors is returned.
        key = ColorKey(tuple((color, "free") for color in self.colors), COLOR_TOLERANCE)
        nearest = key.find_nearest((red, green, blue))
        if nearest is None:
            return red, green, blue
        return nearest

    def draw(self, surface: Surface, camera: Camera, bounds: Box) -> None:
        """Draw the part of the file within bounds, low x, low y, high x and high y, m, in a camera's view."""
        clip = surface.get_clip()
        low_x, low_y, high_x, high_y = bounds
        (left, top), (right, bottom) = camera.to_pixels(np.array([[low_x, high_y], [high_x, low_y]])).round()
        # Edges of the map below reach half a line width beyond the bounds.
        box = Rect(left, top, right - left + 1, bottom - top + 1).inflate(2, 2)
        surface.set_clip(box)
        surface.fill(WHITE, box)
        if self.thumbnail is not None:
            _draw_thumbnail(surface, camera, self.thumbnail)
        for shape in self.painted:
            for part in shapely.get_parts(shape.area).tolist():
                if part.geom_type == "Polygon":
                    _fill_polygon(surface, camera, part, shape.color)
        surface.set_clip(clip)


def build_color_sheet(foreign: ForeignMap) -> ColorSheet | None:
    """Build the color sheet of a foreign map; return None if the map has no colors."""
    if foreign.thumbnail is not None:
        return ColorSheet((), foreign.thumbnail, _list_pixel_colors(foreign.thumbnail))
    if not foreign.painted:
        return None
    areas: defaultdict[Color, float] = defaultdict(float)
    for shape in foreign.painted:
        areas[shape.color] += shape.area.area
    colors = sorted(areas, key=lambda color: -areas[color])
    return ColorSheet(foreign.painted, None, tuple(colors[:MAX_COLORS]))


def _list_pixel_colors(thumbnail: Thumbnail) -> tuple[Color, ...]:
    """Return the frequent colors of an image, without mixtures of two more frequent ones."""
    pixels = thumbnail.pixels.reshape(-1, 3)
    values, counts = np.unique(pixels, axis=0, return_counts=True)
    min_count = MIN_LISTED_SHARE * len(pixels)
    colors: list[Color] = []
    for k in np.argsort(-counts, kind="stable").tolist():
        if counts[k] < min_count or len(colors) == MAX_COLORS:
            break
        red, green, blue = values[k].tolist()
        color = (red, green, blue)
        if not _is_mixture(color, colors):
            colors.append(color)
    return tuple(colors)


def _is_mixture(color: Color, others: Sequence[Color]) -> bool:
    """Return whether a color is close to another one, or between two others, as on soft edges."""
    points = np.array(others, dtype=float).reshape(-1, 3)
    offsets = np.array(color, dtype=float) - points
    if (np.abs(offsets).max(axis=1) <= COLOR_TOLERANCE).any():
        return True
    for start, offset in zip(points, offsets, strict=True):
        directions = points - start
        squared_lengths = (directions**2).sum(axis=1)
        has_length = squared_lengths > 0.0
        # Fractions along the lines to all other colors at which they are nearest to the color.
        shares = np.divide(directions @ offset, squared_lengths, out=np.zeros(len(points)), where=has_length)
        between = start + np.clip(shares, 0.0, 1.0)[:, None] * directions
        differences = np.abs(between - np.array(color)).max(axis=1)
        if (differences <= COLOR_TOLERANCE / 2).any():
            return True
    return False


def _draw_thumbnail(surface: Surface, camera: Camera, thumbnail: Thumbnail) -> None:
    left, bottom, right, top = thumbnail.bounds
    corners = camera.to_pixels(np.array([[left, top], [right, bottom]]))
    (low_x, low_y), (high_x, high_y) = corners.tolist()
    image = pygame.surfarray.make_surface(thumbnail.pixels.swapaxes(0, 1))
    size = (max(round(high_x - low_x), 1), max(round(high_y - low_y), 1))
    surface.blit(pygame.transform.smoothscale(image, size), (round(low_x), round(low_y)))


def _fill_polygon(surface: Surface, camera: Camera, polygon: shapely.Polygon, color: Color) -> None:
    """Fill a polygon, without its holes."""
    outline = camera.to_pixels(shapely.get_coordinates(polygon.exterior))
    if not len(polygon.interiors):
        pygame.draw.polygon(surface, color, outline.tolist())
        return
    # The polygon is drawn on a separate layer, so that the content below shows through the holes.
    low = np.floor(outline.min(axis=0))
    high = np.ceil(outline.max(axis=0))
    box = Rect(low.tolist(), (high - low + 1).tolist()).clip(surface.get_clip())
    if not box.width or not box.height:
        return
    layer = Surface(box.size, pygame.SRCALPHA)
    corner = np.array(box.topleft)
    pygame.draw.polygon(layer, color, (outline - corner).tolist())
    for hole in polygon.interiors:
        points = camera.to_pixels(shapely.get_coordinates(hole)) - corner
        pygame.draw.polygon(layer, (0, 0, 0, 0), points.tolist())
    surface.blit(layer, box)


def find_role(texts: MutableMapping[str, str], color: Color) -> Role | None:
    """Return the role that the options give to exactly this color; None if it has no role."""
    for role in ROLES:
        if color in map(parse_css_color_on_white, _list_words(texts, role)):
            return role
    return None


def list_declared_colors(texts: MutableMapping[str, str]) -> list[Color]:
    """Return the colors to which the options give a role."""
    colors: list[Color] = []
    for role in ROLES:
        for word in _list_words(texts, role):
            color = parse_css_color_on_white(word)
            if color is not None and color not in colors:
                colors.append(color)
    return colors


def choose_next_role(role: Role | None) -> Role | None:
    """Return the next role in the cycle: none, free, solid, ignored."""
    return _ROLE_CYCLE[(_ROLE_CYCLE.index(role) + 1) % len(_ROLE_CYCLE)]


def set_role(texts: MutableMapping[str, str], color: Color, role: Role | None) -> None:
    """Change the options so that a color has the given role, or no role."""
    for option_role in ROLES:
        words = [word for word in _list_words(texts, option_role) if parse_css_color_on_white(word) != color]
        if option_role == role:
            words.append(name_color(color))
        name = f"{option_role}_color"
        if words:
            texts[name] = ", ".join(words)
        else:
            texts.pop(name, None)


def _list_words(texts: MutableMapping[str, str], role: Role) -> Sequence[str]:
    words = texts.get(f"{role}_color", "").split(",")
    return [word.strip() for word in words if word.strip()]
