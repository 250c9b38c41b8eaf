"""The bounding box of several maps that are drawn at the same scale."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from robocov.environment import Environment


@dataclass(frozen=True)
class Extent:
    """A bounding box, m."""

    low_x: float
    low_y: float
    high_x: float
    high_y: float

    @property
    def aspect(self) -> float:
        """Width divided by height."""
        return (self.high_x - self.low_x) / (self.high_y - self.low_y)

    @property
    def width(self) -> float:
        """Width, m."""
        return self.high_x - self.low_x


def enclose_maps(environments: Iterable[Environment]) -> Extent:
    """Compute the common bounding box of the regions of several maps."""
    bounds = np.array([environment.region.bounds for environment in environments])
    low_x, low_y = bounds[:, :2].min(axis=0).tolist()
    high_x, high_y = bounds[:, 2:].max(axis=0).tolist()
    return Extent(low_x, low_y, high_x, high_y)
