"""The gains of the rivals: small grids, tried on maps on which nothing is tested, as RAPF's and RPF's are.

Of each rival one to three gains are tried that decide where it ends; those that say how hard a robot is
driven, or how finely something is sampled, are left alone. What a rival is for stays too: `poduri` keeps
two neighbours, `range-limited` a range, `barrier` its safe gap. The defaults of `robocov.controllers` are the
best sets of the full study; those that they replaced are among the sets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from robocov.controllers import CONTROLLERS, gain_values, make_controller
from robocov.controllers.gains import value_text
from robocov_app.figures.statistics import paired
from robocov_app.replication.contenders import Contender
from robocov_app.replication.plan import Plan, study_of, tuning_maps
from robocov_app.replication.reading import read_gain_outcomes
from robocov_app.replication.studying import referenced, swept
from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from pathlib import Path

    from robocov.controllers.gains import Value
    from robocov_app.replication.outcomes import GainOutcomes
    from robocov_app.replication.studying import Means
    from robocov_app.sweep.study import Study

NAME = "rival-gains"
"""What the study is called."""


def _grid(**values: Sequence[Value]) -> tuple[dict[str, Value], ...]:
    return tuple(dict(zip(values, each, strict=True)) for each in product(*values.values()))


GRIDS: Mapping[str, tuple[dict[str, Value], ...]] = {
    "howard": _grid(k_robots=(3.0, 10.0, 30.0), k_obs=(0.3, 1.0, 3.0)),
    "poduri": _grid(link_range=(4.0, 6.0, 12.0), k_cover=(3.0, 10.0, 30.0), k_obs=(0.1, 0.3)),
    "dispersion": (
        *_grid(reach=(3.5, 4.25, 5.0, 6.0, 7.0), k_disperse=(1.0,)),
        *_grid(reach=(5.0,), k_disperse=(0.3, 3.0)),
    ),
    "range-limited": _grid(interaction_range=(4.0, 6.0, 9.0, 12.0)),
    # with a detour of 2 it does not get out of a trap any more
    "tangentbug": (
        *_grid(detour=(4.0, 8.0, 16.0), moved=(0.5,)),
        {"detour": 4.0, "moved": 0.25},
    ),
    # a higher gamma lets robots of 2 m/s into the safe gap
    "barrier": (*_grid(gamma=(5.0, 20.0), braking=(0.8,)), {"gamma": 20.0, "braking": 0.5}),
    "geodesic-lloyd": _grid(exponent=(1.0, 1.5, 2.0)),
}
"""By controller the sets of gains that are tried; what they do not name has its default."""


def rival_gains_study(plan: Plan) -> Study | None:
    """Return the grids of the rivals' gains on some maps of the tuning; None where none are to be tried."""
    assert plan.beyond is not None
    if not plan.beyond.tuning:
        return None
    maps = tuning_maps(replace(plan, tuning=plan.beyond.tuning))
    sets = [_contender(name, gains) for name, grid in GRIDS.items() for gains in grid]
    return study_of(plan, maps, sets, plan.tuning_starts, (plan.tuning_seed,))


def studied_rival_gains(folder: Path, plan: Plan, means: Means) -> dict[str, GainOutcomes]:
    """Do the runs of the grids that are not done yet; return what each rival reached with every set.

    Parameters
    ----------
    folder : Path
        Of the study of the paper.
    plan : Plan
        With `Plan.beyond`.
    means : Means

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`.
    """
    study = rival_gains_study(plan)
    if study is None:
        return {}
    references = referenced(study.maps, folder, plan, means)
    swept(study, folder, NAME, means)
    return read_gain_outcomes(folder / "studies" / NAME, study, references)


def tuned_rivals(found: Mapping[str, GainOutcomes]) -> dict[str, Contender]:
    """Return the rivals with their best gains: the sets with the least mean of J/J_ref.

    One of which in every scenario some run failed is left out.
    """
    return {
        name: _contender(name, grid.gains[grid.best()])
        for name, grid in found.items()
        if grid.complete.scenarios
    }


def gains_words(controller: str, grid: GainOutcomes) -> str:
    """Return in words which of a rival's gains are best, and how its defaults and the worst set compare.

    Ratios are medians over the runs, pair by pair, in those scenarios in which no set failed.
    """
    grid = grid.complete
    if not grid.scenarios:
        return "Gains: its defaults; in every scenario of the tuning some run failed."
    best, worst = grid.best(), int(np.argmax(grid.excess.mean(axis=1)))
    varied = [name for name in grid.gains[best] if len({gains[name] for gains in grid.gains}) > 1]
    values = ", ".join(f"{name} {value_text(grid.gains[best][name])}" for name in varied)
    usual = dict(gain_values(make_controller(controller)))
    own = next((k for k, gains in enumerate(grid.gains) if dict(gains) == usual), None)
    head = f"Gains: {values}"
    if own == best:
        head += ", as by default"
    sets, maps = len(grid.gains), len(set(grid.maps))
    told = f"{head}: of {sets} sets the best on {maps} maps of the tuning, mean J/J_ref {_mean(grid, best)}"
    if own is not None and own != best:
        told += f"; with its defaults {_mean(grid, own)}, median ratio {_ratio(grid, best, own)}"
    return f"{told}; with the worst set {_mean(grid, worst)}, median ratio {_ratio(grid, best, worst)}."


def _mean(grid: GainOutcomes, row: int) -> str:
    return amount(float(grid.excess[row].mean()))


def _ratio(grid: GainOutcomes, first: int, second: int) -> str:
    return amount(paired(grid.excess[first], grid.excess[second], grid.maps).ratio.estimate)


def _contender(name: str, gains: Mapping[str, Value]) -> Contender:
    return Contender(name, CONTROLLERS[name].label, name, dict(gains))
