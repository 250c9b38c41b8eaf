"""Several controllers from the same starts: curves, pictures and a film side by side."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.controllers import controller_kind, gains_of
from robocov.cost import CoverageCost
from robocov.errors import ParameterError, unknown_name
from robocov_app.runs.options import RunOptions
from robocov_app.runs.run import Run, save_pictures
from robocov_app.terminal.output import finite, write_csv, write_json

if TYPE_CHECKING:
    pass

_HEAD = {"format": "robocov-comparison", "version": 1}

_FIGURES = ("mean_distance_m", "cost_m3", "uncovered_area_m2", "settled_at_s", "contacts", "min_clearance_m")

_TIMED = ("mean_time_s",)  # where robots are not equally fast


def gains_for(names: Sequence[str], given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the gains of each controller out of those given for the comparison.

    ``k_rep`` goes to every controller that has a gain of that name, ``rapf.k_rep`` to RAPF alone. Raises
    ParameterError when a gain belongs to none of the controllers.
    """
    known = {name: gains_of(controller_kind(name)) for name in names}
    chosen: list[dict[str, Any]] = [{} for _ in names]
    # what is said of one controller alone counts for more than what is said of all
    for key, value in sorted(given.items(), key=lambda item: "." in item[0]):
        owner, dot, gain = key.rpartition(".")
        if dot and owner not in known:
            raise ParameterError(f"--set {key}: {unknown_name('controller', owner, known)}")
        takers = [k for k, name in enumerate(names) if gain in known[name] and (not dot or name == owner)]
        if not takers:
            every = known[owner] if dot else {gain for name in names for gain in known[name]}
            raise ParameterError(f"--set {key}: {unknown_name('gain', gain, every)}")
        for k in takers:
            chosen[k][gain] = value
    return chosen


def folder_names(names: Sequence[str]) -> list[str]:
    """Return a folder name for each controller: its own name, made fit for a folder and different for all.

    >>> folder_names(["rapf", "mine.py:Mine", "other/mine.py:Mine"])
    ['rapf', 'Mine', 'Mine-2']
    """
    taken: list[str] = []
    for name in names:
        stem = re.sub(r"[^\w.-]+", "-", name.rpartition(":")[2]).strip(".-")[:64] or "controller"
        number = 1 + sum(
            other == stem or re.fullmatch(re.escape(stem) + r"-\d+", other) is not None for other in taken
        )
        taken.append(stem if number == 1 else f"{stem}-{number}")
    return taken


def rows_of(runs: Mapping[str, Run]) -> list[dict[str, Any]]:
    """Return one row for each run: its figures, and the excess of its mean distance over the best."""
    best = min(run.summary["mean_distance_m"] for run in runs.values())
    return [
        {
            "controller": name,
            "label": run.record.label,
            "gains": dict(run.record.gains),
            **{figure: run.summary[figure] for figure in _FIGURES},
            **{figure: run.summary[figure] for figure in _TIMED if figure in run.summary},
            "mean_path_length_m": sum(run.summary["path_length_m"]) / len(run.record.team),
            "above_best": run.summary["mean_distance_m"] / best - 1.0,
        }
        for name, run in runs.items()
    ]


def begin_comparison(folder: Path, folders: Sequence[str]) -> None:
    """Write which folders belong to the comparison, so that also one that is killed can be read."""
    write_json(folder / "comparison.json", {**_HEAD, "folders": list(folders), "runs": []})


def save_comparison(runs: Mapping[str, Run], cost: CoverageCost, folder: Path, options: RunOptions) -> None:
    """Write ``comparison.json|csv``, and ``trajectories`` and ``cost`` as PNG and SVG."""
    rows = rows_of(runs)
    content = {**_HEAD, "lattice": options.lattice, "folders": list(runs), "runs": rows}
    write_json(folder / "comparison.json", finite(content))
    columns = [name for name in rows[0] if name not in ("label", "gains")]
    write_csv(folder / "comparison.csv", ",".join(columns), ([row[name] for name in columns] for row in rows))
    save_pictures(list(runs.values()), cost, folder, options, comparison=True)
