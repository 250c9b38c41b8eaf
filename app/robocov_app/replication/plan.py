"""How much is run: the full study and the quick one, with all their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robocov_app.replication.contenders import OURS
from robocov_app.replication.maps import KINDS, NON_CONVEX

ROBOTS = 6
"""As in the paper."""

PARTITION_SEED = 56
"""Seed of the robots in figure 1: none hides the centre of mass of its cell."""

TEAM: Mapping[str, Any] = {
    "radius": 0.1,
    "max_speed": 1.0,
    "max_acceleration": 2.0,
    "viscosity": 2.0,
    "sensing_range": 6.0,
    "communication_range": None,
}
"""Parameters of the team, the same for every controller.

The sensors reach as far as the longest repulsion of the grids, so that `rho_0` alone says how far an obstacle
acts; robots hear each other everywhere."""


@dataclass(frozen=True)
class BeyondPlan:
    """How much is run beyond the paper.

    Attributes
    ----------
    bundled, generated : maps of the baselines, among those of the claims; None for all of them
    starts : kinds of starts of the baselines
    tuning : seeds of generated maps of the baselines' grids of gains, among those of the paper's grids
        Without any, baselines keep their defaults.
    seeds, own_seeds, shared_seeds : seeds of the starts, among those of the claims
        For the baselines, for our own controller, and for that which shares its map.
    unseen : seeds of generated maps
        On which nothing was looked at while our own controller was developed: it is judged there once more,
        beside RAPF and LA. May be empty.
    maps, map_starts : seeds of generated maps for targets, density and mixed teams, and their kinds of starts
    conditions_maps, conditions_seeds, conditions_duration : bundled maps, seeds and time (s) for disturbances
    probe : float, s
        Length of the runs by which the time of the others is estimated. Controllers that plan compute most at
        first: short ones are taken for slower than they are.
    worst : how many of our worst runs are shown, on different maps
    warm_up, blocks : steps before those that are timed, and blocks of steps that are
    large, huge : sizes of the teams whose steps are timed, beside `ROBOTS`
    """

    bundled: tuple[str, ...] | None
    generated: tuple[int, ...] | None
    starts: tuple[str, ...]
    tuning: tuple[int, ...]
    seeds: tuple[int, ...]
    own_seeds: tuple[int, ...]
    shared_seeds: tuple[int, ...]
    unseen: tuple[int, ...]
    maps: tuple[int, ...]
    map_starts: tuple[str, ...]
    conditions_maps: tuple[str, ...]
    conditions_seeds: int
    conditions_duration: float
    probe: float
    worst: int
    warm_up: int
    blocks: int
    large: int = 50
    huge: int = 200

    def seeds_of(self, controller: str) -> tuple[int, ...]:
        """Return the seeds of the starts of a controller's runs."""
        return dict(zip(OURS, (self.own_seeds, self.shared_seeds), strict=True)).get(controller, self.seeds)


@dataclass(frozen=True)
class Plan:
    """How much is run.

    Attributes
    ----------
    name : {"full", "quick"}
    duration, dt : float, s
        Of every run, and its control period.
    lattice : int
        Of the coverage cost.
    bundled, generated, seeds : bundled maps of the claims, seeds of generated ones, seeds of the starts
    tuning : seeds of generated maps of the grids of gains; none of them is in `generated`
    tuning_starts, tuning_seed : kinds of their starts, and the seed of these, which none of the claims has
    k_rep, rho_0, k_att : values of the grids
    convex_generated, convex_seeds : seeds of convex regions, beside the bundled ones, and of the starts there
    restarts : int
        Of the search for the centralised reference.
    """

    name: str
    duration: float
    bundled: tuple[str, ...]
    generated: tuple[int, ...]
    seeds: tuple[int, ...]
    tuning: tuple[int, ...]
    tuning_starts: tuple[str, ...]
    k_rep: tuple[float, ...]
    rho_0: tuple[float, ...]
    k_att: tuple[float, ...]
    convex_generated: tuple[int, ...]
    convex_seeds: tuple[int, ...]
    restarts: int
    beyond: BeyondPlan
    tuning_seed: int = 1000
    dt: float = 0.02
    lattice: int = 64


FULL = Plan(
    name="full",
    duration=120.0,
    bundled=NON_CONVEX,
    generated=tuple(range(1, 21)),
    seeds=(0, 1, 2, 3),
    tuning=tuple(range(101, 107)),
    tuning_starts=KINDS,
    k_rep=(0.1, 0.3, 1.0, 3.0, 10.0),
    rho_0=(1.0, 2.0, 3.0, 6.0),
    k_att=(1.0, 3.0, 10.0, 30.0),
    convex_generated=tuple(range(6)),
    convex_seeds=(0, 1, 2, 3),
    restarts=24,
    # baselines from every map and kind of start of the claims, once; our own as often as RAPF
    beyond=BeyondPlan(
        bundled=None,
        generated=None,
        starts=("corner", "centre", "uniform"),
        tuning=(101, 102, 103, 104),
        seeds=(0,),
        own_seeds=(0, 1, 2, 3),
        shared_seeds=(0,),
        unseen=tuple(range(201, 213)),
        maps=tuple(range(1, 11)),
        map_starts=("corner", "centre", "uniform"),
        conditions_maps=("rooms", "museum", "office", "blocks-a", "courtyard", "gaps"),
        conditions_seeds=3,
        conditions_duration=60.0,
        probe=60.0,
        worst=4,
        warm_up=100,
        blocks=5,
    ),
)
"""33 non-convex maps, 8 convex regions, 6 maps for gains."""

QUICK = Plan(
    name="quick",
    duration=60.0,
    bundled=("blocks-a", "blocks-b", "rooms"),
    generated=(1, 2, 3),
    seeds=(0,),
    tuning=tuple(range(101, 106)),
    tuning_starts=("corner", "uniform"),
    k_rep=(0.3, 3.0),
    rho_0=(2.0, 6.0),
    k_att=(3.0, 30.0),
    convex_generated=(0, 1, 2),
    convex_seeds=(0,),
    restarts=8,
    beyond=BeyondPlan(
        bundled=("rooms",),
        generated=(1,),
        starts=("corner",),
        tuning=(),
        seeds=(0,),
        own_seeds=(0,),
        shared_seeds=(0,),
        unseen=(),
        maps=(1,),
        map_starts=("corner",),
        conditions_maps=("rooms",),
        conditions_seeds=2,
        conditions_duration=15.0,
        probe=4.0,
        worst=1,
        warm_up=10,
        blocks=1,
    ),
)
"""Enough to see that everything works, too little to decide much; ends within four minutes."""
