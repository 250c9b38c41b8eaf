"""Howard, Mataric and Sukhatme's potential field: everything in range repels, friction brings to rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.arrays import Array
from robocov.controllers.driving import last_returns, summed
from robocov.controllers.gains import WithGains, gain
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.observation.scans import Scanning
from robocov.potential import separation
from robocov.robots import Team

_NEAREST = 0.05
"""Distance in metres below which the forces no longer grow; robots that touch are farther apart."""

_TOGETHER = 1e-9
"""Distance in metres at which robots in one place are taken to be."""

_WALL = 2.0 / (3.0 * np.pi)
"""What a straight wall at a distance of 1 does by all its rays, in parts of what a point there does."""


@dataclass(frozen=True, slots=True, eq=False)
class HowardMemory:
    """What the robots remember.

    Attributes
    ----------
    team : Team
        A robot knows its own viscosity.
    returns : (n, rays, 2) m or None
        What the last scan of each met.
    """

    team: Team
    returns: Array | None = None


@dataclass(frozen=True)
class Howard(WithGains):
    """Potential field of Howard, Mataric and Sukhatme (DARS 2002).

    Every robot is an electric charge among charges: the potential is the sum of k / r over all that the
    robot's sensors see, so that each obstacle and each robot pushes with k / r², without a range of its
    own. The equation of motion is m q'' = F - nu q' with the law's own friction, which takes the energy
    out until the team is at rest.

    The obstacles are what the rays of the range sensor meet. Each ray carries its share of the charge,
    so that `k_obs` means the same however many rays there are. Where there has been no scan yet, the
    closest point stands for a straight wall across. Below 5 cm the forces no longer grow.

    Taken from what is generally known of the paper, not from its text: sum over all ranged obstacles
    and robots, inverse-square forces, viscous friction. Decided here: the share of a ray, the cap
    below 5 cm, and that the robots are those which are heard, as the range sensor does not see robots.
    """

    name: ClassVar[str] = "howard"
    label: ClassVar[str] = "Potential field"
    summary: ClassVar[str] = (
        "potential field: all ranged obstacles and robots repel by 1/r², friction (Howard et al. 2002)"
    )
    scanning: ClassVar[Scanning] = Scanning(rays=72, period=0.1)

    k_robots: float = gain(3.0, "N m²", "charge of the other robots")
    k_obs: float = gain(1.0, "N m²", "charge of the obstacles, over a full turn of rays")
    friction: float = gain(2.0, "N s/m", "nu of the law, in place of the robots' own", high=20.0)

    def begin(self, region: Region, team: Team) -> HowardMemory:
        """Return what the robots know of themselves."""
        return HowardMemory(team)

    def decide(self, seen: Observations, memory: HowardMemory) -> Decision:
        """Return the forces F - nu q', but for what the world's viscosity does already."""
        team = memory.team
        returns = last_returns(seen, memory.returns)
        robots = self._from_robots(seen)
        obstacle = self._from_obstacles(seen, returns)
        friction = seen.velocities * (team.viscosity - self.friction)[:, None]
        return Decision(
            forces=robots + obstacle + friction,
            terms={"repulsion_robots": robots, "repulsion_obstacle": obstacle, "friction": friction},
            memory=HowardMemory(team, returns),
        )

    def _from_robots(self, seen: Observations) -> Array:
        n = len(seen.positions)
        robot, neighbour, offset, distance = seen.neighbours_within(2.0 * seen.region.diameter)
        together = distance < _TOGETHER
        offset[together] = _TOGETHER * separation(robot[together], neighbour[together])
        return summed(robot, self.k_robots * _inverse_square(offset), n)

    def _from_obstacles(self, seen: Observations, returns: Array | None) -> Array:
        if returns is None:
            offset = np.nan_to_num(seen.positions - seen.obstacle_points)
            return self.k_obs * _WALL * _inverse_square(offset)
        # nan where a ray met nothing
        offset = np.nan_to_num(seen.positions[:, None] - returns)
        return np.asarray(self.k_obs / returns.shape[1] * _inverse_square(offset).sum(axis=1))


def _inverse_square(offset: Array) -> Array:
    """Return (..., 2) vectors along the offsets, of length 1 / r²; zero where the offset is."""
    distance = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2)
    scale = np.maximum(distance, _NEAREST) ** 2 * np.maximum(distance, 1e-300)
    return np.asarray(offset / scale[..., None])
