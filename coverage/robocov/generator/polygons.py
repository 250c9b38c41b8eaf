"""Maps of the kind `polygons`: scattered obstacles, convex polygons, L and U shapes."""

import math
from collections import deque

import numpy as np
import shapely

from robocov.environment import DiscStart, Obstacle, PolygonObstacle
from robocov.generator.request import MapRequest
from robocov.typing import FloatArray

SHAPE_PROBABILITIES = {"convex": 0.6, "L": 0.2, "U": 0.2}
"""Probabilities of the shapes of obstacles. A U whose opening would be narrower than the gap becomes an L."""

_MIN_AREA_RATIO = 0.5
_MAX_AREA_RATIO = 1.5
"""Range of the areas of obstacles, before they are scaled to the requested total."""
_MAX_FILLED_FRACTION = 0.7
"""Maximum fraction of the map that obstacles fill, together with half of the gap around each of them."""
_MAX_MOVES = 12
"""Maximum number of obstacles that are moved to make space for others before the layout is abandoned."""
_MAX_OUTLINES = 8
"""Maximum number of outlines that are tried for one obstacle."""
_POSITIONS_PER_OUTLINE = 128
"""Number of random positions that are tested for each of these outlines."""
_MAX_REDRAWS = 8
"""Maximum number of times that an outline is sampled until it is suitable."""
_VERTEX_PROBABILITIES = {3: 0.1, 4: 0.25, 5: 0.3, 6: 0.2, 7: 0.15}
"""Numbers of vertices of a convex polygon, and their probabilities."""
_MIN_ANGLE_STEP = 0.4
"""Minimum angle between consecutive vertices, where the largest angle is 1 more. Then all angles are scaled
so that they add up to a full turn."""
_MAX_STRETCH = 1.7
"""Maximum ratio of the axes of the ellipse on which the vertices of a convex polygon lie."""
_L_WIDTHS = (1.0, 1.5)
"""Minimum and maximum width of an L, relative to its height."""
_L_THICKNESSES = (0.3, 0.5)
"""Minimum and maximum thickness of the arms of an L, relative to its width and its height."""
_U_WIDTHS = (1.0, 1.6)
_U_ARM_WIDTHS = (0.2, 0.3)
_U_BASE_HEIGHTS = (0.22, 0.35)
_U_RIGHT_HEIGHTS = (0.7, 1.0)
"""Minimum and maximum dimensions of a U, relative to the height of its left arm: its width, the widths of
its arms, the height of the base between the arms, and the height of its right arm."""
_MIN_ROUNDNESS = 0.52
"""Minimum area of a convex polygon, relative to the circle of the same perimeter (regular triangle: 0.6)."""
_ROUNDING_ERROR_M = 1e-9
"""Maximum rounding error of a distance."""


def scatter_polygons(
    request: MapRequest, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Scatter obstacles that are at least the requested gap from each other and from the boundary.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    corner_disc : DiscStart
        Disc that stays free of obstacles.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Obstacle or None
        The obstacles. None if they do not fit.
    """
    area_ratios = rng.uniform(_MIN_AREA_RATIO, _MAX_AREA_RATIO, request.obstacle_count)
    # The largest obstacle is placed first, when there is most space.
    areas = np.sort(area_ratios)[::-1]
    areas *= request.blocked_area / areas.sum()
    if _are_too_large(areas, request):
        return None
    start_disc = shapely.Point(corner_disc.center).buffer(corner_disc.radius)
    shapely.prepare(start_disc)
    names = list(SHAPE_PROBABILITIES)
    shapes = rng.choice(names, size=request.obstacle_count, p=list(SHAPE_PROBABILITIES.values()))
    queue = deque(zip(shapes.tolist(), areas.tolist(), strict=True))
    placed: list[tuple[str, float]] = []
    outlines: list[shapely.Polygon] = []
    move_count = 0
    while queue:
        shape, area = queue[0]
        outline = _place_shape(request, shape, area, np.array(outlines, dtype=object), start_disc, rng)
        if outline is not None:
            outlines.append(outline)
            placed.append(queue.popleft())
        elif move_count < _MAX_MOVES and placed:
            # Remove a random obstacle to make space, and place it again right after the current one.
            move_count += 1
            index = int(rng.integers(len(placed)))
            queue.insert(1, placed.pop(index))
            outlines.pop(index)
        else:
            return None
    return [PolygonObstacle(tuple(outline.exterior.coords[:-1])) for outline in outlines]


def _are_too_large(areas: FloatArray, request: MapRequest) -> bool:
    """Return whether obstacles fill too much of the map even as discs, which need the least space."""
    radii = np.sqrt(areas / np.pi) + request.gap / 2.0
    filled_area = float((np.pi * radii**2).sum())
    max_filled_area = _MAX_FILLED_FRACTION * (request.width - request.gap) * (request.height - request.gap)
    return filled_area > max_filled_area


def _place_shape(
    request: MapRequest,
    shape: str,
    area: float,
    placed_outlines: FloatArray,
    start_disc: shapely.Polygon,
    rng: np.random.Generator,
) -> shapely.Polygon | None:
    """Return a random outline of a shape at a free position; None if no free position is found.

    Several outlines are sampled, and each is tested at many random positions. At a free position, the outline
    keeps the gap from the boundary and from the outlines placed before, and does not touch the start disc.
    """
    gap = request.gap
    size = request.size
    tree = shapely.STRtree(placed_outlines)
    for _ in range(_MAX_OUTLINES):
        outline = _sample_shape(request, shape, area, rng)
        outline_size = np.ptp(outline, axis=0)
        free_size = size - 2.0 * gap - outline_size
        if (free_size < 0.0).any():
            continue
        offsets = rng.random((_POSITIONS_PER_OUTLINE, 2)) - 0.5
        centers = size / 2.0 + offsets * free_size
        candidates = shapely.polygons(request.round_points(centers[:, None] + outline))
        # Lower left and upper right corners of the bounding boxes, (k, 2) m each.
        low, high = np.split(shapely.bounds(candidates), 2, axis=1)
        min_low = gap - _ROUNDING_ERROR_M
        max_high = size - gap + _ROUNDING_ERROR_M
        is_inside = ((low >= min_low) & (high <= max_high)).all(axis=1)
        is_free = shapely.disjoint(candidates, start_disc) & shapely.is_valid(candidates) & is_inside
        # Measure the distances only to outlines whose bounding boxes are near enough.
        search_boxes = shapely.box(low[:, 0] - gap, low[:, 1] - gap, high[:, 0] + gap, high[:, 1] + gap)
        candidate_indices, placed_indices = tree.query(search_boxes)
        distances = shapely.distance(candidates[candidate_indices], placed_outlines[placed_indices])
        is_too_close = distances < gap
        is_free[candidate_indices[is_too_close]] = False
        if is_free.any():
            first_free = int(is_free.argmax())
            return candidates[first_free]
    return None


def _sample_shape(request: MapRequest, shape: str, area: float, rng: np.random.Generator) -> FloatArray:
    """Sample a random outline of a shape, (k, 2) m.

    The outline is an L if the opening of a U would be narrower than the gap.
    """
    if shape == "convex":
        return sample_convex_polygon(rng, area)
    if shape == "U":
        outline = sample_u_shape(rng, area, request.gap_before_rounding)
        if outline is not None:
            return outline
    return sample_l_shape(rng, area)


def sample_convex_polygon(rng: np.random.Generator, area: float) -> FloatArray:
    """Sample a random convex polygon that is usually not thin; its 3 to 7 vertices lie on an ellipse.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    area : float, m²
        Area of the polygon.

    Returns
    -------
    (k, 2) array, m
        Vertices. The bounding box is centered at the origin.
    """
    for _ in range(_MAX_REDRAWS):
        vertex_counts = list(_VERTEX_PROBABILITIES)
        vertex_count = int(rng.choice(vertex_counts, p=list(_VERTEX_PROBABILITIES.values())))
        angle_steps = _MIN_ANGLE_STEP + rng.random(vertex_count)
        angles = np.cumsum(angle_steps) * (2.0 * np.pi / angle_steps.sum())
        stretch = rng.uniform(1.0, _MAX_STRETCH)
        outline = np.column_stack([stretch * np.cos(angles), np.sin(angles)])
        polygon = shapely.Polygon(outline)
        # The last polygon is used even if it is thin.
        if 4.0 * math.pi * polygon.area >= _MIN_ROUNDNESS * polygon.length**2:
            break
    return _scale_and_rotate(outline, area, rng)


def sample_l_shape(rng: np.random.Generator, area: float) -> FloatArray:
    """Sample a random outline of an L of the given area, in a random direction.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    area : float, m²
        Area of the L.

    Returns
    -------
    (6, 2) array, m
        Vertices. The bounding box is centered at the origin.
    """
    # All lengths are relative to the height until the outline is scaled.
    width = rng.uniform(*_L_WIDTHS)
    relative_arm_width, arm_height = rng.uniform(*_L_THICKNESSES, 2)
    arm_width = width * relative_arm_width
    outline = np.array(
        [
            (0.0, 0.0),
            (width, 0.0),
            (width, arm_height),
            (arm_width, arm_height),
            (arm_width, 1.0),
            (0.0, 1.0),
        ]
    )
    return _scale_and_rotate(outline, area, rng)


def sample_u_shape(rng: np.random.Generator, area: float, min_opening: float) -> FloatArray | None:
    """Sample a random outline of a U of the given area, in a random direction. The arms may differ in length.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    area : float, m²
        Area of the U.
    min_opening : float, m
        Minimum width of the opening between the arms.

    Returns
    -------
    (8, 2) array, m, or None
        Vertices. The bounding box is centered at the origin. None if the opening was too narrow in every
        outline that was sampled.
    """
    # All lengths are relative to the height of the left arm until the outline is scaled.
    for _ in range(_MAX_REDRAWS):
        width = rng.uniform(*_U_WIDTHS)
        left_width, right_width = rng.uniform(*_U_ARM_WIDTHS, 2)
        base_height = rng.uniform(*_U_BASE_HEIGHTS)
        right_height = rng.uniform(*_U_RIGHT_HEIGHTS)
        outline = np.array(
            [
                (0.0, 0.0),
                (width, 0.0),
                (width, right_height),
                (width - right_width, right_height),
                (width - right_width, base_height),
                (left_width, base_height),
                (left_width, 1.0),
                (0.0, 1.0),
            ]
        )
        scale = math.sqrt(area / shapely.Polygon(outline).area)
        opening = (width - left_width - right_width) * scale
        if opening >= min_opening:
            return _scale_and_rotate(outline, area, rng)
    return None


def _scale_and_rotate(outline: FloatArray, area: float, rng: np.random.Generator) -> FloatArray:
    """Scale an outline to an area, rotate it at random, and center its bounding box at the origin."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    rotation = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    outline = outline @ rotation * math.sqrt(area / shapely.Polygon(outline).area)
    box_center = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
    return np.asarray(outline - box_center)
