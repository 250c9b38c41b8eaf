"""Seeded random maps of several kinds, with the requested number of obstacles, blocked area and gaps.

- `generation`: a map of any kind, with its starts
- `blocks`, `caves`, `mazes`, `polygons`, `rooms`: the obstacles of each kind
- `request`: the parameters of a map
"""

from robocov.generator.generation import GENERATORS, generate_map

__all__ = ["GENERATORS", "generate_map"]
