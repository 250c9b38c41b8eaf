"""A certified lower bound of the coverage cost: no placement of a team has a lower cost.

Contents: `compute_lower_bound` returns a `LowerBound` (`bound`). It searches prices for the sites on a table
of distances (`price_table`), and proves a bound of the worth of positions at these prices (`worth_bounds`).

The cost (22) asks for the positions p of n robots at which the sum over the sites c of w_c min_i d(c, p_i) is
smallest: a p-median problem with geodesic distances d. For any prices u_c of the sites it is at least

    sum_c w_c u_c - n max_p worth(p),    worth(p) = sum_c w_c max(0, u_c - d(c, p)),

since min_i d_i is at least u - sum_i max(0, u - d_i): the Lagrangian dual of the p-median problem
(Cornuéjols, Fisher and Nemhauser 1977; from common knowledge of the paper, not from its text). Prices that
make this large are searched on a table of distances from some positions, without any proof. A bound of the
worth of all positions is then proved by branch and bound over triangles that cover them.
On a triangle T of free space, d(c, .) is the minimum of the lengths of the shortest paths to c that pass the
obstacles on given sides. Such a length is convex on T (the universal cover of the free space has no positive
curvature; for simple polygons Pollack, Sharir and Rote 1989), so it is nowhere below its tangent at a point
q in T, whose slope is that of the path's first segment. That segment ends at a corner v that q sees, or at
c. Hence d(c, p) is nowhere on T below the minimum of the tangents of |p - v| + d(v, c) over these corners,
and of |p - c| if q sees c. With these in place of the distances, the worth is convex in p, so that it is
largest at a vertex of T, and what that adds decreases with the square of the size of T.

The best placement may still cost more than the dual, since a robot cannot be in parts at several positions.
"""

from robocov.lower_bound.bound import MIN_PRECISION, LowerBound, compute_lower_bound

__all__ = ["MIN_PRECISION", "LowerBound", "compute_lower_bound"]
