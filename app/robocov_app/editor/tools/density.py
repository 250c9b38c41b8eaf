"""The density tool: hot spots and areas are dragged, and their weights are typed."""

import math
from typing import Literal, NamedTuple

import numpy as np
import shapely

from robocov.density import Gaussian, WeightedArea, WeightedPolygons
from robocov.environment import Point, Ring
from robocov_app.editor.edits import density
from robocov_app.editor.model.geometry import build_rectangle, distance, format_length
from robocov_app.editor.model.selection import Change
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.tool import CursorShape

DEFAULT_WEIGHT = 4.0  # of new features, until another weight is typed
MIN_SIGMA_M = 0.02
RIM_REACH_FRACTION = 0.6  # of the pointer's reach: rims and corners are picked within this distance
_OUTLINE_POINTS = 64


class _Hit(NamedTuple):
    """Element of the density at the pointer.

    Attributes
    ----------
    feature : int or None
        Index of the feature; None if there is none at the pointer.
    kind : {"feature", "rim", "corner"}
        Whether a drag moves the feature, the rim of a hot spot, or a corner of an area.
    corner : int
        Index of the corner.
    """

    feature: int | None = None
    kind: Literal["feature", "rim", "corner"] = "feature"
    corner: int = 0


class DensityTool(EditorTool):
    """Adds, moves, resizes, weights and removes hot spots or, if the density consists of areas, areas.

    Attributes
    ----------
    weight : float
        Weight of the next feature.
    chosen : int or None
        Index of the chosen feature, to which a typed weight applies.
    """

    name = "density"
    title = "Density"
    key = "d"
    hint = "drag from a hot spot's center outward; drag centers and rims; click a center, type its weight"

    def __init__(self) -> None:
        super().__init__()
        self.weight = DEFAULT_WEIGHT
        self.chosen: int | None = None
        self._hit = _Hit()

    @property
    def is_busy(self) -> bool:
        """Whether something is dragged or chosen."""
        return self.pressed is not None or self.chosen is not None

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Choose the feature under the pointer."""
        super().press(context, event)
        self._hit = _find_feature(density.list_features(context.sketch), event)
        if self._hit.feature is not None and self._hit.kind == "feature":
            self.chosen = self._hit.feature

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Drag a feature, its rim or corner, or draw a new feature."""
        if self.pressed is not None and event.has_moved_from(self.pressed.point):
            self.change = self._build_change(context, self.pressed.point, event.point)

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Apply the drag, or choose the feature that was clicked; a new or dragged feature is chosen, too."""
        pressed = self.pressed
        change = self.change
        self.pressed = None
        self.change = None
        if pressed is None:
            return
        if change is not None and not is_click:
            context.apply(change)
            self.chosen = self._hit.feature
            if self.chosen is None:
                self.chosen = len(density.list_features(context.sketch)) - 1
            return
        self.chosen = None
        if self._hit.kind == "feature":
            self.chosen = self._hit.feature
        if self.chosen is not None:
            context.show_message("type its weight, then Enter; Backspace removes it")

    def finish(self, context: EditorContext) -> None:
        """Deselect the feature whose weight would be typed."""
        self.chosen = None

    def remove_last(self, context: EditorContext) -> bool:
        """Remove the chosen feature; return whether there was one."""
        chosen = self.chosen
        self.chosen = None
        if chosen is None or chosen >= len(density.list_features(context.sketch)):
            return False
        context.apply(density.remove_feature(context.sketch, chosen))
        return True

    def cancel(self, context: EditorContext) -> bool:
        """Cancel the drag, and drop the choice of a feature."""
        was_busy = super().cancel(context)
        self.chosen = None
        return was_busy

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Set the weight of the chosen feature and of new ones."""
        weight = density.parse_weight(context.sketch, text)
        if self.chosen is not None:
            context.apply(density.set_weight(context.sketch, self.chosen, weight))
        self.weight = weight

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return outlines, centers and corners of all features, and the weight of the chosen one."""
        pending = self.pending
        features = density.list_features(pending or context.sketch)
        label = self._build_label(features)
        if not features and not label:
            return EditorToolOverlay(pending=pending)
        markers = [_find_center(feature) for feature in features]
        for feature in features:
            if isinstance(feature, WeightedArea):
                markers += feature.vertices
        outlines = tuple(_build_outline(feature) for feature in features)
        return EditorToolOverlay(
            pending=pending, label=label, outlines=outlines, markers=tuple(markers), chosen=self.chosen
        )

    def _build_label(self, features: tuple[density.Feature, ...]) -> str:
        """Return a label with the weight of the dragged or chosen feature; empty if there is none."""
        number = self.chosen
        if self.pressed is not None and self.change is not None:
            number = self._hit.feature
            if number is None:
                number = len(features) - 1
        if number is None or not 0 <= number < len(features):
            return ""
        feature = features[number]
        label = f"weight {feature.weight:g}"
        if isinstance(feature, Gaussian) and self.change is not None:
            label = f"σ {format_length(density.compute_spread(feature))}, {label}"
        return label

    def choose_cursor(self, context: EditorContext) -> CursorShape:
        """Return the shape of the cursor."""
        if self._hit.feature is not None and self.pressed is not None:
            return "move"
        return "cross"

    def _build_change(self, context: EditorContext, start: Point, end: Point) -> Change | None:
        """Return the change that a drag between two points, m, makes: it adds, moves or resizes a feature.

        None if the feature has been deleted during the drag.
        """
        sketch = context.sketch
        number = self._hit.feature
        if number is None:
            if isinstance(sketch.density, WeightedPolygons):
                area = WeightedArea(build_rectangle(start, end), self.weight)
                return density.add_area(sketch, area)
            return density.add_peak(sketch, start, max(distance(start, end), MIN_SIGMA_M), self.weight)
        features = density.list_features(sketch)
        if number >= len(features):
            return None
        feature = features[number]
        if isinstance(feature, Gaussian):
            if self._hit.kind == "rim":
                return density.resize_peak(sketch, number, distance(feature.center, end))
            # The center of a peak jumps to the pointer.
            start = feature.center
        elif self._hit.kind == "corner":
            return density.move_corner(sketch, number, self._hit.corner, end)
        return density.move_feature(sketch, number, end[0] - start[0], end[1] - start[1])


def _find_feature(features: tuple[density.Feature, ...], event: EditorPointerEvent) -> _Hit:
    """Find the feature at the pointer: first by centers, then by rims and corners, then inside areas."""
    point = event.unsnapped_point
    center_distances = [distance(_find_center(feature), point) for feature in features]
    if center_distances and min(center_distances) < event.reach:
        return _Hit(center_distances.index(min(center_distances)))
    hits: list[tuple[float, _Hit]] = []  # rims and corners with their distances, m
    for number, feature in enumerate(features):
        if isinstance(feature, WeightedArea):
            for corner, vertex in enumerate(feature.vertices):
                hits.append((distance(vertex, point), _Hit(number, "corner", corner)))
        elif feature.sigma is not None:
            rim_distance = abs(distance(feature.center, point) - feature.sigma)
            hits.append((rim_distance, _Hit(number, "rim")))
    if hits:
        smallest_distance, nearest = min(hits, key=lambda hit: hit[0])
        if smallest_distance < RIM_REACH_FRACTION * event.reach:
            return nearest
    pointer = shapely.Point(point)
    # Later areas are on top.
    for number in reversed(range(len(features))):
        feature = features[number]
        if isinstance(feature, WeightedArea) and feature.polygon.contains(pointer):
            return _Hit(number)
    return _Hit()


def _find_center(feature: density.Feature) -> Point:
    """Return the center of a hot spot, or a point inside an area."""
    if isinstance(feature, Gaussian):
        return feature.center
    ((x, y),) = feature.polygon.representative_point().coords
    return x, y


def _build_outline(feature: density.Feature) -> Ring:
    """Return the outline of an area, or the ellipse of one standard deviation around a hot spot."""
    if isinstance(feature, WeightedArea):
        return feature.vertices
    angles = np.linspace(0.0, math.tau, _OUTLINE_POINTS, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    # The Cholesky factor of the covariance maps the unit circle to this ellipse.
    points = circle @ np.linalg.cholesky(feature.matrix).T + feature.center
    return tuple((x, y) for x, y in points.tolist())
