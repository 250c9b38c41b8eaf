"""Edits of the density: hot spots on top of a floor value, or weighted areas on top of a background value."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import shapely

from robocov.density import MAX_WEIGHT, Density, Gaussian, Gaussians, Raster, WeightedArea, WeightedPolygons
from robocov.environment import Point, PolygonObstacle
from robocov.errors import MapError, format_bound, format_count
from robocov_app.editor.edits import create, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import (
    drop_repeated_points,
    require_size,
    round_length,
    round_map_point,
    round_ring,
)
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch

Feature: TypeAlias = Gaussian | WeightedArea
MIN_PEAK_WEIGHT = 1e-6  # minimum weight of a hot spot, and of a density without features
WEIGHT_DECIMALS = 9  # decimal places of weights, so that saved maps contain exactly the weights of the editor


def list_features(sketch: Sketch) -> tuple[Feature, ...]:
    """Return the hot spots or areas of the density; empty if the density is of another kind."""
    if isinstance(sketch.density, Gaussians):
        return sketch.density.peaks
    if isinstance(sketch.density, WeightedPolygons):
        return sketch.density.areas
    return ()


def compute_spread(peak: Gaussian) -> float:
    """Return the standard deviation of a hot spot, m; if it is elliptic, the geometric mean of both axes."""
    if peak.sigma is not None:
        return peak.sigma
    (a, b), (c, d) = peak.matrix
    # The determinant is the product of both variances.
    return float((a * d - b * c) ** 0.25)


def add_peak(sketch: Sketch, center: Point, sigma: float, weight: float) -> Change:
    """Add a hot spot with a center and standard deviation, m; a map without density gets a floor of 1."""
    density = sketch.density
    if isinstance(density, WeightedPolygons | Raster):
        # A uniform image is replaced by a floor of the same weight, but areas would be lost.
        is_replaced = isinstance(density, Raster) and density.is_uniform
        if not is_replaced:
            raise _build_kind_error(density, "hot spots cannot be added to")
    peak = Gaussian(round_map_point(center), _round_weight(weight, MIN_PEAK_WEIGHT), _round_sigma(sigma))
    return _set_features(sketch, (*list_features(sketch), peak), "hot spot added")


def add_area(sketch: Sketch, area: WeightedArea) -> Change:
    """Add an area of constant weight on top of others; a map without density gets a background of 1."""
    if isinstance(sketch.density, Gaussians | Raster):
        raise _build_kind_error(sketch.density, "areas cannot be added to")
    area = _check_area(replace(area, vertices=drop_repeated_points(round_ring(area.vertices))))
    return _set_features(sketch, (*list_features(sketch), area), "area added")


def convert_polygons(sketch: Sketch, selection: Selection, weight: float) -> Change:
    """Turn the selected polygons into areas of the density with a given weight."""
    shapes = [item.shape for item in selection.list_items(sketch)]
    polygons = [shape for shape in shapes if isinstance(shape, PolygonObstacle)]
    are_polygons = len(polygons) == len(shapes) > 0
    require(are_polygons, "select polygons first: they become areas that count more, or less")
    changed = sketch.without(selection.items)
    for polygon in polygons:
        area = WeightedArea(polygon.vertices, weight, polygon.holes, polygon.name)
        changed = add_area(changed, area).sketch
    description = f"{format_count(len(polygons), 'polygon')} made an area of the density"
    return Change(changed, Selection(), description)


def remove_feature(sketch: Sketch, number: int) -> Change:
    """Remove a feature by its number; removing the last one removes the density."""
    description = f"{_name_feature(_get_feature(sketch, number))} removed"
    remaining = [feature for k, feature in enumerate(list_features(sketch)) if k != number]
    if remaining:
        return _set_features(sketch, remaining, description)
    return replace(remove_density(sketch), description=description)


def move_feature(sketch: Sketch, number: int, dx: float, dy: float) -> Change:
    """Move a feature by a displacement, m."""
    moved = transform.Affine(x0=dx, y0=dy).transform(_get_feature(sketch, number))
    return _replace_feature(sketch, number, moved, "moved")


def resize_peak(sketch: Sketch, number: int, sigma: float) -> Change:
    """Set the standard deviation of a hot spot, m; an elliptic one keeps its proportions."""
    peak = _get_feature(sketch, number)
    rounded = _round_sigma(sigma)
    if not isinstance(peak, Gaussian):
        raise MapError("this hot spot no longer exists")
    if peak.covariance is None:
        return _replace_feature(sketch, number, replace(peak, sigma=rounded), "sized")
    factor = (sigma / compute_spread(peak)) ** 2
    (a, b), (c, d) = peak.matrix
    covariance = ((factor * a, factor * b), (factor * c, factor * d))
    return _replace_feature(sketch, number, replace(peak, covariance=covariance), "sized")


def move_corner(sketch: Sketch, number: int, corner: int, position: Point) -> Change:
    """Move a corner of an area to a position, m."""
    area = _get_feature(sketch, number)
    if not isinstance(area, WeightedArea) or corner >= len(area.vertices):
        raise MapError("this corner no longer exists")
    vertices = (*area.vertices[:corner], round_map_point(position), *area.vertices[corner + 1 :])
    return _replace_feature(sketch, number, _check_area(replace(area, vertices=vertices)), "changed")


def set_weight(sketch: Sketch, number: int, weight: float) -> Change:
    """Set the weight of a feature."""
    feature = _get_feature(sketch, number)
    minimum = 0.0
    if isinstance(feature, Gaussian):
        minimum = MIN_PEAK_WEIGHT
    weight = _round_weight(weight, minimum)
    return _replace_feature(sketch, number, replace(feature, weight=weight), f"weighs {weight:g}")


def set_floor(sketch: Sketch, floor: float) -> Change:
    """Set the floor (the density far from hot spots) or the background (the density outside all areas)."""
    features = list_features(sketch)
    minimum = MIN_PEAK_WEIGHT
    if features:
        minimum = 0.0
    floor = _round_weight(floor, minimum, name="floor")
    description = f"the weight is at least {floor:g} everywhere"
    if isinstance(sketch.density, WeightedPolygons):
        # The weights of areas may be lower than the background.
        description = f"the weight is {floor:g} outside all areas"
    return _set_features(sketch, features, description, floor)


def remove_density(sketch: Sketch) -> Change:
    """Remove the density, so that all positions have the same weight."""
    require(sketch.density is not None, "all positions have the same weight already")
    return Change(replace(sketch, density=None), Selection(), "density removed")


def parse_weight(sketch: Sketch, text: str) -> float:
    """Parse a weight that the user typed for a hot spot or, if the density consists of areas, for an area.

    Raise MapError if it is invalid.
    """
    try:
        weight = float(text)
    except ValueError:
        raise MapError(f"weight: expected a number, got “{text}”") from None
    minimum = MIN_PEAK_WEIGHT
    if isinstance(sketch.density, WeightedPolygons):
        minimum = 0.0
    return _round_weight(weight, minimum)


def describe_density(density: Density | None) -> str:
    """Describe a density in a few words, for example "2 hot spots, floor 0.5"."""
    if density is None:
        return "none: equal everywhere"
    if isinstance(density, Gaussians):
        return f"{format_count(len(density.peaks), 'hot spot')}, floor {density.floor:g}"
    if isinstance(density, Raster):
        rows, columns = density.values.shape
        return f"image, {columns} x {rows}"
    kind = density.kind
    if isinstance(density, WeightedPolygons):
        kind = format_count(len(density.areas), "area")
    return f"{kind}, {density.lower_bound:g} to {density.upper_bound:g}"


def _build_kind_error(density: Density, problem: str) -> MapError:
    return MapError(f"{problem} a density of the kind “{density.kind}”: remove it first with “density none”")


def _set_features(
    sketch: Sketch, features: Sequence[Feature], description: str, base: float | None = None
) -> Change:
    """Return the change that replaces the features and, unless `base` is None, the floor or background."""
    # This raises an error for other kinds of densities, even if the value is replaced below.
    current_base = _get_base(sketch.density)
    if base is None:
        base = current_base
    peaks = tuple(feature for feature in features if isinstance(feature, Gaussian))
    areas = tuple(feature for feature in features if isinstance(feature, WeightedArea))
    density: Density
    if areas:
        max_weight = max(base, *(area.weight for area in areas))
        require(max_weight > 0.0, "at least one weight must be above 0")
        density = WeightedPolygons(areas, base)
    else:
        density = Gaussians(peaks, base)
    return Change(replace(sketch, density=density), Selection(), description)


def _get_base(density: Density | None) -> float:
    """Return the density outside all peaks and polygons, or its value if it is uniform (1 without a density).

    Raise MapError if the density is of another kind.
    """
    if density is None:
        return 1.0
    if isinstance(density, Gaussians):
        return density.floor
    if isinstance(density, WeightedPolygons):
        return density.background
    if density.is_uniform:
        return density.upper_bound
    raise _build_kind_error(density, "the editor cannot change")


def _replace_feature(sketch: Sketch, number: int, feature: Feature, action: str) -> Change:
    features = list(list_features(sketch))
    features[number] = feature
    return _set_features(sketch, features, f"{_name_feature(feature)} {action}")


def _get_feature(sketch: Sketch, number: int) -> Feature:
    features = list_features(sketch)
    require(0 <= number < len(features), "this hot spot no longer exists")
    return features[number]


def _name_feature(feature: Feature) -> str:
    if isinstance(feature, Gaussian):
        return "hot spot"
    if feature.name:
        return f"area “{feature.name}”"
    return "area"


def _check_area(area: WeightedArea) -> WeightedArea:
    """Return an area if it is valid.

    Raise MapError if it is too small, intersects itself, or has an invalid weight.
    """
    polygon = shapely.Polygon()
    if len(area.vertices) >= 3:
        polygon = shapely.Polygon(area.vertices, area.holes)
    if not polygon.is_valid or polygon.area < create.MIN_DRAWN_LENGTH_M**2:
        raise MapError("an area needs three corners that enclose an area, and an outline without crossings")
    return replace(area, weight=_round_weight(area.weight, 0.0))


def _round_sigma(sigma: float) -> float:
    require(sigma >= create.MIN_DRAWN_LENGTH_M, "a hot spot needs a size: drag outward from its center")
    require_size("size", sigma, create.MIN_DRAWN_LENGTH_M)
    return round_length(sigma)


def _round_weight(weight: float, minimum: float, *, name: str = "weight") -> float:
    if not minimum <= weight <= MAX_WEIGHT:
        limits = f"{format_bound(minimum)} to {format_bound(MAX_WEIGHT)}"
        raise MapError(f"{name}: expected a number from {limits}, got {weight:g}")
    return round(float(weight), WEIGHT_DECIMALS)
