"""The tool for the density: hot spots and areas by dragging, their weights by typing."""

import math

import numpy as np
import shapely

from robocov.density import Gaussian, WeightedArea, WeightedPolygons
from robocov.environment import Point, Ring
from robocov_app.editor.edits import density
from robocov_app.editor.model.geometry import distance, length_words, rectangle
from robocov_app.editor.model.selection import Change
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, Workspace

FIRST_WEIGHT = 4.0  # weight of a new feature, until another weight is typed
_CORNERS = 64


class DensityTool(Tool):
    """Adds hot spots, moves, sizes and weighs them, and takes them away; areas where a map has those."""

    name = "density"
    hint = "drag from a hot spot's middle outwards; drag middles and rims; click a middle, type its weight"

    def __init__(self) -> None:
        super().__init__()
        self.weight = FIRST_WEIGHT
        self.chosen: int | None = None
        self._taken: int | None = None
        self._corner: int | None = None  # of an area; 0 of a hot spot whose rim was taken

    @property
    def busy(self) -> bool:
        return self.begun is not None or self.chosen is not None

    def press(self, context: Workspace, event: PointerEvent) -> None:
        super().press(context, event)
        self._taken, self._corner = _under(density.features_of(context.sketch), event)
        if self._taken is not None and self._corner is None:
            self.chosen = self._taken

    def move(self, context: Workspace, event: PointerEvent) -> None:
        if self.begun is not None and event.is_apart_from(self.begun.point):
            self.change = self._wanted(context, self.begun.point, event.point)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        begun, change, self.begun, self.change = self.begun, self.change, None, None
        if begun is not None and change is not None and not clicked:
            context.change(change)
            self.chosen = len(density.features_of(context.sketch)) - 1 if self._taken is None else self._taken
        elif begun is not None:
            self.chosen = self._taken if self._corner is None else None
            if self.chosen is not None:
                context.say("type what it weighs, then Enter; Backspace takes it away")

    def finish(self, context: Workspace) -> bool:
        had, self.chosen = self.chosen is not None, None
        return had

    def back(self, context: Workspace) -> bool:
        chosen, self.chosen = self.chosen, None
        if chosen is None or chosen >= len(density.features_of(context.sketch)):
            return False
        context.change(density.removed(context.sketch, chosen))
        return True

    def cancel(self, context: Workspace) -> bool:
        had, self.chosen = super().cancel(context), None
        return had

    def enter(self, context: Workspace, text: str) -> None:
        weight = density.weight_of(text)
        if self.chosen is not None:
            context.change(density.weighed(context.sketch, self.chosen, weight))
        self.weight = weight

    def preview(self, context: Workspace) -> Preview | None:
        features = density.features_of(self.change.sketch if self.change is not None else context.sketch)
        dots = [_middle(feature) for feature in features]
        dots += [point for area in features if isinstance(area, WeightedArea) for point in area.vertices]
        shown, words = self.chosen, ""
        if self.begun is not None and self.change is not None:
            shown = self._taken if self._taken is not None else len(features) - 1
        if shown is not None and 0 <= shown < len(features):
            feature = features[shown]
            words = f"weight {feature.weight:g}"
            if isinstance(feature, Gaussian) and self.change is not None:
                words = f"σ {length_words(density.spread_of(feature))}, {words}"
        if not features and not words:
            return None
        rings = tuple(map(_outline, features))
        return Preview(words=words, rings=rings, dots=tuple(dots), chosen=self.chosen)

    def shape_of_cursor(self, context: Workspace) -> str:
        return "move" if self._taken is not None and self.begun is not None else "cross"

    def _wanted(self, context: Workspace, begun: Point, to: Point) -> Change | None:
        sketch, number = context.sketch, self._taken
        if number is None and isinstance(sketch.density, WeightedPolygons):
            return density.area_added(sketch, WeightedArea(rectangle(begun, to), self.weight))
        if number is None:
            return density.peak_added(sketch, begun, max(distance(begun, to), 0.02), self.weight)
        if number >= len(features := density.features_of(sketch)):
            return None
        feature = features[number]
        if isinstance(feature, Gaussian):
            if self._corner is not None:
                return density.peak_sized(sketch, number, distance(feature.center, to))
            begun = feature.center
        elif self._corner is not None:
            return density.corner_moved(sketch, number, self._corner, to)
        return density.moved(sketch, number, to[0] - begun[0], to[1] - begun[1])


def _under(features: tuple[density.Feature, ...], event: PointerEvent) -> tuple[int | None, int | None]:
    """Return the feature under the cursor, and its rim or corner if that is; middles come first."""
    middles = [(distance(_middle(each), event.raw), k) for k, each in enumerate(features)]
    if middles and min(middles)[0] < event.reach:
        return min(middles)[1], None
    rims: list[tuple[float, int, int]] = []
    for k, each in enumerate(features):
        if isinstance(each, WeightedArea):
            rims += [(distance(point, event.raw), k, c) for c, point in enumerate(each.vertices)]
        elif each.sigma is not None:
            rims.append((abs(distance(each.center, event.raw) - each.sigma), k, 0))
    if rims and min(rims)[0] < 0.6 * event.reach:
        return min(rims)[1:]
    areas = [(k, each.polygon) for k, each in enumerate(features) if isinstance(each, WeightedArea)]
    inside = [k for k, polygon in areas if polygon.contains(shapely.Point(event.raw))]
    return (inside[-1] if inside else None), None


def _middle(feature: density.Feature) -> Point:
    if isinstance(feature, Gaussian):
        return feature.center
    ((x, y),) = feature.polygon.representative_point().coords
    return x, y


def _outline(feature: density.Feature) -> Ring:
    """Return the outline of an area, or that of a hot spot one standard deviation from its centre."""
    if isinstance(feature, WeightedArea):
        return feature.vertices
    turn = np.linspace(0.0, math.tau, _CORNERS, endpoint=False)
    points = np.column_stack([np.cos(turn), np.sin(turn)]) @ np.linalg.cholesky(feature.matrix).T
    return tuple((x, y) for x, y in (points + feature.center).tolist())
