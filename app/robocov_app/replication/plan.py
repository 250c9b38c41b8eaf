"""Extent of the study: the full one and the quick one, with all their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robocov_app.replication.contenders import OURS

ROBOTS = 6  # as in the paper
PARTITION_SEED = 56  # of the robots in figure 1: none hides the centre of mass of its cell

# Kinds of starts, the same on all maps: a disc near the lower left corner, as in the paper's figures 4 and 6,
# one near the middle, or anywhere in the free space; in convex regions also the smallest disc that holds six
# robots with a little room, near the corner. All but the last are clustered.
KINDS = ("corner", "centre", "uniform")
CONVEX_KINDS = ("corner", "centre", "tight", "uniform")

# bundled maps of the study: all that are not convex, but for ``campus``, which is 120 m wide: at 1 m/s the
# robots would not have arrived when the run ends
NON_CONVEX = (
    *("blocks-a", "blocks-b", "l-shape", "rooms", "trap", "gaps", "cave", "courtyard", "corridor"),
    *("museum", "office", "warehouse", "city"),
)
CONVEX = ("square", "pentagon")  # bundled maps of the convex case
UNSEEN = ("blocks", "rooms", "caves", "mazes")  # families of generated maps that no claim is tested on

# Of every controller's team. The sensors reach as far as the longest repulsion of the grids, so that `rho_0`
# alone says how far an obstacle acts; robots hear each other everywhere.
TEAM: Mapping[str, Any] = {"radius": 0.1, "max_speed": 1.0, "max_acceleration": 2.0, "viscosity": 2.0} | {
    "sensing_range": 6.0,
    "communication_range": None,
}


@dataclass(frozen=True)
class BeyondPlan:
    """Extent of the study beyond the paper; by default the full one, ours as often as RAPF."""

    # of baselines and ours: bundled maps, seeds of generated ones, kinds and seeds of starts, of the claims'
    bundled: tuple[str, ...] = NON_CONVEX
    generated: tuple[int, ...] = tuple(range(1, 21))
    starts: tuple[str, ...] = KINDS
    seeds: tuple[int, ...] = (0,)
    own_seeds: tuple[int, ...] = (0, 1, 2, 3)  # of our own controller
    shared_seeds: tuple[int, ...] = (0,)  # of that which shares its map
    # generated maps of the baselines' grids, among those of the paper's; without any they keep their defaults
    tuning: tuple[int, ...] = (101, 102, 103, 104)
    # seeds of maps of other families than those of the claims, `UNSEEN`: our own controller is judged there
    # once more, beside RAPF and LA
    unseen: tuple[int, ...] = (301, 302, 303)
    # targets, density and mixed teams
    maps: tuple[int, ...] = tuple(range(1, 13))
    map_starts: tuple[str, ...] = KINDS
    # disturbances
    conditions_maps: tuple[str, ...] = NON_CONVEX[:-1]  # but for the largest
    conditions_seeds: int = 3  # how many
    conditions_duration: float = 60.0  # s
    # s of the runs by which the time of the others is estimated: controllers that plan compute most at first,
    # and by short ones are taken for slower than they are
    probe: float = 60.0
    worst: int = 4  # how many of our worst runs are shown, on different maps
    warm_up: int = 100  # steps before those that are timed
    blocks: int = 5  # blocks of steps that are timed
    large: int = 50  # sizes of teams whose steps are timed, beside `ROBOTS`
    huge: int = 200

    def seeds_of(self, controller: str) -> tuple[int, ...]:
        return dict(zip(OURS, (self.own_seeds, self.shared_seeds), strict=True)).get(controller, self.seeds)


@dataclass(frozen=True)
class Plan:
    """Extent of a study; by default the full one: 100 non-convex maps, 100 convex regions, 12 for gains."""

    name: str  # "full" or "quick"
    beyond: BeyondPlan
    duration: float = 120.0  # s, of every run
    dt: float = 0.02  # s, its control period
    lattice: int = 128  # of the coverage cost
    # of the claims: bundled maps, seeds of generated ones, seeds of the starts; 100 maps, see `NEARLY_ALWAYS`
    bundled: tuple[str, ...] = NON_CONVEX
    generated: tuple[int, ...] = tuple(range(1, 88))
    seeds: tuple[int, ...] = (0, 1, 2, 3)
    # of the grids of gains: generated maps, none of them in `generated`, a seed of starts that no claim has
    tuning: tuple[int, ...] = tuple(range(101, 113))
    tuning_starts: tuple[str, ...] = ("corner", "uniform")
    tuning_seed: int = 1000
    k_rep: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)
    rho_0: tuple[float, ...] = (1.0, 2.0, 3.0, 6.0)
    k_att: tuple[float, ...] = (1.0, 3.0, 10.0, 30.0)
    # convex regions beside the bundled ones, and seeds of the starts there
    convex_generated: tuple[int, ...] = tuple(range(98))
    convex_seeds: tuple[int, ...] = (0, 1)
    restarts: int = 24  # of the search for the centralised reference


FULL = Plan("full", BeyondPlan())

# enough to see that everything works, too little to decide much; ends within four minutes
QUICK = Plan(
    name="quick",
    duration=60.0,
    lattice=64,
    bundled=("blocks-a", "blocks-b", "rooms"),
    generated=tuple(range(1, 10)),
    seeds=(0,),
    k_rep=(0.3, 3.0),
    rho_0=(2.0, 6.0),
    k_att=(3.0, 30.0),
    convex_generated=tuple(range(10)),
    convex_seeds=(0,),
    restarts=8,
    beyond=BeyondPlan(
        bundled=("rooms",),
        generated=(1,),
        starts=("corner",),
        own_seeds=(0,),
        tuning=(),
        unseen=(),
        maps=(1,),
        map_starts=("corner",),
        conditions_maps=("rooms",),
        conditions_seeds=2,
        conditions_duration=12.0,
        probe=4.0,
        worst=1,
        warm_up=10,
        blocks=1,
    ),
)
