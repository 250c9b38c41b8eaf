"""Maps: the outer boundary, obstacles, named starts, and the geometry derived from them.

- `environment`: the map itself
- `obstacles`, `obstacle_paths`: shapes that are solid, and how they move
- `starts`, `packing`: where teams start, and how many robots fit there
- `passages`: narrow gaps of the free space
- `closed_gaps`: thin bars across the gaps through which a robot does not fit
- `polygons`: robust operations on polygons
"""

from robocov.environment.closed_gaps import compute_center_areas
from robocov.environment.environment import Environment, require_environment
from robocov.environment.obstacle_paths import (
    REPEATS,
    ObstaclePath,
    Repeat,
    compute_swept_area,
)
from robocov.environment.obstacles import (
    MAX_SAGITTA_M,
    CircleObstacle,
    Obstacle,
    PolygonObstacle,
    WallObstacle,
    shift_obstacle,
)
from robocov.environment.passages import MIN_POCKET_AREA_M2, Gap, find_narrow_gaps, find_narrowest_gap
from robocov.environment.polygons import GRID_M, find_nearest_inside, find_overlaps
from robocov.environment.starts import (
    MAX_COUNTED_ROBOTS,
    MIN_START_GAP_RADII,
    DiscStart,
    PointsStart,
    Start,
    StartSpec,
    UniformStart,
    compute_start_clearance,
    compute_start_spacing,
)
from robocov.typing import Point, Ring

__all__ = [
    "GRID_M",
    "MAX_COUNTED_ROBOTS",
    "MAX_SAGITTA_M",
    "MIN_POCKET_AREA_M2",
    "MIN_START_GAP_RADII",
    "REPEATS",
    "CircleObstacle",
    "DiscStart",
    "Environment",
    "Gap",
    "Obstacle",
    "ObstaclePath",
    "Point",
    "PointsStart",
    "PolygonObstacle",
    "Repeat",
    "Ring",
    "Start",
    "StartSpec",
    "UniformStart",
    "WallObstacle",
    "compute_center_areas",
    "compute_start_clearance",
    "compute_start_spacing",
    "compute_swept_area",
    "find_narrow_gaps",
    "find_narrowest_gap",
    "find_nearest_inside",
    "find_overlaps",
    "require_environment",
    "shift_obstacle",
]
