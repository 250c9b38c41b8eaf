"""Curves of DXF entities that their own `flattening` does not draw, or not as they are meant."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import BSpline

from robocov.extras import extra
from robocov_app.importers.curves import MOST_POINTS, sampled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.arrays import Array

_BULGE = 1e-9
"""Edges of polylines that are bent less are straight."""


def polyline(points: Array, bulges: Array, tolerance: float) -> Array:
    """Return points of a polyline, (k, 2); the bulge of each point is of the edge after it.

    A bulge is the tangent of a quarter of the angle that the edge is an arc over, positive to the left.

    Parameters
    ----------
    points : (k, 2)
    bulges : (k,)
        The last one is not used.
    tolerance : float

    Raises
    ------
    ValueError
        When there would be more than `MOST_POINTS`.
    """
    arcs = extra("ezdxf.math", "dxf")
    drawn = [points[:1]]
    left = float(MOST_POINTS)
    for (a, b), bulge in zip(pairwise(points), bulges[:-1].tolist(), strict=True):
        if abs(bulge) > _BULGE and (a != b).any():
            centre, begin, end, radius = arcs.bulge_to_arc(a, b, bulge)
            left -= 4 * math.atan(abs(bulge)) * math.sqrt(radius / tolerance / 8)
            if not left > 0.0:
                raise ValueError(f"more than {MOST_POINTS} points, but fewer were wanted")
            arc = arcs.ConstructionArc(centre, radius, *np.degrees([begin, end]))
            curve = flat(list(arc.flattening(min(tolerance, radius / 8))))
            drawn.append((curve if bulge > 0.0 else curve[::-1])[1:-1])
        drawn.append(b[None])
    return np.concatenate(drawn)


def spline(entity: Any, tolerance: float) -> Array:
    """Return points of an ezdxf spline: a rational B-spline, between the knots where it is defined.

    Its own `flattening` goes on to where it is not, which spoils closed ones (ezdxf 1.4).
    L. Piegl, W. Tiller, The NURBS Book, 2nd edition, Springer 1997, section 4.2.

    Raises
    ------
    ValueError
        When knots and control points do not fit together.
    """
    tool = entity.construction_tool()
    control, knots, degree = flat(tool.control_points), np.array(tool.knots(), dtype=float), tool.degree
    weights = np.array(tool.weights() or np.ones(len(control)), dtype=float)
    if not np.isfinite(knots).all() or not (np.isfinite(weights).all() and (weights > 0.0).all()):
        raise ValueError("knots and weights of a spline, but finite ones were wanted")
    rational = BSpline(knots, np.column_stack([control, np.ones(len(control))]) * weights[:, None], degree)
    breaks = np.unique(knots[degree : len(control) + 1])

    def curve(t: Array) -> Array:
        found = rational(t)
        return np.asarray(found[:, :2] / found[:, 2:])

    return sampled(curve, breaks, tolerance)


def flat(points: Sequence[Any]) -> Array:
    """Return ezdxf vectors as (k, 2)."""
    return np.array([(point[0], point[1]) for point in points], dtype=float).reshape(-1, 2)
