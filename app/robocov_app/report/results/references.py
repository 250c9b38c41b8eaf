"""Reference placements: the best placements found for teams that know the whole map."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from robocov import __version__
from robocov.errors import ParameterError
from robocov.files.array_files import ArrayCache
from robocov.mapfile import to_json
from robocov.optimum import find_optimum
from robocov.record import Record
from robocov_app.report.results.result import Reference, ReportedResult
from robocov_app.runs.saved_runs import has_constant_setting

RESTARTS = 24
"""Number of searches for the best placement; the best result is used."""


def add_references(
    result: ReportedResult, *, search: bool, report_progress: Callable[[int], None]
) -> ReportedResult:
    """Add the reference placement of each setting to a result.

    Settings whose robots join, fail or share the map with moving obstacles have no reference.

    Parameters
    ----------
    result : ReportedResult
    search : bool
        Whether to compute references that are not in the cache.
    report_progress : callable
        Called with the number of settings that are done so far.

    Returns
    -------
    ReportedResult
    """
    lattice = result.facts.get("lattice")
    # Reversed, so that the first run of each setting remains.
    first_runs = {run.setting: run for run in reversed(result.completed_runs)}
    references = {}
    for count, (setting, run) in enumerate(first_runs.items(), start=1):
        record = result.read_record(run)
        if isinstance(lattice, int) and has_constant_setting(record):
            reference = _find_reference(record, lattice, search=search)
            if reference is not None:
                references[setting] = reference
        report_progress(count)
    return replace(result, references=references)


def _find_reference(record: Record, lattice: int, *, search: bool) -> Reference | None:
    """Return the reference for the team of a run from the cache or, if `search`, from a search.

    None if it is in neither, or if the free space is too small for all robots.
    """
    environment = record.environment
    robots = len(record.team)
    radius = float(record.team.radius.max())
    cache = ArrayCache.open_default()
    map_text = json.dumps(to_json(environment), sort_keys=True)
    key = ArrayCache.compute_key(
        "optimum for discs", __version__, map_text, robots, radius, lattice, RESTARTS
    )
    arrays = None if cache is None else cache.load(key)
    if arrays is not None:
        return Reference(*arrays["reference"].tolist())
    if not search:
        return None
    try:
        best = find_optimum(environment, robots, radius=radius, lattice=lattice, restarts=RESTARTS)
    except ParameterError:
        return None
    reference = Reference(best.mean_distance, best.uncovered_area)
    if cache is not None:
        cache.save(key, {"reference": np.array(reference)})
    return reference
