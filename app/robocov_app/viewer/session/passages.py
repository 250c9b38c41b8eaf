"""Words on passages: what an edit of the map cuts off, and gaps too narrow for a robot."""

from collections.abc import Sequence

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import Environment, Point, find_narrow_gaps


def passage_words(
    before: Environment, after: Environment, radius: float, robots: Array | Sequence[Point] = ()
) -> str:
    """Return what an edit cuts off from robots of a radius, m, and what gap it leaves too narrow for them.

    `robots`: where they are, (n, 2) m.
    """
    words, stands = [], shapely.points(np.asarray(robots, dtype=float).reshape(-1, 2))
    rooms = [shapely.get_parts(each.free.buffer(-radius, quad_segs=4)) for each in (before, after)]
    inside = shapely.STRtree(rooms[0]).query(shapely.point_on_surface(rooms[1]), predicate="intersects")
    for room in range(len(rooms[0])):  # what hung together is left where robots are, else where it is largest
        parts = rooms[1][inside[0][inside[1] == room]]
        left = np.array([(shapely.distance(stands, part) <= radius).any() for part in parts], dtype=bool)
        if left.sum() > 1:
            words.append(f"the team is parted in {left.sum()}")
        if not left.any():
            left = shapely.area(parts) == shapely.area(parts).max(initial=0.0)
        lost = shapely.union_all(parts[~left])  # of places of centers
        area = shapely.area(shapely.intersection(after.free, shapely.buffer(lost, radius)))
        if area > radius * radius:
            words.append(f"{area:.1f} m² cut off")
    width = 2 * radius * (1 - 1e-6)  # what is just wide enough is wide enough
    known = {gap.between for gap in find_narrow_gaps(before.free, width)}
    new = [gap for gap in find_narrow_gaps(after.free, width) if gap.between not in known]
    words += [f"a gap of {100 * gap.width:.0f} cm, too narrow for a robot" for gap in new[:1]]
    return "; ".join(words)
