"""Batalin and Sukhatme's local dispersion: away from whoever is near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robocov.arrays import Array
from robocov.controllers.driving import avoid, drive, last_returns, summed, with_nearest
from robocov.controllers.gains import WithGains, gain
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.observation.scans import Scanning
from robocov.potential import separation
from robocov.robots import Team

_TOGETHER = 1e-9
"""Distance in metres at which robots in one place are taken to be."""

_STILL = 0.01
"""Speed in m/s below which a robot has no direction in which it could go on."""


@dataclass(frozen=True, slots=True, eq=False)
class DispersionMemory:
    """What the robots remember.

    Attributes
    ----------
    team : Team
        A robot knows its own body and limits.
    returns : (n, rays, 2) m or None
        What the last scan of each met.
    """

    team: Team
    returns: Array | None = None


@dataclass(frozen=True)
class Dispersion(WithGains):
    """Local dispersion, the anonymous variant (Batalin and Sukhatme 2002, "Spreading out").

    Three behaviours, the first that has something to say before the others. *Avoid*: whatever is
    wanted, towards obstacle points and robots one goes only so fast that the distance falls
    exponentially to `clearance`; along them, it slides. *Disperse*: away from all robots within `reach`,
    by the sum of how much each is too near, at full speed at most. *Explore*: with nobody near, straight
    on at `explore_speed`. Robots need neither to be told apart nor to say anything.

    The paper's robots go at constant speed, and never rest. For placements to compare, a robot that is
    alone rests by default, and the speed falls to zero at `reach`, so that nobody trembles there.

    Taken from the paper's abstract and what is generally known of it, not from its text, are the
    behaviours and their order; the formula of each is made here. That others may be as large as the
    largest of the team is taken for granted.
    """

    name: ClassVar[str] = "dispersion"
    label: ClassVar[str] = "Dispersion"
    summary: ClassVar[str] = (
        "local dispersion: away from robots that are near, along obstacles (Batalin and Sukhatme 2002)"
    )

    scanning: ClassVar[Scanning] = Scanning(rays=36, period=0.1)

    reach: float = gain(5.0, "m", "distance up to which others are fled", low=0.01, high=1e4)
    k_disperse: float = gain(1.0, "1/s", "wanted speed per metre that another robot is too near")
    explore_speed: float = gain(0.0, "m/s", "speed of a robot that nobody is near", high=1e3)
    clearance: float = gain(0.2, "m", "distance from others' surfaces, to the centre", high=1e3)
    k_avoid: float = gain(
        2.0, "1/s", "approach speed per metre that the closest one is farther away", high=60.0
    )
    response_time: float = gain(
        0.1, "s", "time constant with which the wanted velocity is reached", low=0.02, high=10.0
    )

    def begin(self, region: Region, team: Team) -> DispersionMemory:
        """Return what the robots know of themselves."""
        return DispersionMemory(team)

    def decide(self, seen: Observations, memory: DispersionMemory) -> Decision:
        """Return the forces that bring each robot to the velocity that its behaviours want."""
        team = memory.team
        returns = last_returns(seen, memory.returns)
        largest = float(team.radius.max())
        keep = np.full(len(team), self.clearance)
        points = with_nearest(seen, returns)
        wanted = self._dispersing(seen, team)
        wanted = avoid(wanted, seen, team, points, keep, keep + largest, self.k_avoid, 0.5)
        forces = drive(wanted, seen, team, self.response_time)
        return Decision(forces=forces, terms={"attraction": forces}, memory=DispersionMemory(team, returns))

    def _dispersing(self, seen: Observations, team: Team) -> Array:
        n = len(seen.positions)
        robot, neighbour, offset, distance = seen.neighbours_within(self.reach)
        together = distance < _TOGETHER
        offset[together] = _TOGETHER * separation(robot[together], neighbour[together])
        flight = offset * (self.k_disperse * (self.reach / np.maximum(distance, _TOGETHER) - 1.0))[:, None]
        wanted = summed(robot, flight, n)
        if self.explore_speed > 0.0:
            speed = np.hypot(*seen.velocities.T)
            alone = (np.bincount(robot, minlength=n) == 0) & (speed > _STILL)
            wanted[alone] = seen.velocities[alone] * (self.explore_speed / speed[alone])[:, None]
        speed = np.hypot(*wanted.T)
        return np.asarray(wanted * np.minimum(1.0, team.max_speed / np.maximum(speed, 1e-300))[:, None])
