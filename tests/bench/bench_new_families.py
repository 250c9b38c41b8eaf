"""Gaps of controllers on five families of maps that are not in the benchmark.

    python tests/bench/bench_new_families.py --out new-families
    python tests/bench/bench_new_families.py --maps map-files

The maps are those of `new_families`. Their hash was fixed before any controller ran on them. Six robots
start near a corner, under the conditions of the benchmark's tracks Ideal and Short range, and run for 60 s.
Gaps are relative to the best of 24 searches for a placement on the known map, as in the benchmark.

The first table has the columns of the table of results in the handbook: the median gap, the number of maps
with a gap above 5%, runs with contacts, the fraction of settled runs, and the median path length of a robot.
The second one contains the median gap on each family.

After an interruption, the same command resumes. With ``--maps``, the script only saves the maps as JSON.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from new_families import FAMILIES, SEEDS, build_maps, compute_hash

from robocov import Environment, save_map
from robocov.errors import RobocovError
from robocov.files.writing import replace_file
from robocov.mapfile import to_json
from robocov_app.benchmark import suite
from robocov_app.benchmark.references import RESTARTS
from robocov_app.benchmark.references import SEED as REFERENCE_SEED
from robocov_app.evaluation.reference_search import ReferenceQuery, answer_queries
from robocov_app.sweep.ledger import Ledger
from robocov_app.sweep.local_pool import count_processors
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.progress import show_progress

MAPS_SHA256 = "6c4894d774078628b8940d8edbfe8328d100561b58f7dd69c15b5bcb8e8a63b3"
"""Hash of all maps, computed before any controller ran on them."""
TRACKS = ("ideal", "short-range")
"""Tracks of the benchmark whose conditions are used."""
CONTROLLERS = (
    "atlas-shared",
    "atlas",
    "greedy-submodular",
    "frontier-median",
    "geodesic-lloyd",
    "rapf",
    "lloyd",
)
START_SEEDS = (0,)
"""Seeds of the starting positions. Each gives one run on each map."""
LARGE_GAP = 0.05
REFERENCE_FILE = "references.json"
RESULT_HEAD = (
    "| conditions | controller | gap, % | maps above 5% | contacts | settled, % | path length, m |\n"
    "|---|---|---|---|---|---|---|"
)
FAMILY_HEAD = f"| conditions | controller | {' | '.join(FAMILIES)} |\n{'|---' * (2 + len(FAMILIES))}|"


class Reference(NamedTuple):
    """The best placement that was found on a map."""

    mean_distance: float
    """m"""
    agreement: float
    """Fraction of the searches whose mean distance is within 0.5% of the best."""


class Run(NamedTuple):
    """Result of a run."""

    map_name: str
    gap: float
    has_contacts: bool
    is_settled: bool
    path_length: float
    """Mean over the robots, m."""

    @property
    def family(self) -> str:
        """Family of the map."""
        return self.map_name.rpartition("-")[0]


def search_references(
    maps: Mapping[str, Environment], path: Path, workers: int, stop: Interruption
) -> dict[str, Reference]:
    """Search for the best placements that a file lacks, and add each to the file."""
    references: dict[str, Reference] = {}
    if path.exists():
        document = json.loads(path.read_text(encoding="utf-8"))
        references = {name: Reference(**values) for name, values in document.items()}
    queries = {}
    for name, environment in maps.items():
        if name not in references:
            queries[name] = ReferenceQuery(
                to_json(environment),
                suite.TEAM_SIZE,
                radius=suite.ROBOT_RADIUS_M,
                lattice=suite.LATTICE,
                restarts=RESTARTS,
                seed=REFERENCE_SEED,
            )
    if not queries:
        return references
    with show_progress("references", len(maps)) as update:
        for name, placement in answer_queries(queries, workers, stop):
            references[name] = Reference(placement.mean_distance, placement.agreement)
            document = {key: reference._asdict() for key, reference in references.items()}
            with replace_file(path) as temporary:
                temporary.write_text(json.dumps(document, indent=1), encoding="utf-8")
            update(len(references))
    if len(references) < len(maps):
        raise KeyboardInterrupt
    return references


def build_study(track: str, controllers: Sequence[str], maps: Mapping[str, Environment]) -> Study:
    """Build the sweep of controllers under the conditions of a track. Only final costs are computed."""
    study_maps = [StudyMap(name, environment) for name, environment in maps.items()]
    study = suite.build_study(track, study_maps, controllers[0], gains={}, seeds=START_SEEDS, folder=Path())
    return replace(study, controllers=tuple(controllers), cost_hz=0.0, metrics=False)


def read_runs(study: Study, folder: Path, references: Mapping[str, Reference]) -> Iterator[tuple[str, Run]]:
    """Yield the controller and the result of each run of a finished sweep."""
    ledger = Ledger(folder)
    for task in generate_tasks(study):
        entry = ledger.read_entry(task)
        if entry is None:
            raise SystemExit(f"{folder}: {task.name}: missing")
        if entry.error is not None:
            raise SystemExit(f"{folder}: {task.name}: {entry.error}")
        metrics: Mapping[str, Any] = entry.metrics
        run = Run(
            map_name=task.map,
            gap=metrics["mean_distance_m"] / references[task.map].mean_distance - 1.0,
            has_contacts=metrics["contacts"] > 0,
            is_settled=metrics["settled_at_s"] is not None,
            path_length=metrics["path_length_m"],
        )
        yield task.controller, run


def format_result_row(track: str, controller: str, runs: Sequence[Run]) -> str:
    """Format a row of the first table as Markdown."""
    gaps_by_map: dict[str, list[float]] = {}
    for run in runs:
        gaps_by_map.setdefault(run.map_name, []).append(run.gap)
    large_count = sum(np.median(map_gaps) > LARGE_GAP for map_gaps in gaps_by_map.values())
    contact_count = sum(run.has_contacts for run in runs)
    median_gap = np.median([run.gap for run in runs])
    settled_fraction = np.mean([run.is_settled for run in runs])
    path_length = np.median([run.path_length for run in runs])
    cells = [
        suite.format_heading(track),
        f"`{controller}`",
        f"{100.0 * median_gap:.1f}",
        f"{large_count} of {len(gaps_by_map)}",
        f"{contact_count} of {len(runs)}",
        f"{100.0 * settled_fraction:.0f}",
        f"{path_length:.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def format_family_row(track: str, controller: str, runs: Sequence[Run]) -> str:
    """Format a row of the second table as Markdown."""
    cells = [suite.format_heading(track), f"`{controller}`"]
    for family in FAMILIES:
        gaps = [run.gap for run in runs if run.family == family]
        cells.append(f"{100.0 * np.median(gaps):.1f}")
    return f"| {' | '.join(cells)} |"


def describe_references(references: Mapping[str, Reference]) -> Iterator[str]:
    """Yield, for each family, the costs of the best placements and how many searches found them."""
    for family in FAMILIES:
        members = [references[f"{family}-{seed}"] for seed in SEEDS]
        costs = [reference.mean_distance for reference in members]
        searches = [round(RESTARTS * reference.agreement) for reference in members]
        yield (
            f"{family}: mean distance of the best placement {min(costs):.2f} to {max(costs):.2f} m, "
            f"found by {min(searches)} to {max(searches)} of {RESTARTS} searches"
        )


def format_worst_runs(runs: Mapping[tuple[str, str], Sequence[Run]]) -> Iterator[str]:
    """Yield, for each track and controller, the largest gap and its map."""
    for (track, controller), group in runs.items():
        worst = max(group, key=lambda run: run.gap)
        yield f"{suite.format_heading(track)}, {controller}: largest gap {worst.gap:.1%} on {worst.map_name}"


def run_all(arguments: argparse.Namespace, maps: Mapping[str, Environment], stop: Interruption) -> None:
    """Search for the references, run all controllers, and print the tables."""
    arguments.out.mkdir(parents=True, exist_ok=True)
    references = search_references(maps, arguments.out / REFERENCE_FILE, arguments.workers, stop)
    runs: dict[tuple[str, str], list[Run]] = {
        key: [] for key in product(arguments.tracks, arguments.controllers)
    }
    for track in arguments.tracks:
        study = build_study(track, arguments.controllers, maps)
        folder = arguments.out / track
        totals = sweep(study, folder, workers=arguments.workers, title=track, stop=stop)
        if totals.interrupted:
            raise KeyboardInterrupt
        for controller, run in read_runs(study, folder, references):
            runs[track, controller].append(run)
    print(RESULT_HEAD)
    for key, group in runs.items():
        print(format_result_row(*key, group))
    print(f"\nMedian gap on each family, %\n\n{FAMILY_HEAD}")
    for key, group in runs.items():
        print(format_family_row(*key, group))
    print("", *format_worst_runs(runs), "", *describe_references(references), sep="\n")


def main() -> None:
    """Run the controllers and print the tables, or save the maps."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS))
    parser.add_argument("--tracks", nargs="+", choices=TRACKS, default=list(TRACKS))
    parser.add_argument("--out", type=Path, default=Path("new-families"), help="folder of the runs")
    parser.add_argument("--maps", type=Path, help="save the maps to this folder, and run nothing")
    parser.add_argument("--workers", type=int, default=count_processors(), help="number of processes")
    arguments = parser.parse_args()
    maps = build_maps()
    if compute_hash(maps) != MAPS_SHA256:
        raise SystemExit("new_families: the maps differ from those whose hash was fixed")
    if arguments.maps is not None:
        arguments.maps.mkdir(parents=True, exist_ok=True)
        for name, environment in maps.items():
            save_map(environment, arguments.maps / f"{name}.json")
        return
    try:
        with Interruption() as stop:
            run_all(arguments, maps, stop)
    except KeyboardInterrupt:
        print("Interrupted. The same command resumes.", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    except RobocovError as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main()
