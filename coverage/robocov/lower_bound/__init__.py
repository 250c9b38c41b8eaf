"""A certified lower bound on the coverage cost: no placement of a team has a lower cost.

`compute_lower_bound` returns a `LowerBound` (`bound`). It first searches for prices of the sites on a table
of distances (`site_distances`). For these prices, it then proves an upper bound on the profit of a robot
(`profit_bounds`).

Minimizing the cost (22) means finding the positions p_1, ..., p_n of the robots for which the sum over the
sites c of w_c min_i d(c, p_i) is smallest, where w_c is the weight of site c and d the geodesic distance.
This is a p-median problem. For any prices u_c of the sites, the sum is at least

    sum_c w_c u_c - n max_p profit(p),    profit(p) = sum_c w_c max(0, u_c - d(c, p)),

because min_i d_i is at least u - sum_i max(0, u - d_i). One can imagine that each site offers its price to a
robot that comes to it, and that the robot pays for the distance: the profit is what a robot at p would earn.
The bound is the Lagrangian dual of the p-median problem (Cornuéjols, Fisher and Nemhauser 1977; the original
was not consulted). Better prices give a higher bound. The search for them uses a table of the distances from
some positions only, so that it proves nothing yet. Branch and bound over triangles that cover all possible
positions then proves an upper bound on the profit.

On a triangle T of free space, d(c, .) is the minimum of the lengths of several paths, one for each choice of
the sides on which a shortest path to c can pass the obstacles. Each such length is convex on T (the universal
cover of the free space has no positive curvature; see Pollack, Sharir and Rote 1989 for simple polygons). It
is therefore never below its tangent at a point q in T, whose slope is that of the first segment of the path
from q. This segment ends at a corner v that q sees, or at c. Hence, on T, d(c, p) is never below the minimum
of the tangents of |p - v| + d(v, c) for these corners and, if q sees c, the tangent of |p - c|. If this
minimum replaces the distances, the profit becomes convex in p, and therefore has its maximum at a vertex of
T. The overestimate that results decreases with the square of the size of T.

The cost of the best placement may be higher than any such bound, since a robot cannot be divided among
several positions.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from robocov.lower_bound.bound import MIN_PRECISION, LowerBound, compute_lower_bound

__all__ = ["MIN_PRECISION", "LowerBound", "compute_lower_bound"]
