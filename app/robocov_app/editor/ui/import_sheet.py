"""A file in its own colours as the import dialog shows it, and the roles of its colours."""

from collections import defaultdict
from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov_app.formats import ForeignMap
from robocov_app.formats.colours import (
    ROLES,
    WHITE,
    Colour,
    ColourKey,
    Role,
    name_colour,
    parse_css_colour_on_white,
)
from robocov_app.formats.foreign_map import Painted, Thumbnail
from robocov_app.render.camera import Camera

MAX_COLOURS = 12  # that are listed; others are chosen by a click on the picture
COLOUR_TOLERANCE = 24.0  # levels in each channel within which colours of a picture count as one
MIN_LISTED_SHARE = 0.001  # of a picture, from which on a colour is listed
_ROLE_CYCLE: tuple[Role | None, ...] = (None, "free", "solid", "ignore")


@dataclass(frozen=True, eq=False)
class ColourSheet:
    """A file in its own colours.

    Attributes
    ----------
    painted : tuple of Painted
        Shapes of a drawing, from the bottom to the top.
    thumbnail : Thumbnail or None
        A picture.
    colours : tuple of Colour
        Its colours, the most frequent first.
    """

    painted: tuple[Painted, ...]
    thumbnail: Thumbnail | None
    colours: tuple[Colour, ...]

    def find_colour(self, x: float, y: float) -> Colour | None:
        """Return the colour at a position, m; None where there is none."""
        if self.thumbnail is not None:
            return self._find_pixel(self.thumbnail, x, y)
        point = shapely.Point(x, y)
        for shape in reversed(self.painted):
            if shapely.intersects(shape.area, point):
                return shape.colour
        return None

    def _find_pixel(self, thumbnail: Thumbnail, x: float, y: float) -> Colour | None:
        left, bottom, right, top = thumbnail.bounds
        rows, columns = thumbnail.pixels.shape[:2]
        column = int((x - left) / (right - left) * columns // 1)
        row = int((top - y) / (top - bottom) * rows // 1)
        if not (0 <= row < rows and 0 <= column < columns):
            return None
        red, green, blue = thumbnail.pixels[row, column].tolist()
        # Because of soft edges and noise, the frequent colour that is nearest is meant.
        key = ColourKey(tuple((colour, "free") for colour in self.colours), COLOUR_TOLERANCE)
        nearest = key.find_nearest((red, green, blue))
        return (red, green, blue) if nearest is None else nearest

    def draw(self, surface: Surface, camera: Camera) -> None:
        """Draw the file into the view of a camera."""
        clip = surface.get_clip()
        view = Rect(camera.view)
        surface.set_clip(view)
        surface.fill(WHITE, view)
        if self.thumbnail is not None:
            _draw_thumbnail(surface, camera, self.thumbnail)
        for shape in self.painted:
            for part in shapely.get_parts(shape.area).tolist():
                if part.geom_type == "Polygon":
                    _fill_polygon(surface, camera, part, shape.colour)
        surface.set_clip(clip)


def build_colour_sheet(foreign: ForeignMap) -> ColourSheet | None:
    """Return a foreign map in its own colours, None if it has none."""
    if foreign.thumbnail is not None:
        return ColourSheet((), foreign.thumbnail, _list_pixel_colours(foreign.thumbnail))
    if not foreign.painted:
        return None
    areas: defaultdict[Colour, float] = defaultdict(float)
    for shape in foreign.painted:
        areas[shape.colour] += shape.area.area
    colours = sorted(areas, key=lambda colour: -areas[colour])
    return ColourSheet(foreign.painted, None, tuple(colours[:MAX_COLOURS]))


def _list_pixel_colours(thumbnail: Thumbnail) -> tuple[Colour, ...]:
    """Return the frequent colours of a picture, without mixtures of two others."""
    pixels = thumbnail.pixels.reshape(-1, 3)
    values, counts = np.unique(pixels, axis=0, return_counts=True)
    min_count = MIN_LISTED_SHARE * len(pixels)
    colours: list[Colour] = []
    for k in np.argsort(-counts, kind="stable").tolist():
        if counts[k] < min_count or len(colours) == MAX_COLOURS:
            break
        red, green, blue = values[k].tolist()
        colour = (red, green, blue)
        if not _is_mixture(colour, colours):
            colours.append(colour)
    return tuple(colours)


def _is_mixture(colour: Colour, others: Sequence[Colour]) -> bool:
    """Return whether a colour is near another, or between two others, as on soft edges."""
    points = np.array(others, dtype=float).reshape(-1, 3)
    offsets = np.array(colour, dtype=float) - points
    if (np.abs(offsets).max(axis=1) <= COLOUR_TOLERANCE).any():
        return True
    for start, offset in zip(points, offsets, strict=True):
        directions = points - start
        squared_lengths = (directions**2).sum(axis=1)
        has_length = squared_lengths > 0.0
        shares = np.divide(directions @ offset, squared_lengths, out=np.zeros(len(points)), where=has_length)
        between = start + np.clip(shares, 0.0, 1.0)[:, None] * directions
        differences = np.abs(between - np.array(colour)).max(axis=1)
        if (differences <= COLOUR_TOLERANCE / 2).any():
            return True
    return False


def _draw_thumbnail(surface: Surface, camera: Camera, thumbnail: Thumbnail) -> None:
    left, bottom, right, top = thumbnail.bounds
    corners = camera.to_pixels(np.array([[left, top], [right, bottom]]))
    (low_x, low_y), (high_x, high_y) = corners.tolist()
    picture = pygame.surfarray.make_surface(thumbnail.pixels.swapaxes(0, 1))
    size = (max(round(high_x - low_x), 1), max(round(high_y - low_y), 1))
    surface.blit(pygame.transform.smoothscale(picture, size), (round(low_x), round(low_y)))


def _fill_polygon(surface: Surface, camera: Camera, polygon: shapely.Polygon, colour: Colour) -> None:
    outline = camera.to_pixels(shapely.get_coordinates(polygon.exterior))
    if not len(polygon.interiors):
        pygame.draw.polygon(surface, colour, outline.tolist())
        return
    # A layer of its own, so that what lies below is visible through the holes.
    low = np.floor(outline.min(axis=0))
    high = np.ceil(outline.max(axis=0))
    box = Rect(low.tolist(), (high - low + 1).tolist()).clip(surface.get_clip())
    if not box.width or not box.height:
        return
    layer = Surface(box.size, pygame.SRCALPHA)
    corner = np.array(box.topleft)
    pygame.draw.polygon(layer, colour, (outline - corner).tolist())
    for hole in polygon.interiors:
        points = camera.to_pixels(shapely.get_coordinates(hole)) - corner
        pygame.draw.polygon(layer, (0, 0, 0, 0), points.tolist())
    surface.blit(layer, box)


def find_role(entries: MutableMapping[str, str], colour: Colour) -> Role | None:
    """Return the role that the typed options give to exactly this colour."""
    for role in ROLES:
        if colour in map(parse_css_colour_on_white, _list_words(entries, role)):
            return role
    return None


def list_declared_colours(entries: MutableMapping[str, str]) -> list[Colour]:
    """Return the colours that have a role in the typed options."""
    colours: list[Colour] = []
    for role in ROLES:
        for word in _list_words(entries, role):
            colour = parse_css_colour_on_white(word)
            if colour is not None and colour not in colours:
                colours.append(colour)
    return colours


def choose_next_role(role: Role | None) -> Role | None:
    """Return the role that follows: none, free, solid, ignored."""
    return _ROLE_CYCLE[(_ROLE_CYCLE.index(role) + 1) % len(_ROLE_CYCLE)]


def set_role(entries: MutableMapping[str, str], colour: Colour, role: Role | None) -> None:
    """Change the typed options so that a colour has a role, or none."""
    for option_role in ROLES:
        words = [
            word for word in _list_words(entries, option_role) if parse_css_colour_on_white(word) != colour
        ]
        if option_role == role:
            words.append(name_colour(colour))
        name = f"{option_role}_colour"
        if words:
            entries[name] = ", ".join(words)
        else:
            entries.pop(name, None)


def _list_words(entries: MutableMapping[str, str], role: Role) -> Sequence[str]:
    words = entries.get(f"{role}_colour", "").split(",")
    return [word.strip() for word in words if word.strip()]
