"""A certified lower bound on the coverage cost: no placement of a team has a lower cost.

`compute_lower_bound` returns a `LowerBound` (`bound`). It searches for prices of the sites on a table of
distances (`price_table`), and proves an upper bound on the profit of a robot at these prices
(`profit_bounds`).

Minimizing the cost (22) means finding the positions p of n robots for which the sum over the sites c of
w_c min_i d(c, p_i) is smallest: a p-median problem with geodesic distances d. For any prices u_c of the
sites, this sum is at least

    sum_c w_c u_c - n max_p profit(p),    profit(p) = sum_c w_c max(0, u_c - d(c, p)),

because min_i d_i is at least u - sum_i max(0, u - d_i). The profit is what a robot at p would earn if each
site paid its price for being reached. This is the Lagrangian dual of the p-median problem (Cornuéjols, Fisher
and Nemhauser 1977; the original was not consulted). A first search for prices that make the bound large uses
a table of distances from some positions, and proves nothing yet. Branch and bound over triangles that cover
all positions then proves an upper bound on their profit.

On a triangle T of free space, d(c, .) is the minimum of the lengths of the shortest paths to c that pass the
obstacles on given sides. Such a length is convex on T (the universal cover of the free space has no positive
curvature; see Pollack, Sharir and Rote 1989 for simple polygons). It is therefore never below its tangent at
a point q in T, whose slope is that of the first segment of the path. That segment ends at a corner v that q
sees, or at c. Hence, on T, d(c, p) is never below the minimum of the tangents of |p - v| + d(v, c) over these
corners, and of |p - c| if q sees c. With this minimum in place of the distances, the profit is convex in p
and therefore largest at a vertex of T. The resulting overestimate decreases with the square of the size of T.

The best placement may still cost more than the dual, since a robot cannot be split between positions.
"""

from robocov.lower_bound.bound import MIN_PRECISION, LowerBound, compute_lower_bound

__all__ = ["MIN_PRECISION", "LowerBound", "compute_lower_bound"]
