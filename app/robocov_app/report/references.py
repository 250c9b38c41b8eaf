"""The centralised reference of each map and team of a result: searched for once, and kept in the cache."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov import __version__
from robocov.errors import ParameterError
from robocov.files.array_files import ArrayCache
from robocov.mapfile import to_json
from robocov.optimum import optimum

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Environment
    from robocov_app.report.gathering import Result

RESTARTS = 24
"""Searches of which the best counts."""


class Reference(NamedTuple):
    """The lowest cost found for a team that knows the map: J_ref in m, and the uncovered area in m²."""

    mean_distance: float
    uncovered_area: float


def with_references(result: Result, *, search: bool, tell: Callable[[int], None] | None = None) -> Result:
    """Return the result with the references in the user's cache; `search` for others takes some seconds each.

    There are none where obstacles move or robots fail or join: the best places are of one moment. `tell` is
    called with the number of maps and teams that are done.
    """
    lattice = result.facts.get("lattice")
    first = {entry.setting: entry for entry in reversed(result.fine)}
    found = {}
    for done, (setting, entry) in enumerate(first.items(), start=1):
        record = result.record(entry)
        environment = record.environment
        everybody = bool(record.present.all() and record.working.all())
        if isinstance(lattice, int) and everybody and not environment.moves:
            radius = float(record.team.radius.max())
            reference = _reference(environment, len(record.team), radius, lattice, search=search)
            if reference is not None:
                found[setting] = reference
        if tell is not None:
            tell(done)
    return replace(result, references=found)


def _reference(
    environment: Environment, robots: int, radius: float, lattice: int, *, search: bool
) -> Reference | None:
    cache = ArrayCache.of_user()
    content = json.dumps(to_json(environment), sort_keys=True)
    key = ArrayCache.key("optimum", __version__, content, robots, radius, lattice, RESTARTS)
    kept = None if cache is None else cache.load(key)
    if kept is not None:
        return Reference(*kept["reference"].tolist())
    if not search:
        return None
    try:
        best = optimum(environment, robots, radius=radius, lattice=lattice, restarts=RESTARTS)
    except ParameterError:
        return None  # more robots than have room at rest
    reference = Reference(best.mean_distance, best.uncovered_area)
    if cache is not None:
        cache.save(key, {"reference": np.array(reference)})
    return reference
