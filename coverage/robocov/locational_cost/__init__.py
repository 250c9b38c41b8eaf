"""The locational cost (4) of cells, its derivatives, and its optima.

- `performance`: the functions f of the distance, whose integral over a cell is the cost
- `integrals`: the cost, its gradient (11) and its Hessian, for density 1
- `weighted_derivatives`: the gradient and the Hessian for any density, by quadrature
- `best_points`: the point of each cell with the best cost, which is the target of its robot

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from robocov.locational_cost.integrals import (
    compute_derivatives,
    compute_gradients,
    compute_locational_costs,
)
from robocov.locational_cost.performance import Distance, Performance, Sensing, SquaredDistance

__all__ = [
    "Distance",
    "Performance",
    "Sensing",
    "SquaredDistance",
    "compute_derivatives",
    "compute_gradients",
    "compute_locational_costs",
]
