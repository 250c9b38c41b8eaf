"""Curves of DXF entities as points of the drawing's plane, seen from above."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import BSpline

from robocov_app.importers.curves import arc, sampled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.arrays import Array

_BULGE = 1e-9
"""Edges of polylines that are bent less are straight."""


class Plane:
    """The plane that an entity is drawn in: turned or seen from behind where its extrusion says so.

    Parameters
    ----------
    axes : (2, 3)
        What a step along x, y and z of the entity is in the drawing, seen from above.
    """

    def __init__(self, axes: Array) -> None:
        self.axes = axes

    @classmethod
    def of(cls, entity: Any) -> Plane:
        """Return the plane of an ezdxf entity."""
        ocs = entity.ocs()
        steps = [ocs.to_wcs(step) for step in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        return cls(np.array([(step.x, step.y) for step in steps]).T)

    @property
    def is_level(self) -> bool:
        """Whether circles in it are circles from above."""
        across = self.axes[:, :2]
        return bool(np.abs(across.T @ across - np.eye(2)).max() < 1e-9)

    def above(self, points: Array) -> Array:
        """Return (k, 3) points of the plane as (k, 2) of the drawing."""
        return np.asarray(points @ self.axes.T)

    def arc(self, centre: Any, radius: float, begin: float, sweep: float, tolerance: float) -> Array:
        """Return points of an arc, angles in radians, with its first."""
        middle = self.above(np.array([[centre[0], centre[1], centre[2]]]))[0]
        u, v = self.axes[:, 0] * radius, self.axes[:, 1] * radius
        return with_start(middle, u, v, begin, sweep, tolerance)

    def polyline(self, points: Array, bulges: Array, height: float, tolerance: float) -> Array:
        """Return points of a polyline; the bulge of each point is of the edge after it.

        A bulge is the tangent of a quarter of the angle that the edge is an arc over, positive to the left.

        Parameters
        ----------
        points : (k, 2)
        bulges : (k,)
            The last one is not used.
        height : float
            Third coordinate in the plane.
        tolerance : float
        """
        drawn = [points[:1]]
        for (a, b), bulge in zip(pairwise(points), bulges[:-1].tolist(), strict=True):
            if abs(bulge) <= _BULGE or (a == b).all():
                drawn.append(b[None])
                continue
            half = (b - a) / 2
            # from the middle of the chord to the centre, in half chords: the cotangent of half the angle
            across = (1.0 / bulge - bulge) / 2
            centre = a + half + across * np.array([-half[1], half[0]])
            u = a - centre
            curve = arc(centre, u, np.array([-u[1], u[0]]), 0.0, 4.0 * math.atan(bulge), tolerance)
            curve[-1] = b
            drawn.append(curve)
        flat = np.concatenate(drawn)
        return self.above(np.column_stack([flat, np.full(len(flat), height)]))


def with_start(centre: Array, u: Array, v: Array, begin: float, sweep: float, tolerance: float) -> Array:
    """Return points of an elliptic arc, with its first; where it is whole, that one is the last again."""
    first = centre + u * math.cos(begin) + v * math.sin(begin)
    points = np.concatenate([first[None], arc(centre, u, v, begin, sweep, tolerance)])
    if abs(sweep) >= math.tau:
        points[-1] = points[0]
    return points


def ellipse(entity: Any, tolerance: float) -> Array:
    """Return points of an ezdxf ellipse or elliptic arc."""
    begin, end = float(entity.dxf.start_param), float(entity.dxf.end_param)
    sweep = (end - begin) % math.tau
    if sweep < 1e-9 or math.tau - sweep < 1e-9:
        sweep = math.tau
    centre, u, v = flat([entity.dxf.center, entity.dxf.major_axis, entity.minor_axis])
    return with_start(centre, u, v, begin, sweep, tolerance)


def spline(entity: Any, tolerance: float) -> Array:
    """Return points of an ezdxf spline: a rational B-spline, between the knots where it is defined.

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
