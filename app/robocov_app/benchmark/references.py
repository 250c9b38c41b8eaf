"""The best placements for the maps of the suite, searched for in parallel and kept in its file."""

import json
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.files.writing import replace_file
from robocov.mapfile import from_json, to_json
from robocov_app.benchmark import suite
from robocov_app.replication.references import Question, searched
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import show_progress
from robocov_app.toolkit.worker import Line

RESTARTS, SEED = 24, 0
PRECISION = 0.002  # of the certified lower bounds
_DIGITS = 4  # after the point of positions, in metres


def wanted_references() -> Iterator[tuple[str, int, float]]:
    """Return map, team size and moment (s) of every reference: with obstacles that move, those of the end."""
    moments: dict[tuple[str, int], float] = {}
    for track in suite.TRACKS.values():
        for wanted in product(track.maps, range(track.survivors, track.robots + 1)):
            moments.setdefault(wanted, track.duration)
    return ((name, robots, time) for (name, robots), time in moments.items())


def make_references(path: Path, *, workers: int, quiet: bool, stop: Interruption) -> tuple[int, int]:
    """Search for all references, and bounds, that a file lacks; return how many it has, and still lacks.

    Whatever ends it, the same call goes on. A map whose hash is not that of the file loses its references.
    """
    maps: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))["maps"] if path.exists() else {}
    for name in suite.FAMILY_OF:
        own = suite.hash_of(suite.made_map(name))
        if maps.get(name, {}).get("sha256") != own:
            maps[name] = {"sha256": own, "family": suite.FAMILY_OF[name], "references": {}}
    wanted: dict[str, tuple[dict[str, Any], str, Environment]] = {
        f"{name} {robots}": (maps[name]["references"], str(robots), suite.made_map(name).at(time))
        for name, robots, time in wanted_references()
    }

    def found(key: str) -> dict[str, Any]:
        held, robots, _ = wanted[key]
        return held.get(robots, {})  # type: ignore[no-any-return]

    searches = [key for key in wanted if not found(key)]
    bounds = [key for key in wanted if found(key).get("lower_bound_m") is None]
    left = total = len(searches) + len(bounds)
    _save(path, maps)
    with show_progress("references", total, quiet=quiet) as update:

        def kept() -> None:
            nonlocal left
            left -= 1
            _save(path, maps)
            update(total - left)

        how = (suite.RADIUS, suite.LATTICE, RESTARTS, SEED)
        questions = {key: Question(to_json(wanted[key][2]), int(wanted[key][1]), *how) for key in searches}
        for key, answer in searched(questions, workers, stop) if questions else ():
            held, robots, environment = wanted[key]
            places = np.round(answer.positions, _DIGITS)  # the cost is that of the places as they stand there
            result = CoverageCost(environment, suite.LATTICE)(places)
            mean, uncovered = result.mean_distance, result.uncovered_area
            held[robots] = {"mean_distance_m": mean, "uncovered_area_m2": uncovered}
            held[robots] |= {"agreement": answer.agreement, "lower_bound_m": None}
            held[robots]["positions_m"] = places.tolist()
            kept()
        asked = {key: (to_json(wanted[key][2]), found(key)["positions_m"]) for key in bounds if found(key)}
        for key, bound in searched(asked, workers, stop, f"{__name__}:Bounding") if asked else ():
            found(key)["lower_bound_m"] = bound
            kept()
    return 2 * len(wanted) - left, left


class Bounding:
    """Computes certified lower bounds in a process of its own."""

    failing = "the bound failed"

    def __call__(self, questions: list[tuple[dict[str, Any], list[list[float]]]], line: Line) -> float:
        """Return the least mean distance that any placement may have, m; takes up to some minutes."""
        from robocov.lower_bound import compute_lower_bound

        document, positions = questions[-1]
        how: Any = {"radius": suite.RADIUS, "lattice": suite.LATTICE, "precision": PRECISION}
        return compute_lower_bound(from_json(document), np.array(positions), **how).mean_distance


def _save(path: Path, maps: Mapping[str, Any]) -> None:
    how = {"lattice": suite.LATTICE, "restarts": RESTARTS, "seed": SEED, "radius_m": suite.RADIUS}
    how["precision"] = PRECISION
    lines = []
    for name in suite.FAMILY_OF:
        own = dict(sorted(maps[name]["references"].items(), key=lambda item: int(item[0])))
        lines.append(f"{json.dumps(name)}: {json.dumps({**maps[name], 'references': own})}")
    head = json.dumps({"format": "robocov-benchmark-suite", "version": suite.VERSION, "search": how})[:-1]
    with replace_file(path) as part:
        part.write_text(head + ', "maps": {\n' + ",\n".join(lines) + "\n}}\n", encoding="utf-8")
