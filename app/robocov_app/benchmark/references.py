"""Reference placements and certified lower bounds for the maps of the suite, which its file contains."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, to_json
from robocov_app.benchmark import suite
from robocov_app.evaluation.reference_search import ReferencePlacement, ReferenceQuery, answer_queries
from robocov_app.jobs.messages import Channel
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import show_progress

RESTARTS = 24
"""Number of searches for each reference placement, from different starting positions."""
SEED = 0
"""Seed of the searches."""
BOUND_PRECISION = 0.002
"""Relative precision of the certified lower bounds."""
_POSITION_DIGITS = 4
"""Number of decimal places of positions in meters."""


class ReferenceSetting(NamedTuple):
    """Map, team and time for which a reference placement is searched."""

    map_name: str
    robots: int
    """Number of robots."""
    radius: float
    """Radius of a robot, m."""
    time: float
    """Time that determines the positions of moving obstacles: the end of the runs, s."""


def list_references() -> list[ReferenceSetting]:
    """List the settings of all reference placements of the suite.

    Returns
    -------
    list of ReferenceSetting
        One for each map and number of robots. All tracks with this map have robots of the same size.
    """
    settings: dict[tuple[str, int], ReferenceSetting] = {}
    for track in suite.TRACKS.values():
        sizes = range(track.survivors, track.robots + 1)
        for name, robots in product(track.maps, sizes):
            setting = ReferenceSetting(name, robots, radius=track.radius, time=track.duration)
            settings.setdefault((name, robots), setting)
    return list(settings.values())


@dataclass(frozen=True)
class _ReferenceSlot:
    """The entry of one reference in the content of the suite's file."""

    references: dict[str, Any]
    """References of the map by team size, to which the answers are added."""
    setting: ReferenceSetting
    environment: Environment

    @property
    def reference(self) -> dict[str, Any]:
        """The stored reference; empty if there is none yet."""
        return self.references.get(str(self.setting.robots), {})  # type: ignore[no-any-return]


def compute_references(path: Path, *, workers: int, quiet: bool, stop: Interruption) -> tuple[int, int]:
    """Compute all reference placements and lower bounds that a file of the suite lacks.

    The file is saved after each answer, so that the next call resumes an interrupted search. References of
    maps whose hashes differ from those in the file are removed.

    Parameters
    ----------
    path : Path
        A file of the suite, which is created if it does not exist.
    workers : int
        Maximum number of processes.
    quiet : bool
        Whether to show no progress.
    stop : Interruption
        Ends the search early when it is requested.

    Returns
    -------
    known_count, missing_count : int
        Number of references and bounds that the file contains, and number of those that it still lacks.
    """
    maps = _load_maps(path)
    slots = {}
    for setting in list_references():
        environment = suite.build_map(setting.map_name).at(setting.time)
        slot = _ReferenceSlot(maps[setting.map_name]["references"], setting, environment)
        slots[f"{setting.map_name} {setting.robots}"] = slot
    missing_references = [key for key, slot in slots.items() if not slot.reference]
    missing_bounds = [key for key, slot in slots.items() if slot.reference.get("lower_bound_m") is None]
    total = len(missing_references) + len(missing_bounds)
    missing_count = total
    _save_maps(path, maps)
    with show_progress("references", total, quiet=quiet) as update:

        def report_answer() -> None:
            nonlocal missing_count
            missing_count -= 1
            _save_maps(path, maps)
            update(total - missing_count)

        searched = {key: slots[key] for key in missing_references}
        _search_references(searched, workers, stop, report_answer)
        bounded = {key: slots[key] for key in missing_bounds if slots[key].reference}
        _compute_bounds(bounded, workers, stop, report_answer)
    # Each slot has a reference and a bound.
    return 2 * len(slots) - missing_count, missing_count


def _search_references(
    slots: Mapping[str, _ReferenceSlot], workers: int, stop: Interruption, report_answer: Callable[[], None]
) -> None:
    """Search for the reference placements of slots; add each to its slot, and report it."""
    if not slots:
        return
    queries = {
        key: ReferenceQuery(
            to_json(slot.environment),
            slot.setting.robots,
            radius=slot.setting.radius,
            lattice=suite.LATTICE,
            restarts=RESTARTS,
            seed=SEED,
        )
        for key, slot in slots.items()
    }
    for key, answer in answer_queries(queries, workers, stop):
        slot = slots[key]
        slot.references[str(slot.setting.robots)] = _build_reference(slot, answer)
        report_answer()


def _build_reference(slot: _ReferenceSlot, placement: ReferencePlacement) -> dict[str, Any]:
    """Build the entry of a reference placement in the suite's file, still without a lower bound."""
    # The cost is computed at the rounded positions, so that it can be recomputed from the file.
    positions = np.round(placement.positions, _POSITION_DIGITS)
    cost = CoverageCost(slot.environment, suite.LATTICE, radius=slot.setting.radius)
    result = cost(positions)
    return {
        "mean_distance_m": result.mean_distance,
        "uncovered_area_m2": result.uncovered_area,
        "agreement": placement.agreement,
        "lower_bound_m": None,
        "positions_m": positions.tolist(),
    }


class BoundQuery(NamedTuple):
    """Inputs of a lower bound."""

    document: dict[str, Any]
    """The map as JSON."""
    positions: list[list[float]]
    """Positions of the best known placement, m."""
    radius: float
    """Radius of a robot, m."""


def _compute_bounds(
    slots: Mapping[str, _ReferenceSlot], workers: int, stop: Interruption, report_answer: Callable[[], None]
) -> None:
    """Compute the lower bounds of slots; add each to the reference in its slot, and report it."""
    if not slots:
        return
    queries = {
        key: BoundQuery(to_json(slot.environment), slot.reference["positions_m"], slot.setting.radius)
        for key, slot in slots.items()
    }
    for key, bound in answer_queries(queries, workers, stop, f"{__name__}:LowerBoundService"):
        slots[key].reference["lower_bound_m"] = bound
        report_answer()


class LowerBoundService:
    """Worker service that computes certified lower bounds of the mean distance."""

    failure_message = "the bound failed"

    def __call__(self, requests: list[BoundQuery], channel: Channel) -> float:
        """Return a lower bound for the mean distance of all placements, m, which may take minutes.

        Only the last request is answered.
        """
        from robocov.lower_bound import compute_lower_bound

        query = requests[-1]
        bound = compute_lower_bound(
            from_json(query.document),
            np.array(query.positions),
            radius=query.radius,
            lattice=suite.LATTICE,
            precision=BOUND_PRECISION,
        )
        return bound.mean_distance


def _load_maps(path: Path) -> dict[str, Any]:
    """Return the map entries of a file of the suite, with new ones for maps that are missing or changed."""
    maps: dict[str, Any] = {}
    if path.exists():
        maps = json.loads(path.read_text(encoding="utf-8"))["maps"]
    for name, family in suite.FAMILY_OF.items():
        map_hash = suite.compute_map_hash(suite.build_map(name))
        if maps.get(name, {}).get("sha256") != map_hash:
            maps[name] = {"sha256": map_hash, "family": family, "references": {}}
    return maps


def _save_maps(path: Path, maps: Mapping[str, Any]) -> None:
    """Write a file of the suite, with one line for each map."""
    search = {
        "lattice": suite.LATTICE,
        "restarts": RESTARTS,
        "seed": SEED,
        "radius_m": suite.ROBOT_RADIUS_M,
        "radius_m_by_track": {
            name: track.radius for name, track in suite.TRACKS.items() if track.radius != suite.ROBOT_RADIUS_M
        },
        "precision": BOUND_PRECISION,
    }
    lines = []
    for name in suite.FAMILY_OF:
        by_size = sorted(maps[name]["references"].items(), key=lambda item: int(item[0]))
        entry = {**maps[name], "references": dict(by_size)}
        lines.append(f"{json.dumps(name)}: {json.dumps(entry)}")
    head = json.dumps({"format": "robocov-benchmark-suite", "version": suite.VERSION, "search": search})
    text = head.removesuffix("}") + ', "maps": {\n' + ",\n".join(lines) + "\n}}\n"
    with replace_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
