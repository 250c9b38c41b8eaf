"""RPF: repulsion only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robocov.controllers.gains import WithGains, gain
from robocov.controllers.repulsion import forces_seen
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.robots import Team


@dataclass(frozen=True)
class Rpf(WithGains):
    """Repulsive potential field (Howard, Mataric and Sukhatme 2002), equations (23)-(25).

    Every robot is pushed away from the neighbours within `rho_0` and from the single closest
    obstacle point; viscosity brings the team to rest. The team often trembles there, because the
    single nearest obstacle point jumps, and the more the stronger the repulsion is, while it spreads
    hardly better. For the paper's protocol, which gives RPF and RAPF the same potential
    parameters, set `k_rep` and `rho_0` for both.
    """

    name: ClassVar[str] = "rpf"
    label: ClassVar[str] = "RPF"
    summary: ClassVar[str] = "repulsion from robots and the nearest obstacle only, (23)-(25)"

    k_rep: float = gain(3.0, "N m³", "strength of the repulsion, (24)")
    rho_0: float = gain(4.0, "m", "range of the repulsion, (24)", low=0.01, high=1e4)

    def begin(self, region: Region, team: Team) -> None:
        """Nothing is remembered."""

    def decide(self, seen: Observations, memory: None) -> Decision:
        """Return the forces (25)."""
        forces, _, robots, obstacle = forces_seen(seen, seen.positions, self.k_rep, self.rho_0)
        terms = {"repulsion_robots": robots, "repulsion_obstacle": obstacle}
        return Decision(forces=forces, terms=terms)
