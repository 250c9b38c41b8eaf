"""The centralised reference: the best positions for a team that knows the whole map.

Contents: `find_optimum` searches the positions (`search`). It descends the exact cost (`descent`) within the
space where robots fit (`configuration_space`).
"""

from robocov.optimum.configuration_space import ConfigurationSpace, find_nearest_inside
from robocov.optimum.descent import descend
from robocov.optimum.search import MAX_RESTARTS, MAX_ROBOTS, Optimum, find_optimum

__all__ = [
    "MAX_RESTARTS",
    "MAX_ROBOTS",
    "ConfigurationSpace",
    "Optimum",
    "descend",
    "find_nearest_inside",
    "find_optimum",
]
