"""The physical world: robots as pymunk bodies among static polygons and moving obstacles.

- `world`, `changing_world`: the world of a team that stays the same, and of a team whose robots fail and join
- `dynamics`, `unicycles`: the net force that pymunk integrates, computed from the force of a controller
- `contacts`, `bodies`: contacts of robots, and the states of pymunk bodies as arrays
- `obstacle_pieces`, `free_positions`: obstacles as convex polygons, and free positions for robots
"""

from robocov.world.changing_world import ChangingWorld
from robocov.world.contacts import MAX_PENETRATION_M
from robocov.world.world import MAX_MASS_RATIO, MAX_SUBSTEP_S, World

__all__ = ["MAX_MASS_RATIO", "MAX_PENETRATION_M", "MAX_SUBSTEP_S", "ChangingWorld", "World"]
