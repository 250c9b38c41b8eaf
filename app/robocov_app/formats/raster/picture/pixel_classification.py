"""Free, blocked and unknown cells from the pixels of a picture."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.errors import MapError, format_area, format_count
from robocov.typing import BoolArray
from robocov_app.formats.colors import ROLE_CODES, ROLES, Role, RoleCode
from robocov_app.formats.geometry.cells.grid_map import BLOCKED, FREE, UNKNOWN, Cells
from robocov_app.formats.geometry.cells.strokes import MAX_STROKE_PIXELS, remove_thin_strokes
from robocov_app.formats.options import ReadOptions, get_or_default
from robocov_app.formats.raster.picture.brightness import OPAQUE_ALPHA, STRIP_ROWS, Brightness

_MAX_LIGHT_RATIO = 0.02
"""Maximum ratio of light pixels, in soft edges, to dark ones in a drawing on a transparent background."""
_MAX_LINE_FRACTION = 0.25
"""Maximum fraction of the pixels that the lines of a plan cover."""
_LINE_WIDTH_FRACTION = 0.05
"""Maximum width of a line, as a fraction of the shorter side of a picture."""
_MAX_DARK_BRIGHTNESS = 0.5
"""Colors are dark if their brightness, from 0 to 1, is below this."""
_SOFT_EDGE_PX = 2
"""Width of the soft edge between two colors, in pixels."""
_DEFAULT_THRESHOLD = 0.5
"""Brightness, from 0 to 1, of the darkest free pixels."""
_ROLE_LABELS: dict[Role, str] = {"free": "free", "solid": "obstacles", "ignore": "left out"}


def classify_pixels(picture: Brightness, options: ReadOptions) -> tuple[Cells, list[str]]:
    """Classify pixels as free, blocked or unknown cells; also return notes on the declared colors.

    Parameters
    ----------
    picture : Brightness
        Transparent pixels lose their role in `picture.roles`.
    options : ReadOptions
    """
    cells = _classify_brightness(picture, options)
    is_transparent = None if picture.alpha is None else picture.alpha < OPAQUE_ALPHA
    roles = picture.roles
    notes: list[str] = []
    if roles is not None:
        if is_transparent is not None:
            roles[is_transparent] = RoleCode.NONE  # a transparent pixel has no color
        notes = _describe_roles(roles, options)
        cells[roles == RoleCode.FREE] = FREE
        cells[roles == RoleCode.SOLID] = BLOCKED
        if not options.invert:
            _free_soft_edges(cells, picture, roles, options)
    if is_transparent is not None:
        cells[is_transparent] = UNKNOWN
    if roles is not None and options.ignore_color:
        _fill_from_around(cells, roles == RoleCode.IGNORE)
    return cells, notes


def _classify_brightness(picture: Brightness, options: ReadOptions) -> Cells:
    """Classify light pixels as free and dark ones as blocked; the option ``invert`` swaps them."""
    threshold = get_or_default(options.threshold, _DEFAULT_THRESHOLD)
    shade = np.arange(picture.max_level + 1) / picture.max_level
    is_free = shade >= threshold
    if options.invert:
        is_free = shade <= 1.0 - threshold
    table = np.where(is_free, FREE, BLOCKED).astype(np.uint8)
    return table[picture.level]


def _describe_roles(roles: NDArray[np.uint8], options: ReadOptions) -> list[str]:
    """Return, for each role with declared colors, a note on the fraction of the picture that it covers."""
    notes = []
    for role in ROLES:
        names = getattr(options, f"{role}_color")
        if names:
            percentage = 100 * np.count_nonzero(roles == ROLE_CODES[role]) / roles.size
            colors = ", ".join(names)
            note = f"{percentage:.3g}% of the pixels are {colors}, treated as {_ROLE_LABELS[role]}"
            notes.append(note)
    return notes


def _free_soft_edges(
    cells: Cells, picture: Brightness, roles: NDArray[np.uint8], options: ReadOptions
) -> None:
    """Free the blocked cells of soft edges around a dark color that is declared free or ignored.

    The edges between light paint and such a color have mixed colors without a role. They would become walls
    around the declared color.
    """
    # Brightness from 0 to 1.
    declared = [
        sum(color) / (3 * 255) for color, role in options.build_color_key().entries if role != "solid"
    ]
    if not declared or min(declared) >= _MAX_DARK_BRIGHTNESS:
        return
    has_no_role = roles == RoleCode.NONE
    is_declared = (roles == RoleCode.FREE) | (roles == RoleCode.IGNORE)
    is_light_paint = (cells == FREE) & has_no_role
    is_brighter = picture.level > min(declared) * picture.max_level
    around = np.ones((3, 3), dtype=bool)
    is_soft_edge = (cells == BLOCKED) & has_no_role & is_brighter
    for is_neighbor in (is_declared, is_light_paint):
        is_soft_edge &= ndimage.binary_dilation(is_neighbor, around, iterations=_SOFT_EDGE_PX)
    cells[is_soft_edge] = FREE


def _fill_from_around(cells: Cells, ignored: BoolArray) -> None:
    """Replace each ignored cell by the nearest other cell; cells far from all others become free."""
    halo = STRIP_ROWS // 4
    original = cells.copy()
    for top in range(0, len(cells), STRIP_ROWS):
        low = max(top - halo, 0)
        high = min(top + STRIP_ROWS + halo, len(cells))
        strip = ignored[low:high]
        inner = ignored[top : top + STRIP_ROWS]
        if not inner.any():
            continue
        if strip.all():
            cells[top : top + STRIP_ROWS] = FREE
            continue
        indices = ndimage.distance_transform_edt(strip, return_distances=False, return_indices=True)
        row, column = indices[:, top - low : top - low + len(inner)][:, inner]
        cells[top : top + STRIP_ROWS][inner] = original[low:high][row, column]


def has_transparent_background(cells: Cells) -> bool:
    """Return whether a picture is mostly transparent, with dark paint and hardly any light pixels."""
    counts = np.bincount(cells.ravel(), minlength=3)
    return bool(counts[FREE] < _MAX_LIGHT_RATIO * counts[BLOCKED] and counts[UNKNOWN] > counts[BLOCKED] > 0)


def drop_strokes(cells: Cells, options: ReadOptions, cell: float, source_name: str) -> tuple[str, ...]:
    """Make strokes thinner than the option ``min_stroke`` free in `cells`; return lines of the report."""
    width = options.compute_stroke_width(cell)
    pixels = math.ceil(width / cell - 1e-9)
    if pixels > MAX_STROKE_PIXELS:
        problem = f"expected at most {MAX_STROKE_PIXELS} pixels, got {pixels}"
        raise MapError(f"{source_name}: min_stroke: {problem}")
    solid = cells == BLOCKED
    thin = solid & ~remove_thin_strokes(solid, pixels)
    count = int(np.count_nonzero(thin))
    if not count:
        return ()
    cells[thin] = FREE
    pieces = ndimage.label(thin, structure=np.ones((3, 3)))[1]
    area = format_area(count * cell * cell, 3)
    strokes = f"strokes thinner than {pixels * cell:.3g} m ({pixels} px)"
    return (f"{strokes} in {format_count(pieces, 'piece')}, {area} (--min-stroke)",)


def _is_line_drawing(cells: Cells) -> bool:
    """Return whether the free cells are thin lines on a dark background, such as in a blueprint."""
    free = cells == FREE
    if not 0.0 < free.mean() < _MAX_LINE_FRACTION:
        return False
    width = min(max(round(_LINE_WIDTH_FRACTION * min(cells.shape)), 3), MAX_STROKE_PIXELS)
    return not remove_thin_strokes(free, width).any()


def require_free_cells(cells: Cells, unknown: str, picture: Brightness, source_name: str) -> None:
    """Raise MapError if no cell is free, with the likely cause; `unknown` says what unknown cells become."""
    counts = np.bincount(cells.ravel(), minlength=3)
    if counts[FREE] or (unknown == "free" and counts[UNKNOWN]):
        return
    if counts[UNKNOWN] > counts[BLOCKED]:
        percentage = 100 * counts[UNKNOWN] / cells.size
        treatment = "cut away" if unknown == "cut" else "treated as obstacles"
        cause = f"{percentage:.3g}% of the pixels are transparent and {treatment}"
        advice = "--unknown free treats transparent cells as free"
    else:
        darkest = picture.level.min() / picture.max_level
        lightest = picture.level.max() / picture.max_level
        cause = f"the brightness of the pixels is from {darkest:.2g} to {lightest:.2g}"
        advice = "--threshold, --invert and --free-color classify pixels differently"
    raise MapError(f"{source_name}: no cell is free: {cause} ({advice})")


def describe_doubts(cells: Cells, unknown: str, picture: Brightness) -> list[str]:
    """Return a note if nothing is solid, or if the light lines of a picture may be its walls."""
    counts = np.bincount(cells.ravel(), minlength=3)
    if not counts[BLOCKED] and unknown == "free" and counts[UNKNOWN]:
        percentage = 100 * counts[UNKNOWN] / cells.size
        return [
            f"nothing is solid: {percentage:.3g}% of the pixels are transparent (less than half opaque), "
            "which --unknown free treats as free"
        ]
    if _is_line_drawing(cells):
        percentage = 100 * counts[FREE] / cells.size
        light = f"only {percentage:.2g}% of the pixels are light, all of them thin lines"
        return [f"{light}: use --invert if they are the walls"]
    if not counts[BLOCKED] and not counts[UNKNOWN]:
        darkest = picture.level.min() / picture.max_level
        return [f"nothing is solid: the darkest pixel has a brightness of {darkest:.2g} (--threshold)"]
    return []
