"""Observations and decisions: the types that the world and the controllers exchange.

Row i of `Observations` belongs to robot i: its own state, its neighbors, the nearest obstacle point that it
senses, and the convex region. A controller computes all rows at once for speed, but row i of its `Decision`
may depend only on row i and on the known positions of the neighbors of robot i. The types thus reflect that
control is distributed and that the obstacles are unknown.

- `observations`, `scans`, `region`: everything that the robots know
- `neighbors`: the communication graph
- `messages`: messages that robots send each other, in addition to their positions
- `decisions`, `cells`: the decision of a controller, and the cells that it uses
- `density_sensor`: measurements of a density that the robots do not know
- `snapshot`: the observations and the decision of one step
- `scanned_view`: the free space that is visible in a scan
- `close_pairs`, `bins`: pairs of points that are close to each other
"""

from robocov.observation.cells import Cells
from robocov.observation.decisions import Decision, check_decision, check_forces, copy_decision, to_numbers
from robocov.observation.density_sensor import DensitySensor, RecordedDensitySensor
from robocov.observation.messages import Message, ReceivedMessage
from robocov.observation.observations import NeighborPairs, Observations
from robocov.observation.scans import MAX_RAYS, Scanning, Scans, compute_ray_directions
from robocov.observation.snapshot import Snapshot

__all__ = [
    "MAX_RAYS",
    "Cells",
    "Decision",
    "DensitySensor",
    "Message",
    "NeighborPairs",
    "Observations",
    "ReceivedMessage",
    "RecordedDensitySensor",
    "Scanning",
    "Scans",
    "Snapshot",
    "check_decision",
    "check_forces",
    "compute_ray_directions",
    "copy_decision",
    "to_numbers",
]
