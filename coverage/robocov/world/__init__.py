"""The physical world: robots and moving obstacles as pymunk bodies among solid pieces."""

from __future__ import annotations

from robocov.world.bodies import LONGEST_SUBSTEP, World
from robocov.world.contacts import MAX_PENETRATION

__all__ = ["LONGEST_SUBSTEP", "MAX_PENETRATION", "World"]
