"""Running the benchmark: a sweep for each track, then one small file of results; and checking such a file."""

import gzip
import hashlib
import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.controllers import get_information, make_controller
from robocov.controllers.gains import Value
from robocov.environment import Environment
from robocov.errors import InputError, OutputError, ParameterError, quote
from robocov.files.strictjson import parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov_app.benchmark import suite
from robocov_app.sweep.executors import LocalPool
from robocov_app.sweep.ledger import RUNS, Entry, Ledger, difference_of
from robocov_app.sweep.study import Study, StudyMap, Task, tasks_of
from robocov_app.sweep.sweeping import Count, sweep, sweep_progress, worked_off
from robocov_app.sweep.worker import EFFORT, Outcome, made_with
from robocov_app.terminal.interruption import Interruption

RESULT = "result.json"
ENTRIES = Path(__file__).parent / "entries"  # results of the built-in controllers, packed by gzip -9 -n
TRACKS = "tracks"  # folder of the tracks' sweeps
ORACLE = "oracle"
_FORMAT = {"format": "robocov-benchmark", "version": 1}
_ALIKE = 1e-6  # m² by which uncovered areas of the same rooms differ at most
FIGURES = (  # of a run that a result holds, beside those of its effort and its gap
    *("mean_distance_m", "mean_distance_over_run_m", "uncovered_area_m2", "near_final_s", "settled_at_s"),
    *("path_length_m", "work_J", "contacts", "min_clearance_m", "stuck_robots"),
)
Row: TypeAlias = dict[str, Any]


@dataclass(frozen=True)
class Selection:
    """The part of the suite to run: of each track these maps and seeds."""

    quick: bool = False
    tracks: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()

    def parts(self) -> Iterator[tuple[str, tuple[str, ...], tuple[int, ...]]]:
        """Yield the tracks with their maps and seeds; raises ParameterError for names that are unknown."""
        for name, maps in suite.chosen(self.tracks, self.maps, quick=self.quick).items():
            yield name, maps, suite.TRACKS[name].seeds[: 1 if self.quick else None]


@dataclass(frozen=True)
class Contender:
    """A controller that is rated, with the gains that differ from its defaults."""

    controller: str
    gains: Mapping[str, Value]

    def studies(self, selection: Selection) -> Iterator[tuple[str, Study]]:
        """Yield the runs of each track; raises ParameterError for what is wrong with the controller."""
        oracle = self.controller == ORACLE
        name = "oracle.py:Oracle" if oracle else self.controller
        folder = Path(__file__).parent if oracle else Path()
        gains: Any = {"gains": {name: dict(self.gains)}} if self.gains else {}
        try:  # first, as to make the maps takes seconds
            make_controller(str(folder / name) if oracle else name, dict(self.gains))
        except ParameterError as error:
            raise ParameterError(f"--controller: {error}") from None
        for track, maps, seeds in selection.parts():
            given = [StudyMap(each, _told(track, each) if oracle else suite.suite_map(each)) for each in maps]
            yield track, suite.study_of(track, given, name, seeds, folder, **gains)

    def facts(self, study: Study) -> dict[str, Any]:
        """Return what a result says of the controller; of a user's, the digest of its source."""
        name = study.controllers[0]
        kind, source = study.kind(name), study.sources.get(name)
        texts = [] if source is None else [source.text, *(each.text for each in source.modules.values())]
        return {
            "controller": self.controller.rpartition("/")[2],
            "label": getattr(kind, "label", kind.__name__),
            "information": get_information(kind),
            "gains": dict(study.gains_of(name).choices[0]),
            "set": dict(self.gains),
            "source_sha256": hashlib.sha256("\0".join(texts).encode()).hexdigest() if texts else None,
        }


def _told(track: str, name: str) -> Environment:
    """Return a map of the suite with the best placements for the oracle, one for each time a robot fails."""
    environment, own = suite.suite_map(name), suite.TRACKS[track]
    working, stages, now = list(range(own.robots)), [], 0.0
    for robot, time in (*own.failures, (-1, np.inf)):
        stages.append([now, working, reference(name, len(working))["positions_m"]])
        working, now = [each for each in working if each != robot], time
    return replace(environment, extra={**environment.extra, "oracle": stages})


def reference(name: str, robots: int) -> Mapping[str, Any]:
    """Return the best placement that was found for a map of the suite; raises InputError for none."""
    found = suite.frozen().get(name, {}).get("references", {}).get(str(robots))
    if found is None:
        told = f"map {name}: no reference for a team of {robots}"
        raise InputError(f"{told}; `robocov benchmark references` makes those that are missing")
    return dict(found)


def run_benchmark(
    contender: Contender, selection: Selection, out: Path, *, stop: Interruption, **how: Any
) -> dict[str, Any] | None:
    """Do all runs that are not done yet, and write ``result.json``; return it, None where it was stopped.

    `how`: as of `sweep`. Raises InputError where the folder holds something else.
    """
    foreign = {path.name for path in out.iterdir()} - {RESULT, TRACKS} if out.is_dir() else set()
    if foreign or (out.exists() and not out.is_dir()):
        raise InputError(f"{out}: it holds something else than a benchmark; choose another --out")
    studies = dict(contender.studies(selection))
    rows: list[Row] = []
    for track, study in studies.items():
        folder = out / TRACKS / track
        if sweep(study, folder, title=track, stop=stop, **how).interrupted:
            return None
        ledger = Ledger(folder)
        for task in tasks_of(study):
            entry = ledger.entry(task)
            if entry is None:
                raise OutputError(f"{folder}: {task.name} was removed by somebody else")
            effort = folder / RUNS / task.name / EFFORT
            rows.append(row_of(track, task, entry, effort.read_bytes() if effort.exists() else b"{}"))
    result = {
        **_FORMAT,
        "suite": _suite(),
        "selection": {"quick": selection.quick, "tracks": selection.tracks, "maps": selection.maps},
        "entry": contender.facts(next(iter(studies.values()))),
        "versions": made_with(),
        "method": method(),
    }
    head = json.dumps(result, indent=1)
    lines = ",\n".join(json.dumps(row, allow_nan=False) for row in rows)
    with replace_file(out / RESULT) as part:
        part.write_text(f'{head[:-2]},\n "rows": [\n{lines}\n]}}\n', encoding="utf-8")
    return {**result, "rows": rows}


def _suite() -> dict[str, str]:
    """Return what results depend on in the suite's file, as a digest: maps and best costs, no bounds."""
    costs = {
        name: [own["sha256"], {size: each["mean_distance_m"] for size, each in own["references"].items()}]
        for name, own in suite.frozen().items()
    }
    digest = hashlib.sha256(json.dumps(costs, sort_keys=True).encode()).hexdigest()
    return {"version": suite.VERSION, "sha256": digest}


def method() -> list[str]:
    return [
        f"Maps, starts, seeds and tracks are those of suite {suite.VERSION}, whose maps have hashes.",
        f"J is the mean geodesic distance to the nearest robot on {suite.LATTICE} x {suite.LATTICE} sites, "
        "weighed by the density of a map, with obstacles where they are at that moment and robots that work.",
        "The gap is J / J_ref - 1 at the end; J_ref is the lowest of 24 searches for the best placement with "
        "the whole map known, for as many robots as work at the end. It is an upper bound of the optimum.",
        "near_final_s: from when on J stays within 5 % of its end. settled_at_s: from when on no robot gets "
        "5 cm in any 4 s. path_length_m: mean over robots. work_J: integral of |F v|, all robots.",
        "told_bytes: 20 bytes (position and number) a robot and control period, or message; where maps are "
        "shared also 5 bytes for each cell that has changed on its map, whoever it knows it from, and by "
        "atlas-shared 28 bytes (number, position, time) for each other robot that it knows of, at each plan.",
        "deciding_s: processor time of the control law alone, all robots; it depends on the machine.",
    ]


def row_of(track: str, task: Task, entry: Entry | Outcome, effort: bytes) -> Row:
    """Return what a result holds of a run, whose ``effort.json`` is the last argument."""
    head: Row = {"track": track, "map": task.map, "seed": task.seed}
    if entry.error is not None:
        return {**head, "error": entry.error}
    figures = {name: entry.figures[name] for name in FIGURES}
    return {**head, **figures, **json.loads(effort), **rated(track, task.map, figures)}


def rated(track: str, name: str, figures: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the gap to the reference, and that to the certified bound; None in other rooms or for none."""
    best = reference(name, suite.TRACKS[track].survivors)
    if abs(figures["uncovered_area_m2"] - best["uncovered_area_m2"]) > _ALIKE:
        return {"gap": None, "gap_to_bound": None}
    bound, cost = best["lower_bound_m"], figures["mean_distance_m"]
    gap_to_bound = cost / bound - 1.0 if bound else None
    return {"gap": cost / best["mean_distance_m"] - 1.0, "gap_to_bound": gap_to_bound}


def read_result(path: Path) -> dict[str, Any]:
    """Return the result in a file, or in a folder of one; raises InputError for what is none."""
    path = path / RESULT if path.is_dir() else path
    data = read_bytes(path)
    if path.suffix == ".gz":
        try:
            data = gzip.decompress(data)
        except (OSError, EOFError, zlib.error) as error:
            raise InputError(f"{path}: cannot be unpacked: {error}") from None
    result = parse_json(data, str(path))
    if not isinstance(result, dict) or {name: result.get(name) for name in _FORMAT} != _FORMAT:
        raise InputError(f"{path}: expected a result of robocov benchmark")
    if (found := result.get("suite")) != _suite():
        raise InputError(f"{path}: suite: expected that of {suite.FILE.name} here, got {found}")
    parts = {**dict.fromkeys(("entry", "selection", "versions"), dict), "rows": list, "method": list}
    _require(result, parts, path)
    words = {**dict.fromkeys(("controller", "label", "information"), str), "gains": dict, "set": dict}
    _require(result["entry"], {**words, "source_sha256": str | None}, f"{path}: entry")
    _require(result["selection"], {"quick": bool, "tracks": list, "maps": list}, f"{path}: selection")
    place = {"track": str, "map": str, "seed": int}
    figures = dict.fromkeys((*FIGURES, "gap", "gap_to_bound", "told_bytes", "deciding_s"), int | float | None)
    for k, row in enumerate(result["rows"]):
        failed = isinstance(row, dict) and "error" in row
        _require(row, {**place, "error": str} if failed else {**place, **figures}, f"{path}: rows[{k}]")
        if row["track"] not in suite.TRACKS or row["map"] not in suite.FAMILY_OF:
            raise InputError(f"{path}: rows[{k}]: {row['track']} on {row['map']} is no run of the suite")
    return result


def bundled_results(others: Sequence[Mapping[str, Any]] = ()) -> list[dict[str, Any]]:
    """Return the results of the built-in controllers that are none of the others."""
    identity = itemgetter("controller", "set", "source_sha256")
    given = [identity(each["entry"]) for each in others]
    results = [read_result(path) for path in sorted(ENTRIES.glob("*.json.gz"))]
    return [result for result in results if identity(result["entry"]) not in given]


def _require(given: Any, kinds: Mapping[str, Any], where: object) -> None:
    for name, kind in kinds.items():
        if not isinstance(given, dict) or name not in given:
            raise InputError(f"{where}: {name}: missing, expected a whole result")
        if not isinstance(given[name], kind):
            raise InputError(f"{where}: {name}: expected another kind of value, got {quote(given[name])}")


def verify(
    path: Path,
    *,
    controller: str | None = None,
    sample: int = 5,
    seed: int = 0,
    workers: int = 1,
    quiet: bool = False,
    stop: Interruption,
) -> tuple[int, list[str]]:
    """Do some runs of a result again; return how many, and what differs, in words.

    The runs that are left out, and the gaps of all rows, are checked as well. No code in a result is run: a
    user's controller is to be named, and must have the digest that the result tells. Raises InputError.
    """
    result = read_result(path)
    entry, chosen = result["entry"], result["selection"]
    name = controller or entry["controller"]
    if entry["source_sha256"] and controller is None and name != "oracle":
        raise InputError(f"{path}: its controller {name} is a file; pass --controller FILE.py:CLASS")
    contender = Contender(name, entry["set"])
    selection = Selection(chosen["quick"], tuple(chosen["tracks"]), tuple(chosen["maps"]))
    studies = dict(contender.studies(selection))
    if contender.facts(next(iter(studies.values())))["source_sha256"] != entry["source_sha256"]:
        raise InputError(f"{path}: --controller: {name} is not the source that was rated: its digest differs")
    found = [f"made with {words}" for words in [difference_of(result["versions"])] if words]
    told = {(row["track"], row["map"], row["seed"]): row for row in result["rows"]}
    every = ((track, task) for track, study in studies.items() for task in tasks_of(study))
    tasks = {(track, task.map, task.seed): task for track, task in every}
    found += [f"{_where(key)}: missing row" for key in tasks.keys() - told.keys()]
    found += [f"{_where(key)}: a row of a run that was not selected" for key in told.keys() - tasks.keys()]
    for key, row in told.items():
        found += _differences(key, row, {} if "error" in row else rated(row["track"], row["map"], row))
    both = sorted(told.keys() & tasks.keys())
    picked = np.random.default_rng(seed).permutation(len(both))[:sample].tolist()
    again = {tasks[both[k]].name: both[k] for k in sorted(picked)}

    def compare(task: Task, outcome: Outcome) -> None:
        key = again[task.name]
        row = row_of(key[0], task, outcome, outcome.files.get(EFFORT, b"{}"))
        found.extend(_differences(key, told[key], row))

    count, runs = Count(len(again)), [tasks[key] for key in again.values()]
    with sweep_progress("verify", count, quiet=quiet) as tell:
        for _ in worked_off(runs, lambda: LocalPool(min(workers, len(again))), count, stop, compare):
            tell(count)
    return count.over, list(dict.fromkeys(found))


def _where(key: tuple[str, str, int]) -> str:
    return f"{key[0]}, {key[1]}, seed {key[2]}"


def _differences(key: tuple[str, str, int], told: Row, right: Mapping[str, Any]) -> list[str]:
    return [
        f"{_where(key)}: {name}: expected {value}, got {told.get(name)}"
        for name, value in right.items()
        if name != "deciding_s" and told.get(name) != value
    ]
