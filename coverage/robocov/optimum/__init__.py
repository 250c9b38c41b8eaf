"""The centralized reference solution: the best positions that were found for a team that knows the whole map.

- `search`: the search for the best positions by many restarts
- `descent`: the descent of the exact cost to a local minimum
- `configuration_space`: the positions at which robots fit
"""

from robocov.optimum.configuration_space import ConfigurationSpace
from robocov.optimum.descent import descend
from robocov.optimum.search import MAX_RESTARTS, MAX_ROBOTS, Optimum, find_optimum

__all__ = [
    "MAX_RESTARTS",
    "MAX_ROBOTS",
    "ConfigurationSpace",
    "Optimum",
    "descend",
    "find_optimum",
]
