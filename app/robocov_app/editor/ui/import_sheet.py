"""A file in its own colours, as the import dialog shows it, and the roles that its colours are given."""

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

MAX_COLOURS = 12  # that are offered; others are reached by a click
_NEAR = 24.0  # levels in each channel within which colours of a picture count as one
_LISTED_SHARE = 0.001  # of a picture, from which on a colour is offered
_CYCLE: tuple[Role | None, ...] = (None, "free", "solid", "ignore")


@dataclass(frozen=True, eq=False)
class Sheet:
    """A file in its own colours.

    Attributes
    ----------
    painted : tuple of Painted
        Shapes of a drawing, the lowest first.
    thumbnail : Thumbnail or None
        A picture.
    colours : tuple of colours
        The most frequent first.
    """

    painted: tuple[Painted, ...]
    thumbnail: Thumbnail | None
    colours: tuple[Colour, ...]

    def find_colour(self, x: float, y: float) -> Colour | None:
        """Return the colour at a place in metres, None where there is none."""
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
        # soft edges and noise: the colour that was meant is among the frequent ones
        key = ColourKey(tuple((colour, "free") for colour in self.colours), _NEAR)
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


def make_sheet(foreign: ForeignMap) -> Sheet | None:
    """Return a map that was read in its own colours, None where it has none."""
    if foreign.thumbnail is not None:
        return Sheet((), foreign.thumbnail, _list_pixel_colours(foreign.thumbnail))
    if not foreign.painted:
        return None
    areas: defaultdict[Colour, float] = defaultdict(float)
    for shape in foreign.painted:
        areas[shape.colour] += shape.area.area
    largest = sorted(areas, key=lambda colour: -areas[colour])
    return Sheet(foreign.painted, None, tuple(largest[:MAX_COLOURS]))


def _list_pixel_colours(thumbnail: Thumbnail) -> tuple[Colour, ...]:
    """Return the frequent colours of a picture, without those between two of them."""
    pixels = thumbnail.pixels.reshape(-1, 3)
    values, counts = np.unique(pixels, axis=0, return_counts=True)
    found: list[Colour] = []
    for k in np.argsort(-counts, kind="stable").tolist():
        if counts[k] < _LISTED_SHARE * len(pixels) or len(found) == MAX_COLOURS:
            break
        red, green, blue = values[k].tolist()
        colour = (red, green, blue)
        if not _is_mixture(colour, found):
            found.append(colour)
    return tuple(found)


def _is_mixture(colour: Colour, others: Sequence[Colour]) -> bool:
    """Return whether a colour is near one of others, or between two of them, as on soft edges."""
    points = np.array(others, dtype=float).reshape(-1, 3)
    offset = np.array(colour, dtype=float) - points
    if (np.abs(offset).max(axis=1) <= _NEAR).any():
        return True
    for start, vector in zip(points, offset, strict=True):
        along = points - start
        length = (along**2).sum(axis=1)
        part = np.divide(along @ vector, length, out=np.zeros(len(length)), where=length > 0.0)
        between = start + np.clip(part, 0.0, 1.0)[:, None] * along
        if (np.abs(between - np.array(colour)).max(axis=1) <= _NEAR / 2).any():
            return True
    return False


def _draw_thumbnail(surface: Surface, camera: Camera, thumbnail: Thumbnail) -> None:
    left, bottom, right, top = thumbnail.bounds
    (x0, y0), (x1, y1) = camera.to_pixels(np.array([[left, top], [right, bottom]])).tolist()
    picture = pygame.surfarray.make_surface(thumbnail.pixels.swapaxes(0, 1))
    size = max(round(x1 - x0), 1), max(round(y1 - y0), 1)
    surface.blit(pygame.transform.smoothscale(picture, size), (round(x0), round(y0)))


def _fill_polygon(surface: Surface, camera: Camera, part: shapely.Polygon, colour: Colour) -> None:
    outline = camera.to_pixels(shapely.get_coordinates(part.exterior))
    if not len(part.interiors):
        pygame.draw.polygon(surface, colour, outline.tolist())
        return
    # through its holes what is below stays in sight
    low, high = np.floor(outline.min(axis=0)), np.ceil(outline.max(axis=0))
    box = Rect(low.tolist(), (high - low + 1).tolist()).clip(surface.get_clip())
    if not box.width or not box.height:
        return
    layer = Surface(box.size, pygame.SRCALPHA)
    corner = np.array(box.topleft)
    pygame.draw.polygon(layer, colour, (outline - corner).tolist())
    for hole in part.interiors:
        points = camera.to_pixels(shapely.get_coordinates(hole)) - corner
        pygame.draw.polygon(layer, (0, 0, 0, 0), points.tolist())
    surface.blit(layer, box)


def find_role(given: MutableMapping[str, str], colour: Colour) -> Role | None:
    """Return the role that the options as they were typed give to exactly this colour."""
    for role in ROLES:
        if colour in map(parse_css_colour_on_white, _words(given, role)):
            return role
    return None


def declared_colours(given: MutableMapping[str, str]) -> list[Colour]:
    """Return the colours that have a role in the options as they were typed."""
    found = (parse_css_colour_on_white(word) for role in ROLES for word in _words(given, role))
    return list(dict.fromkeys(colour for colour in found if colour is not None))


def next_role(role: Role | None) -> Role | None:
    return _CYCLE[(_CYCLE.index(role) + 1) % len(_CYCLE)]


def give_role(given: MutableMapping[str, str], colour: Colour, role: Role | None) -> None:
    """Change the options as they were typed so that a colour has a role, or none."""
    for each in ROLES:
        words = [word for word in _words(given, each) if parse_css_colour_on_white(word) != colour]
        if each == role:
            words.append(name_colour(colour))
        name = f"{each}_colour"
        if words:
            given[name] = ", ".join(words)
        else:
            given.pop(name, None)


def _words(given: MutableMapping[str, str], role: Role) -> Sequence[str]:
    words = given.get(f"{role}_colour", "").split(",")
    return [word.strip() for word in words if word.strip()]
