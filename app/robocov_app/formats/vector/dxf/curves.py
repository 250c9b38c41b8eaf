"""Points of the curves of DXF drawings: polylines with bulges, and splines."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from robocov.optional_imports import import_optional
from robocov.typing import FloatArray
from robocov_app.formats.geometry.curves import MAX_POINTS, sample_curve

_MIN_BULGE = 1e-9
"""Edges with a smaller bulge are straight lines."""


def to_plane(vectors: Sequence[Any]) -> FloatArray:
    """Return the first two coordinates of ezdxf vectors, (k, 2)."""
    return np.array([(vector[0], vector[1]) for vector in vectors], dtype=float).reshape(-1, 2)


def flatten_polyline(vertices: FloatArray, bulges: FloatArray, tolerance: float) -> FloatArray:
    """Approximate a polyline, whose edges may be arcs, by points.

    Parameters
    ----------
    vertices : (n, 2) array
    bulges : (n,) array
        Bulge of the edge from each vertex to the next: tan(angle / 4) of the arc, positive if it turns left.
    tolerance : float
        Maximum distance from the polyline.

    Returns
    -------
    (k, 2) array

    Raises
    ------
    ValueError
        If there would be too many points.
    """
    pieces = [vertices[:1]]
    remaining_points = MAX_POINTS
    for (start, end), bulge in zip(pairwise(vertices), bulges[:-1].tolist(), strict=True):
        if abs(bulge) > _MIN_BULGE and (start != end).any():
            arc = _flatten_bulge(start, end, bulge, tolerance, remaining_points)
            remaining_points -= len(arc)
            pieces.append(arc[1:-1])
        pieces.append(end[None])
    return np.concatenate(pieces)


def _flatten_bulge(
    start: FloatArray, end: FloatArray, bulge: float, tolerance: float, max_points: int
) -> FloatArray:
    """Return the points of an arc, (k, 2), from its start to its end.

    ValueError is raised, before the points are computed, if there would be more than about `max_points`.
    """
    ezdxf_math = import_optional("ezdxf.math", "dxf")
    center, start_angle, end_angle, radius = ezdxf_math.bulge_to_arc(start, end, bulge)
    # A chord whose arc is at most the tolerance away from it spans an angle of sqrt(8 tolerance / radius).
    point_count = 4 * math.atan(abs(bulge)) * math.sqrt(radius / (8 * tolerance))
    # The estimate is nan for coordinates that are too large.
    if math.isnan(point_count) or point_count >= max_points:
        raise ValueError(f"expected at most {MAX_POINTS} points, got more")
    arc = ezdxf_math.ConstructionArc(center, radius, *np.degrees([start_angle, end_angle]))
    # ezdxf's points run counter-clockwise, which is from the start to the end only for positive bulges.
    # Even with a large tolerance, a circle has about six sides.
    points = to_plane(list(arc.flattening(min(tolerance, radius / 8))))
    return points[::-1] if bulge < 0.0 else points


def flatten_spline(entity: Any, tolerance: float) -> FloatArray:
    """Approximate a rational B-spline by points.

    Parameters
    ----------
    entity : ezdxf.entities.Spline
    tolerance : float
        Maximum distance from the spline.

    Returns
    -------
    (k, 2) array

    Raises
    ------
    ValueError
        If a knot or a weight is not finite, or a weight is not positive.

    Notes
    -----
    The spline is sampled between the knots where it is defined. The method `flattening` of ezdxf 1.4 samples
    beyond them, which distorts closed splines. (L. Piegl, W. Tiller, The NURBS Book, 2nd edition, Springer
    1997, section 4.2.)
    """
    spline = entity.construction_tool()
    control_points = to_plane(spline.control_points)
    knots = np.array(spline.knots(), dtype=float)
    weights = np.array(spline.weights() or np.ones(len(control_points)), dtype=float)
    has_valid_weights = np.isfinite(weights).all() and (weights > 0.0).all()
    if not np.isfinite(knots).all() or not has_valid_weights:
        raise ValueError("expected finite knots and weights of a spline")
    homogeneous = np.column_stack([control_points, np.ones(len(control_points))])
    curve = BSpline(knots, homogeneous * weights[:, None], spline.degree)

    def compute_points(parameters: FloatArray) -> FloatArray:
        coordinates = curve(parameters)
        return np.asarray(coordinates[:, :2] / coordinates[:, 2:])

    breaks = np.unique(knots[spline.degree : len(control_points) + 1])
    return sample_curve(compute_points, breaks, tolerance)
