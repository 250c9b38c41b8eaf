"""Random densities: two Gaussian peaks in the free space of a map."""

from dataclasses import replace

from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, UniformStart

HOT_SPOT_COUNT = 2
"""Number of peaks on a map."""
PEAK_WEIGHT = 20.0
"""Height of a peak above the floor, divided by the floor."""
PEAK_SIGMA_M = 1.0
"""Standard deviation of a peak."""
_FLOOR = 1.0
"""Density far from the peaks."""
_CLEARANCE_M = 0.3
"""Minimum distance of the center of a peak from obstacles."""


def add_hot_spots(environment: Environment, seed: int) -> Environment:
    """Return a copy of a map with a random density: Gaussian peaks on a constant floor.

    Parameters
    ----------
    environment : Environment
        The map.
    seed : int
        Seed of the centers of the peaks, which are drawn uniformly in the free space.

    Returns
    -------
    Environment
        The map with the new density; everything else is unchanged.
    """
    start = replace(environment, starts={"uniform": UniformStart()}).start("uniform")
    centers = start.sample(HOT_SPOT_COUNT, seed=seed, radius=_CLEARANCE_M).tolist()
    peaks = []
    for x, y in centers:
        # Rounding makes the centers the same on every processor.
        center = (round(x, 2), round(y, 2))
        peaks.append(Gaussian(center, weight=PEAK_WEIGHT, sigma=PEAK_SIGMA_M))
    return replace(environment, density=Gaussians(tuple(peaks), floor=_FLOOR))
