"""How much is run beyond the paper: against rivals, and for what the paper leaves to others."""

from __future__ import annotations

from dataclasses import dataclass

OURS = ("atlas", "atlas-shared")
"""The project's own controllers, that for which the goals are first; those that are registered take part."""

IN_CLAIMS = ("rapf", "rpf", "lloyd")
"""Controllers whose runs are those of the paper's claims: the same maps, starts and seeds."""

SMALL, LARGE, HUGE = 6, 50, 200
"""Sizes of the teams whose steps are timed."""


@dataclass(frozen=True)
class BeyondPlan:
    """How much is run.

    Attributes
    ----------
    bundled, generated : maps of the rivals, among those of the claims; None for all of them
    starts : names
        Kinds of starts of the rivals.
    tuning : seeds of generated maps of the rivals' grids of gains
        Among those of the paper's grids; without any, rivals keep their defaults.
    seeds, own_seeds, shared_seeds : seeds of the starts
        For the rivals, for our own controller, and for that which shares its map; among those of the claims.
    unseen : seeds of generated maps
        On which nothing was looked at while our own controller was developed: it is judged there once more,
        beside RAPF and LA. May be empty.
    maps : seeds of generated maps for targets, density and mixed teams
    map_starts : names
        Kinds of starts on them.
    conditions_maps : names of bundled maps for what goes wrong
    conditions_seeds : int
    conditions_duration : float, s
    probe : float, s
        Length of the runs by which the time of the others is estimated. Controllers that plan compute most at
        first: short ones are taken for slower than they are.
    worst : int
        So many of our worst runs are shown, on different maps.
    warm_up, blocks : int
        Steps before those that are timed, and blocks of `BLOCK` steps that are.
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

    def seeds_of(self, controller: str) -> tuple[int, ...]:
        """Return the seeds of the starts of a controller's runs."""
        return dict(zip(OURS, (self.own_seeds, self.shared_seeds), strict=True)).get(controller, self.seeds)


FULL = BeyondPlan(
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
)
"""Rivals from every map and kind of start of the claims, once; our own as often as RAPF."""

QUICK = BeyondPlan(
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
)
"""Two maps: every controller and every figure once, within a minute; nothing is decided."""
