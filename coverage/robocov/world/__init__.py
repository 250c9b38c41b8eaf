"""The physical world: robots as pymunk bodies among static polygons and moving obstacles.

- `world`, `changing_world`: a team that stays the same, and one whose robots fail and join
- `dynamics`, `unicycles`: from a controller's force to the net force that pymunk integrates
- `contacts`, `bodies`: contacts, and pymunk's bodies as arrays
- `obstacle_pieces`, `free_positions`: obstacles as convex polygons, and free positions for robots
"""

from robocov.world.changing_world import ChangingWorld
from robocov.world.contacts import MAX_PENETRATION
from robocov.world.world import MAX_MASS_RATIO, MAX_SUBSTEP_S, World

__all__ = ["MAX_MASS_RATIO", "MAX_PENETRATION", "MAX_SUBSTEP_S", "ChangingWorld", "World"]
