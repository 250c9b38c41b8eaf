"""Edits of the density: features of one kind, hot spots on a floor or weighted areas on a background."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import shapely

from robocov.density import HEAVIEST, Density, Gaussian, Gaussians, Raster, WeightedArea, WeightedPolygons
from robocov.environment import Point, PolygonObstacle
from robocov.errors import MapError, counted
from robocov.mapfile.models import LARGEST
from robocov_app.editor.edits.create import SHORTEST
from robocov_app.editor.model.geometry import distinct, point_near, ring_near, tenths
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch

Feature: TypeAlias = Gaussian | WeightedArea

LIGHTEST = 1e-6  # smallest weight of a hot spot, and of every place where there is none


def features_of(sketch: Sketch) -> tuple[Feature, ...]:
    """Return the hot spots or the areas; none where the density is of another kind."""
    if isinstance(sketch.density, Gaussians):
        return sketch.density.peaks
    return sketch.density.areas if isinstance(sketch.density, WeightedPolygons) else ()


def spread_of(peak: Gaussian) -> float:
    """Return the standard deviation of a hot spot, m: of one that is not round, the geometric mean."""
    if peak.sigma is not None:
        return peak.sigma
    (a, b), (c, d) = peak.matrix
    return float((a * d - b * c) ** 0.25)


def peak_added(sketch: Sketch, center: Point, sigma: float, weight: float) -> Change:
    """Add a hot spot; without a density, to one that is 1 everywhere."""
    if isinstance(sketch.density, WeightedPolygons | Raster) and not sketch.density.uniform:
        raise _other_kind(sketch.density, ", hot spots are not")
    peak = Gaussian(point_near(center), _weight(weight, least=LIGHTEST), _sigma(sigma))
    return _put(sketch, (*features_of(sketch), peak), _base(sketch), "hot spot added")


def area_added(sketch: Sketch, points: Sequence[Point], weight: float) -> Change:
    """Add an area of constant weight on top; without a density, to one that is 1 everywhere."""
    if isinstance(sketch.density, Gaussians | Raster):
        raise _other_kind(sketch.density, ", areas are not")
    area = _sound(WeightedArea(distinct(ring_near(np.array(points, dtype=float).reshape(-1, 2))), weight))
    return _put(sketch, (*features_of(sketch), area), _base(sketch), "area added")


def areas_made(sketch: Sketch, selection: Selection, weight: float) -> Change:
    """Turn the selected polygons into areas of the density."""
    items = [item for item in sketch.obstacles if item.key in selection.items]
    if not items or not all(isinstance(item.shape, PolygonObstacle) for item in items):
        raise MapError("select polygons first: they become areas that count more, or less")
    after = sketch.without(selection.items)
    for item in items:
        assert isinstance(item.shape, PolygonObstacle)
        after = area_added(after, item.shape.vertices, weight).sketch
        *others, area = features_of(after)
        assert isinstance(area, WeightedArea)
        area = _sound(replace(area, holes=item.shape.holes, name=item.shape.name))
        after = _put(after, (*others, area), _base(after), "").sketch
    return Change(after, Selection(), f"{counted(len(items), 'polygon')} made an area of the density")


def removed(sketch: Sketch, number: int) -> Change:
    """Take a feature away; with the last one the density goes."""
    feature = _feature(sketch, number)
    features = features_of(sketch)
    kept = features[:number] + features[number + 1 :]
    words = f"{_name(feature)} taken away"
    return _put(sketch, kept, _base(sketch), words) if kept else _with(sketch, None, words)


def moved(sketch: Sketch, number: int, dx: float, dy: float) -> Change:
    """Move a feature by (dx, dy) m."""
    feature = _feature(sketch, number)
    if isinstance(feature, Gaussian):
        x, y = feature.center
        return _changed(sketch, number, replace(feature, center=point_near((x + dx, y + dy))), "moved")
    by = np.array([dx, dy])
    outline, *holes = (ring_near(np.array(ring) + by) for ring in (feature.vertices, *feature.holes))
    return _changed(sketch, number, replace(feature, vertices=outline, holes=tuple(holes)), "moved")


def peak_sized(sketch: Sketch, number: int, sigma: float) -> Change:
    """Give a hot spot another standard deviation; one that is not round keeps its shape."""
    peak, rounded = _feature(sketch, number), _sigma(sigma)
    if not isinstance(peak, Gaussian):
        raise MapError("there is no such hot spot any more")
    if peak.covariance is None:
        return _changed(sketch, number, replace(peak, sigma=rounded), "sized")
    factor = (sigma / spread_of(peak)) ** 2
    (a, b), (c, d) = ((factor * x, factor * y) for x, y in peak.matrix)
    return _changed(sketch, number, replace(peak, covariance=((a, b), (c, d))), "sized")


def corner_moved(sketch: Sketch, number: int, corner: int, to: Point) -> Change:
    """Move a corner of an area."""
    area = _feature(sketch, number)
    if not isinstance(area, WeightedArea) or corner >= len(area.vertices):
        raise MapError("there is no such corner any more")
    points = (*area.vertices[:corner], point_near(to), *area.vertices[corner + 1 :])
    return _changed(sketch, number, _sound(replace(area, vertices=points)), "changed")


def weighed(sketch: Sketch, number: int, weight: float) -> Change:
    """Give a feature another weight."""
    feature = _feature(sketch, number)
    least = LIGHTEST if isinstance(feature, Gaussian) else 0.0
    feature = replace(feature, weight=_weight(weight, least=least))
    return _changed(sketch, number, feature, f"weighs {feature.weight:g}")


def floor_set(sketch: Sketch, floor: float) -> Change:
    """Let every place count so much, without the hot spots or outside the areas."""
    features = features_of(sketch)
    floor = _weight(floor, least=0.0 if features else LIGHTEST)
    _base(sketch)
    return _put(sketch, features, floor, f"every place counts {floor:g} at least")


def density_removed(sketch: Sketch) -> Change:
    """Let every place count the same."""
    if sketch.density is None:
        raise MapError("every place counts the same already")
    return _with(sketch, None, "density taken away")


def weight_of(text: str) -> float:
    """Return a typed weight of a feature."""
    try:
        weight = float(text)
    except ValueError:
        raise MapError(f"“{text}”, but a weight was wanted: a number above 0") from None
    return _weight(weight, least=LIGHTEST)


def density_label(density: Density | None) -> str:
    """Return what a density is, in a few words."""
    if density is None:
        return "none: every place counts the same"
    if isinstance(density, Gaussians):
        return f"{counted(len(density.peaks), 'hot spot')}, floor {density.floor:g}"
    if isinstance(density, WeightedPolygons):
        return f"{counted(len(density.areas), 'area')}, {density.lowest:g} to {density.highest:g}"
    if isinstance(density, Raster):
        rows, columns = density.values.shape
        return f"picture, {columns} x {rows}"
    return f"{density.kind}, {density.lowest:g} to {density.highest:g}"


def _base(sketch: Sketch) -> float:
    density = sketch.density
    if isinstance(density, Gaussians):
        return density.floor
    if isinstance(density, WeightedPolygons):
        return density.background
    if density is None or density.uniform:
        return 1.0 if density is None else density.highest
    raise _other_kind(density)


def _other_kind(density: Density, wanted: str = "") -> MapError:
    return MapError(f"this map's density is a {density.kind}{wanted}: “density none” takes it away first")


def _put(sketch: Sketch, features: Sequence[Feature], base: float, words: str) -> Change:
    peaks = tuple(each for each in features if isinstance(each, Gaussian))
    areas = tuple(each for each in features if isinstance(each, WeightedArea))
    if areas and not max(base, *(area.weight for area in areas)) > 0.0:
        raise MapError("some place must have a weight above 0")
    return _with(sketch, WeightedPolygons(areas, base) if areas else Gaussians(peaks, base), words)


def _with(sketch: Sketch, density: Density | None, words: str) -> Change:
    return Change(replace(sketch, density=density), Selection(), words)


def _changed(sketch: Sketch, number: int, feature: Feature, words: str) -> Change:
    features = features_of(sketch)
    after = (*features[:number], feature, *features[number + 1 :])
    return _put(sketch, after, _base(sketch), f"{_name(feature)} {words}")


def _feature(sketch: Sketch, number: int) -> Feature:
    features = features_of(sketch)
    if not 0 <= number < len(features):
        raise MapError("there is no such hot spot any more")
    return features[number]


def _name(feature: Feature) -> str:
    if isinstance(feature, Gaussian):
        return "hot spot"
    return f"area “{feature.name}”" if feature.name else "area"


def _sound(area: WeightedArea) -> WeightedArea:
    polygon = shapely.Polygon(area.vertices, area.holes) if len(area.vertices) >= 3 else shapely.Polygon()
    if not polygon.is_valid or polygon.area < SHORTEST**2:
        raise MapError("an area needs three corners that enclose something, and an outline without crossings")
    return replace(area, weight=_weight(area.weight, least=0.0))


def _sigma(sigma: float) -> float:
    if not SHORTEST <= sigma <= LARGEST:
        raise MapError("a hot spot needs a size: drag from its middle outwards")
    return tenths(sigma)


def _weight(weight: float, *, least: float) -> float:
    if not least <= weight <= HEAVIEST:
        raise MapError(f"weight: {weight:g}, but a number {'above' if least else 'from'} 0 was wanted")
    return float(weight)
