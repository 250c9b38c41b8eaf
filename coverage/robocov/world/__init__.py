"""The physical world: robots and moving obstacles as pymunk bodies among solid pieces."""

from __future__ import annotations

from robocov.world.bodies import LONGEST_SUBSTEP, MAX_PENETRATION, World

__all__ = ["LONGEST_SUBSTEP", "MAX_PENETRATION", "World"]
