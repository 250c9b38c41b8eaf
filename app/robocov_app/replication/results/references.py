"""The reference placements of maps, each stored in a file."""

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import replace_file
from robocov.mapfile import to_json
from robocov_app.evaluation.reference_search import (
    REFERENCE_FORMAT,
    ReferencePlacement,
    ReferenceQuery,
    answer_queries,
)
from robocov_app.replication.design.plan import ROBOTS, TEAM, Plan
from robocov_app.sweep.study.study import StudyMap
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import show_progress

References: TypeAlias = dict[str, ReferencePlacement]
"""Reference placements by the name of the map."""


def find_references(
    maps: Sequence[StudyMap], folder: Path, plan: Plan, workers: int, stop: Interruption, *, quiet: bool
) -> References:
    """Return the reference placements of maps; those that are not stored yet are computed.

    Parameters
    ----------
    maps : sequence of StudyMap
    folder : Path
        Folder of the files, one for each map. Each new placement is stored immediately.
    plan : Plan
    workers : int
        Maximum number of processes.
    stop : Interruption
        When the user interrupts, the search ends, and only the references known by then are returned.
    quiet : bool
        Whether to show no progress.

    Returns
    -------
    dict
        References by the name of the map.
    """
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    references: References = {}
    missing: dict[str, ReferenceQuery] = {}
    for study_map in maps:
        query = ReferenceQuery(
            to_json(study_map.environment), ROBOTS, TEAM["radius"], plan.lattice, plan.restarts
        )
        stored = _load_reference(folder / f"{study_map.name}.json", query)
        if stored is None:
            missing[study_map.name] = query
        else:
            references[study_map.name] = stored
    if missing:
        with show_progress("references", len(missing), quiet=quiet) as update:
            for number, (name, answer) in enumerate(answer_queries(missing, workers, stop), start=1):
                _save_reference(folder / f"{name}.json", missing[name], answer)
                references[name] = answer
                update(number)
    return references


def _load_reference(path: Path, query: ReferenceQuery) -> ReferencePlacement | None:
    """Return the stored answer to a query; None if there is none, or if the file cannot be read."""
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        content = json.loads(path.read_bytes())
        if content["digest"] == query.input_hash:
            positions = tuple((float(x), float(y)) for x, y in content["positions_m"])
            return ReferencePlacement(
                float(content["mean_distance_m"]), positions, float(content["agreement"])
            )
    return None


def _save_reference(path: Path, query: ReferenceQuery, answer: ReferencePlacement) -> None:
    """Store the answer to a query as JSON, with a hash of the query by which it is recognized."""
    content = {
        "format": REFERENCE_FORMAT,
        "digest": query.input_hash,
        "map": query.document.get("name"),
        "robots": query.robots,
        "radius_m": query.radius,
        "lattice": query.lattice,
        "restarts": query.restarts,
        "seed": query.seed,
        "mean_distance_m": answer.mean_distance,
        "agreement": answer.agreement,
        "positions_m": answer.positions,
    }
    with replace_file(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
