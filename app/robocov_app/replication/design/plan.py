"""Extent of the study: the full one and the quick one, with all their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robocov_app.replication.design.contenders import OURS

ROBOTS = 6
"""Size of the team, as in the paper."""
PARTITION_SEED = 56
"""Seed of the positions in figure 1, in which no robot hides the center of mass of its cell."""

KINDS = ("corner", "centre", "uniform")
"""Kinds of starts, the same on all maps.

"corner": a disc near the lower left corner, as in the paper's figures 4 and 6. "centre": a disc near the
middle. "uniform": anywhere in the free space. The names are part of the inputs by which finished runs are
recognized, so the British spelling stays.
"""
CONVEX_KINDS = ("corner", "centre", "tight", "uniform")
"""Kinds of starts in convex regions. "tight": near the corner, the smallest disc for six robots."""

NON_CONVEX = (
    "blocks-a",
    "blocks-b",
    "l-shape",
    "rooms",
    "trap",
    "gaps",
    "cave",
    "courtyard",
    "corridor",
    "museum",
    "office",
    "warehouse",
    "city",
)
"""Bundled maps of the study: all that are not convex, except for ``campus``. It is 120 m wide, so that robots
at 1 m/s would not arrive before the run ends."""
CONVEX = ("square", "pentagon")
"""Bundled maps of the convex case."""
FAMILIES = ("blocks", "rooms", "caves")
"""Kinds of generated maps of the claims, in addition to maps with polygons. Each has its own generator."""
UNSEEN = ("blocks", "rooms", "caves", "mazes")
"""Kinds of generated maps on which the goals of our own controller are judged again."""

TEAM: Mapping[str, Any] = {
    "radius": 0.1,
    "max_speed": 1.0,
    "max_acceleration": 2.0,
    "viscosity": 2.0,
    "sensing_range": 6.0,
    "communication_range": None,
}
"""Team of every controller.

The sensing range equals the longest repulsion in the gain grids, so that only `rho_0` limits the distance at
which obstacles act. Communication is unlimited.
"""
LIMITED_RANGES: Mapping[str, float] = {"communication_range": 4.0, "sensing_range": 2.0}
"""Ranges of the runs at limited ranges, m. The paper limits both ranges, but does not give their values.

On a square with a side of ten meters, about a fifth of which is blocked, the share of each of six robots is a
square with a side of 3.7 m. So in a spread team, a robot is in communication range of its neighbors, but not
of the others. The sensing range is that of the shared repulsion.
"""


@dataclass(frozen=True)
class BeyondPlan:
    """Extent of the study beyond the paper; the defaults are those of the full study.

    Our own controller runs as often as RAPF.

    Parameters
    ----------
    bundled, generated, starts, seeds : tuple
        Bundled maps, seeds of generated maps, and kinds and seeds of starts for the baselines and our own
        controllers: a selection from those of the paper's claims.
    own_seeds, shared_seeds : tuple of int
        Seeds of starts for our own controller, and for its variant whose robots share their maps.
    tuning : tuple of int
        Seeds of the generated maps on which the gains of the baselines are tuned: a selection from those of
        the paper's tuning. If it is empty, the baselines keep their default gains.
    unseen : tuple of int
        Seeds of maps of the kinds in `UNSEEN`, on which our own controller is judged again and compared with
        RAPF and Lloyd's algorithm.
    maps, map_starts : tuple
        Seeds of generated maps, and kinds of starts, for targets, density and mixed teams.
    conditions_maps : tuple of str
        Maps for disturbances: all but the largest.
    conditions_seeds : int
        Number of seeds for disturbances.
    conditions_duration : float
        Duration of these runs, s.
    probe : float
        Duration of the runs from which the computing time is estimated, s. Controllers that plan need most
        of it at first, so shorter runs would make them appear slower than they are.
    worst : int
        Number of our controller's worst runs that are shown, each on another map.
    warm_up : int
        Number of steps before those that are timed.
    blocks : int
        Number of blocks of steps that are timed.
    large, huge : int
        Sizes of teams whose steps are timed, in addition to `ROBOTS`.
    """

    bundled: tuple[str, ...] = NON_CONVEX
    generated: tuple[int, ...] = tuple(range(1, 21))
    starts: tuple[str, ...] = KINDS
    seeds: tuple[int, ...] = (0,)
    own_seeds: tuple[int, ...] = (0, 1, 2, 3)
    shared_seeds: tuple[int, ...] = (0,)
    tuning: tuple[int, ...] = (101, 102, 103, 104)
    unseen: tuple[int, ...] = (301, 302, 303)
    maps: tuple[int, ...] = tuple(range(1, 13))
    map_starts: tuple[str, ...] = KINDS
    conditions_maps: tuple[str, ...] = NON_CONVEX[:-1]
    conditions_seeds: int = 3
    conditions_duration: float = 60.0
    probe: float = 60.0
    worst: int = 4
    warm_up: int = 100
    blocks: int = 5
    large: int = 50
    huge: int = 200

    def get_seeds(self, controller: str) -> tuple[int, ...]:
        """Return the seeds of the starts of a controller."""
        own_controller_seeds = dict(zip(OURS, (self.own_seeds, self.shared_seeds), strict=True))
        return own_controller_seeds.get(controller, self.seeds)


@dataclass(frozen=True)
class Plan:
    """Extent of a study; the defaults are those of the full study.

    The full study has 100 non-convex maps and 100 convex regions for the claims, and 12 maps for the gain
    grids.

    Parameters
    ----------
    name : str
        "full" or "quick".
    beyond : BeyondPlan
    duration : float
        Duration of every run, s.
    dt : float
        Control period, s.
    lattice : int
        Sites along a side of the lattice of the coverage cost.
    bundled, generated, families, starts, seeds : tuple
        Bundled maps, seeds of generated maps with polygons, seeds of generated maps of each of the kinds in
        `FAMILIES`, and kinds and seeds of starts for the claims. For the reason of the number of maps see
        `NEARLY_ALWAYS` in `robocov_app.replication.claims.thresholds`.
    limited_starts, limited_seeds : tuple
        Kinds and seeds of starts for the claims at limited ranges, on the same maps.
    tuning, tuning_families, tuning_starts, tuning_seed : tuple, tuple, tuple and int
        Seeds of the generated maps for the gain grids, with polygons and of each kind in `FAMILIES`, which no
        claim uses, kinds of starts, and a seed of starts that no claim uses.
    k_rep, rho_0, k_att : tuple of float
        Values of the gains in the grids.
    convex_generated, convex_starts, convex_seeds : tuple
        Seeds of the convex regions next to the bundled ones, and kinds and seeds of the starts there.
    restarts : int
        Restarts of the search for the reference placement.
    """

    name: str
    beyond: BeyondPlan
    duration: float = 120.0
    dt: float = 0.02
    lattice: int = 128
    bundled: tuple[str, ...] = NON_CONVEX
    generated: tuple[int, ...] = tuple(range(1, 61))
    families: tuple[int, ...] = tuple(range(401, 410))
    starts: tuple[str, ...] = KINDS
    seeds: tuple[int, ...] = (0, 1, 2, 3)
    limited_starts: tuple[str, ...] = KINDS
    limited_seeds: tuple[int, ...] = (0,)
    tuning: tuple[int, ...] = tuple(range(101, 107))
    tuning_families: tuple[int, ...] = (201, 202)
    tuning_starts: tuple[str, ...] = ("corner", "uniform")
    tuning_seed: int = 1000
    k_rep: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)
    rho_0: tuple[float, ...] = (1.0, 2.0, 3.0, 6.0)
    k_att: tuple[float, ...] = (1.0, 3.0, 10.0, 30.0)
    convex_generated: tuple[int, ...] = tuple(range(98))
    convex_starts: tuple[str, ...] = CONVEX_KINDS
    convex_seeds: tuple[int, ...] = (0, 1)
    restarts: int = 24


FULL = Plan("full", BeyondPlan())
"""The full study."""

QUICK = Plan(
    name="quick",
    duration=60.0,
    lattice=64,
    bundled=("blocks-a", "blocks-b", "rooms"),
    generated=tuple(range(1, 7)),
    families=(401,),
    starts=("corner", "uniform"),
    seeds=(0,),
    limited_starts=("corner",),
    k_rep=(0.3, 3.0),
    rho_0=(2.0, 6.0),
    k_att=(3.0, 30.0),
    convex_generated=tuple(range(10)),
    convex_starts=("corner", "uniform"),
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
"""The quick study, which takes four minutes: enough to check that everything works, but for few verdicts."""


def format_start(kind: str) -> str:
    """Return the name of a kind of starts as it is printed.

    Examples
    --------
    >>> format_start("centre"), format_start("corner")
    ('center', 'corner')
    """
    return "center" if kind == "centre" else kind
