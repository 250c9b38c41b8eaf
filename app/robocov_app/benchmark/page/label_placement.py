"""Placement of labels next to the marks of a plot."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import shapely

from robocov.typing import FloatArray, IntArray

Frame: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, right and top edge of the area in which labels may be placed, px."""
CHARACTER_WIDTH_PX = 6.0
"""Mean width of the characters of a label."""
LINE_HEIGHT_PX = 13.0
MARK_HALF_SIZE_PX = 6.0
_LABEL_DISTANCES_PX = (8.0, 24.0, 48.0, 80.0)
"""Possible horizontal distances of a label from the center of its mark."""
_LABEL_ROWS = np.arange(-10.0, 10.25, 0.25)
"""Heights at which a label may be placed, in lines above its mark."""
_HEIGHT_COST = 0.1
"""Cost per pixel of height above or below the mark, so that labels level with their marks win."""
_OVERLAP_COST = 10.0
"""Cost per square pixel that a label shares with marks or other labels, in pixels of distance."""
_LINE_COST = 3.0
"""Cost per pixel of the line that a label covers, in pixels of distance."""
_OUTSIDE_COST = 1000.0
"""Cost per square pixel of a label outside the frame, which would be cut off or cover the axes."""
_MAX_ROUNDS = 6
"""Maximum number of passes over all labels."""


def place_labels(marks: FloatArray, labels: Sequence[str], frame: Frame, line: FloatArray) -> FloatArray:
    """Place labels close to their marks.

    If possible, they hide no marks and no other labels, and do not cross a given line.

    Parameters
    ----------
    marks : (n, 2) array, px
        Centers of the marks.
    labels : sequence of str
        Texts of the labels.
    frame : Frame
        Area in which the labels must be.
    line : (k, 2) array, px
        Vertices of the line that labels should not cross; may be empty.

    Returns
    -------
    (n, 2) array, px
        Centers of the labels.
    """
    half_sizes = compute_half_sizes(labels)
    mark_boxes = np.hstack([marks - MARK_HALF_SIZE_PX, marks + MARK_HALF_SIZE_PX])
    candidates = []
    costs = []
    for mark, half_size in zip(marks, half_sizes, strict=True):
        centers = mark + _list_offsets(half_size)
        boxes = np.hstack([centers - half_size, centers + half_size])
        candidates.append(boxes)
        costs.append(_compute_costs(mark, boxes, mark_boxes, frame, line))
    # From top to bottom, so that few lines to labels cross.
    order = np.argsort(-marks[:, 1], kind="stable")
    chosen = _choose_candidates(candidates, costs, order)
    placed = [boxes[k] for boxes, k in zip(candidates, chosen, strict=True)]
    return np.array([0.5 * (box[:2] + box[2:]) for box in placed])


def _compute_costs(
    mark: FloatArray, boxes: FloatArray, mark_boxes: FloatArray, frame: Frame, line: FloatArray
) -> FloatArray:
    """Return the cost of placing the label of a mark in each of k boxes, without other labels, (k,)."""
    half_sizes = 0.5 * (boxes[:, 2:] - boxes[:, :2])
    centers = boxes[:, :2] + half_sizes
    label_areas = 4.0 * half_sizes.prod(axis=1)
    outside_areas = label_areas - _compute_overlaps(boxes, np.array([frame]))[:, 0]
    covered_areas = _compute_overlaps(boxes, mark_boxes).sum(axis=1)
    distances = np.linalg.norm(compute_nearest_points(mark, centers, half_sizes) - mark, axis=1)
    heights = np.abs(centers[:, 1] - mark[1])
    costs: FloatArray = distances + _HEIGHT_COST * heights
    costs += _OUTSIDE_COST * outside_areas + _OVERLAP_COST * covered_areas
    costs += _LINE_COST * _compute_covered_lengths(boxes, line)
    return costs


def _choose_candidates(
    candidates: Sequence[FloatArray], costs: Sequence[FloatArray], order: IntArray
) -> IntArray:
    """Choose the cheapest box for each label, repeating until no choice changes.

    Parameters
    ----------
    candidates : sequence of (k, 4) array, px
        Possible boxes of each label.
    costs : sequence of (k,) array
        Cost of each of these boxes without other labels.
    order : (n,) array
        Indices of the labels in the order in which they choose.

    Returns
    -------
    (n,) array
        Index of the chosen box of each label.
    """
    chosen = np.full(len(candidates), -1, dtype=np.intp)
    for _ in range(_MAX_ROUNDS):
        previous = chosen.copy()
        for k in order:
            others = [candidates[j][chosen[j]] for j in order if j != k and chosen[j] >= 0]
            # Without other boxes, the array must still have four columns.
            other_boxes = np.reshape(others, (-1, 4))
            overlaps = _compute_overlaps(candidates[k], other_boxes).sum(axis=1)
            # Costs that differ only by rounding are equal on all platforms: the first candidate wins.
            chosen[k] = np.argmin(np.round(costs[k] + _OVERLAP_COST * overlaps, 6))
        if np.array_equal(chosen, previous):
            break
    return chosen


def compute_half_sizes(labels: Sequence[str]) -> FloatArray:
    """Return half the approximate width and height of each label, (n, 2) px."""
    return np.array([(0.5 * CHARACTER_WIDTH_PX * len(label), 0.5 * LINE_HEIGHT_PX) for label in labels])


def compute_nearest_points(mark: FloatArray, centers: FloatArray, half_sizes: FloatArray) -> FloatArray:
    """Return the point of each label that is closest to a mark, with the shape of `centers`, px."""
    return np.clip(mark, centers - half_sizes, centers + half_sizes)


def _list_offsets(half_size: FloatArray) -> FloatArray:
    """Return the possible offsets of the center of a label from its mark, (k, 2) px."""
    offsets = []
    for row in _LABEL_ROWS:
        height = row * LINE_HEIGHT_PX
        for distance in _LABEL_DISTANCES_PX:
            offsets += [(half_size[0] + distance, height), (-half_size[0] - distance, height)]
        # Farther away, a label may also be centered above or below its mark.
        if abs(row) > 1.0:
            offsets.append((0.0, height))
    return np.array(offsets)


def _compute_covered_lengths(boxes: FloatArray, line: FloatArray) -> FloatArray:
    """Return the length of a line in each of n boxes, (n,) px; zero for a line of fewer than two vertices."""
    if len(line) < 2:
        return np.zeros(len(boxes))
    pieces = shapely.intersection(shapely.box(*boxes.T), shapely.LineString(line))
    return np.asarray(shapely.length(pieces))


def _compute_overlaps(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """Return the area that each of n boxes shares with each of m boxes, (n, m) px².

    A box is a row with its left, bottom, right and top edge.
    """
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    areas: FloatArray = np.clip(high - low, 0.0, None).prod(axis=2)
    return areas
