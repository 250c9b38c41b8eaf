"""Where the rays of the robots' own range sensors last met obstacles."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.observation import Observations


def last_returns(seen: Observations, before: Array | None) -> Array | None:
    """Return the points that each robot's last scan met, (n, rays, 2) m, nan where a ray met nothing.

    Between two scans a robot goes on with the points of the last one, which this function returned `before`.
    """
    scans = seen.scans
    if scans is None:
        return before
    reach = np.where(scans.hit, scans.distances, np.nan)
    return np.asarray(seen.positions[:, None] + reach[:, :, None] * scans.headings)


def with_nearest(seen: Observations, returns: Array | None) -> Array:
    """Return the obstacle points that each robot knows of, (n, k, 2) m, nan where none.

    The closest one, which is sensed at every step, comes first, then those of the last scan.
    """
    nearest = seen.obstacle_points[:, None]
    return nearest if returns is None else np.concatenate([nearest, returns], axis=1)
