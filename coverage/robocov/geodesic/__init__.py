"""Exact shortest distances and paths in the free space of a map: the geodesic distance of equation (22).

`Geodesics` computes distances and paths. It searches a graph of the corners that see each other
(`corner_graph`). With an index of the walls around a point (`angular_index`), visibility from the point is
quickly tested. Walls and corners (`walls`) have integer coordinates (`integer_grid`), so that visibility
does not depend on rounding.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from robocov.geodesic.geodesics import Geodesics

__all__ = ["Geodesics"]
