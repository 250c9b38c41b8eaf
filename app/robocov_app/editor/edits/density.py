"""Edits of the density: features of one kind, hot spots on a floor or weighted areas on a background."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import shapely

from robocov.density import MAX_WEIGHT, Density, Gaussian, Gaussians, Raster, WeightedArea, WeightedPolygons
from robocov.environment import Point, PolygonObstacle
from robocov.errors import MapError, format_count
from robocov.mapfile.models import MAX_SIZE_M
from robocov_app.editor.edits import create, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.geometry import check_point, drop_repeated_points, round_length, round_ring
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch

Feature: TypeAlias = Gaussian | WeightedArea
MIN_PEAK_WEIGHT = 1e-6  # smallest weight of a hot spot, and of every place where there is none


def list_features(sketch: Sketch) -> tuple[Feature, ...]:
    """Return the hot spots or the areas; none where the density is of another kind."""
    if isinstance(sketch.density, Gaussians):
        return sketch.density.peaks
    return sketch.density.areas if isinstance(sketch.density, WeightedPolygons) else ()


def compute_spread(peak: Gaussian) -> float:
    """Return the standard deviation of a hot spot, m: of one that is not round, the geometric mean."""
    (a, b), (c, d) = peak.matrix
    return float((a * d - b * c) ** 0.25) if peak.sigma is None else peak.sigma


def add_peak(sketch: Sketch, center: Point, sigma: float, weight: float) -> Change:
    """Add a hot spot; without a density, to one that is 1 everywhere."""
    if isinstance(sketch.density, WeightedPolygons | Raster) and not sketch.density.is_uniform:
        raise _other_kind(sketch.density, ", hot spots are not")
    peak = Gaussian(check_point(center), _weight(weight, least=MIN_PEAK_WEIGHT), _sigma(sigma))
    return _put(sketch, (*list_features(sketch), peak), "hot spot added")


def add_area(sketch: Sketch, area: WeightedArea) -> Change:
    """Add an area of constant weight on top; without a density, to one that is 1 everywhere."""
    if isinstance(sketch.density, Gaussians | Raster):
        raise _other_kind(sketch.density, ", areas are not")
    area = _sound(replace(area, vertices=drop_repeated_points(round_ring(area.vertices))))
    return _put(sketch, (*list_features(sketch), area), "area added")


def convert_polygons(sketch: Sketch, selection: Selection, weight: float) -> Change:
    chosen = [item.shape for item in selection.list_items(sketch)]
    shapes = [shape for shape in chosen if isinstance(shape, PolygonObstacle)]
    missing = "select polygons first: they become areas that count more, or less"
    require(len(shapes) == len(chosen) > 0, missing)
    after = sketch.without(selection.items)
    for shape in shapes:
        area = WeightedArea(shape.vertices, weight, shape.holes, shape.name)
        after = add_area(after, area).sketch
    return Change(after, Selection(), f"{format_count(len(shapes), 'polygon')} made an area of the density")


def remove_feature(sketch: Sketch, number: int) -> Change:
    """Take a feature away; with the last one the density goes."""
    words = f"{_name(_feature(sketch, number))} taken away"
    kept = [each for k, each in enumerate(list_features(sketch)) if k != number]
    return _put(sketch, kept, words) if kept else replace(remove_density(sketch), description=words)


def move_feature(sketch: Sketch, number: int, dx: float, dy: float) -> Change:
    return _changed(sketch, number, transform.Affine(x0=dx, y0=dy).apply(_feature(sketch, number)), "moved")


def resize_peak(sketch: Sketch, number: int, sigma: float) -> Change:
    """Give a hot spot another standard deviation, m; one that is not round keeps its shape."""
    peak, rounded = _feature(sketch, number), _sigma(sigma)
    if not isinstance(peak, Gaussian):
        raise MapError("there is no such hot spot any more")
    if peak.covariance is None:
        return _changed(sketch, number, replace(peak, sigma=rounded), "sized")
    factor = (sigma / compute_spread(peak)) ** 2
    (a, b), (c, d) = ((factor * x, factor * y) for x, y in peak.matrix)
    return _changed(sketch, number, replace(peak, covariance=((a, b), (c, d))), "sized")


def move_corner(sketch: Sketch, number: int, corner: int, to: Point) -> Change:
    area = _feature(sketch, number)
    if not isinstance(area, WeightedArea) or corner >= len(area.vertices):
        raise MapError("there is no such corner any more")
    points = (*area.vertices[:corner], check_point(to), *area.vertices[corner + 1 :])
    return _changed(sketch, number, _sound(replace(area, vertices=points)), "changed")


def set_weight(sketch: Sketch, number: int, weight: float) -> Change:
    feature = _feature(sketch, number)
    weight = _weight(weight, least=MIN_PEAK_WEIGHT if isinstance(feature, Gaussian) else 0.0)
    return _changed(sketch, number, replace(feature, weight=weight), f"weighs {weight:g}")


def set_floor(sketch: Sketch, floor: float) -> Change:
    """Let every place count so much, without the hot spots or outside the areas."""
    features = list_features(sketch)
    floor = _weight(floor, least=0.0 if features else MIN_PEAK_WEIGHT)
    return _put(sketch, features, f"every place counts {floor:g} at least", floor)


def remove_density(sketch: Sketch) -> Change:
    require(sketch.density is not None, "every place counts the same already")
    return Change(replace(sketch, density=None), Selection(), "density taken away")


def parse_weight(text: str) -> float:
    try:
        weight = float(text)
    except ValueError:
        raise MapError(f"expected a weight above 0, got “{text}”") from None
    return _weight(weight, least=MIN_PEAK_WEIGHT)


def describe_density(density: Density | None) -> str:
    if density is None:
        return "none: every place counts the same"
    if isinstance(density, Gaussians):
        return f"{format_count(len(density.peaks), 'hot spot')}, floor {density.floor:g}"
    if isinstance(density, Raster):
        rows, columns = density.values.shape
        return f"picture, {columns} x {rows}"
    kind = format_count(len(density.areas), "area") if isinstance(density, WeightedPolygons) else density.kind
    return f"{kind}, {density.min_value:g} to {density.max_value:g}"


def _other_kind(density: Density, wanted: str = "") -> MapError:
    return MapError(f"this map's density is a {density.kind}{wanted}: “density none” takes it away first")


def _put(sketch: Sketch, features: Sequence[Feature], words: str, base: float | None = None) -> Change:
    """Return the change to other features, and perhaps to another value where there are none."""
    density = sketch.density
    if isinstance(density, Gaussians):
        now = density.floor
    elif isinstance(density, WeightedPolygons):
        now = density.background
    elif density is None or density.is_uniform:
        now = 1.0 if density is None else density.max_value
    else:
        raise _other_kind(density)
    base = now if base is None else base
    peaks = tuple(each for each in features if isinstance(each, Gaussian))
    areas = tuple(each for each in features if isinstance(each, WeightedArea))
    heaviest = max([base, *(area.weight for area in areas)])
    require(heaviest > 0.0 or not areas, "some place must have a weight above 0")
    after = replace(sketch, density=WeightedPolygons(areas, base) if areas else Gaussians(peaks, base))
    return Change(after, Selection(), words)


def _changed(sketch: Sketch, number: int, feature: Feature, words: str) -> Change:
    features = list(list_features(sketch))
    features[number] = feature
    return _put(sketch, features, f"{_name(feature)} {words}")


def _feature(sketch: Sketch, number: int) -> Feature:
    features = list_features(sketch)
    require(0 <= number < len(features), "there is no such hot spot any more")
    return features[number]


def _name(feature: Feature) -> str:
    if isinstance(feature, Gaussian):
        return "hot spot"
    return f"area “{feature.name}”" if feature.name else "area"


def _sound(area: WeightedArea) -> WeightedArea:
    polygon = shapely.Polygon(area.vertices, area.holes) if len(area.vertices) >= 3 else shapely.Polygon()
    if not polygon.is_valid or polygon.area < create.MIN_DRAWN_LENGTH_M**2:
        raise MapError("an area needs three corners that enclose something, and an outline without crossings")
    return replace(area, weight=_weight(area.weight, least=0.0))


def _sigma(sigma: float) -> float:
    require(
        create.MIN_DRAWN_LENGTH_M <= sigma <= MAX_SIZE_M,
        "a hot spot needs a size: drag from its middle outwards",
    )
    return round_length(sigma)


def _weight(weight: float, *, least: float) -> float:
    if not least <= weight <= MAX_WEIGHT:
        raise MapError(f"weight: expected a number {'above' if least else 'from'} 0, got {weight:g}")
    return float(weight)
