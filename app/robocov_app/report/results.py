"""Results read from folders: a run, a comparison or a sweep is a list of entries, with its references."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov import __version__
from robocov.controllers import CONTROLLERS, get_gains
from robocov.controllers.gains import Value
from robocov.environment import Environment
from robocov.errors import InputError, ParameterError, RobocovError, quote
from robocov.files.array_files import ArrayCache
from robocov.files.documents import read_document
from robocov.files.result_folder import complete_commit
from robocov.mapfile import from_json, to_json
from robocov.metrics import CostHistory, compute_mean_over_run
from robocov.metrics.results import read_history, read_results
from robocov.optimum import find_optimum
from robocov.record import Record
from robocov_app.runs.saved_runs import ComparisonDocument, SavedRun, build_roster, load_saved_runs
from robocov_app.sweep.parameters import UNITS, name_parameter_column
from robocov_app.sweep.table import get_gain_column

RESTARTS = 24  # searches of which the best counts

Kind: TypeAlias = Literal["run", "comparison", "sweep"]
Gains: TypeAlias = tuple[tuple[str, Value], ...]
Parameters: TypeAlias = tuple[tuple[str, float | None], ...]
Setting: TypeAlias = tuple[str, int, Parameters]  # map, number of robots, team: what makes costs comparable

# what is known of a run in numbers, by the names of the columns of a sweep's table
FIGURES = (
    *("mean_distance_m", "mean_distance_over_run_m", "cost_m3", "uncovered_area_m2", "settled_at_s"),
    *("contacts", "min_clearance_m", "path_length_m", "stuck_robots", "mean_time_s"),
)


@dataclass(frozen=True)
class Entry:
    """One run of a result."""

    map: str
    controller: str
    label: str  # the controller's name as shown to people
    robots: int
    team: Parameters  # those of which there are several values; None: no limit
    start: str | None
    seed: int | None
    gains: Gains
    figures: Mapping[str, float | None] = field(compare=False)  # `FIGURES`; nothing where it failed
    error: str | None
    folder: Path

    @property
    def final(self) -> float:
        value = self.figures.get("mean_distance_m")
        return float("nan") if value is None else float(value)

    def has(self, name: str) -> bool:
        value = self.figures.get(name)
        return value is not None and bool(np.isfinite(value))

    @property
    def setting(self) -> Setting:
        return self.map, self.robots, self.team

    @property
    def case(self) -> tuple[object, ...]:
        return *self.setting, self.start, self.seed


class Reference(NamedTuple):
    """The lowest cost found for a team that knows the map: J_ref in m, and the uncovered area in m²."""

    mean_distance: float
    uncovered_area: float


class Damaged(NamedTuple):
    """A run that cannot be read: its folder's name, and why."""

    folder: str
    reason: str


@dataclass(frozen=True, eq=False)
class Result:
    """Results of one folder."""

    kind: Kind
    folder: Path
    entries: tuple[Entry, ...]
    maps: Mapping[str, Environment]
    wanted: int  # how many runs there were to be
    units: Mapping[str, str]  # of gains
    meanings: Mapping[str, str]
    # the same of all runs: ``duration_s``, ``dt_s``, ``lattice``, ``record_hz``, ``team``, ``versions``
    facts: Mapping[str, Any]
    loaded: Mapping[Path, SavedRun]  # runs that were read already
    damaged: tuple[Damaged, ...] = ()  # runs that cannot be read and are no entries
    references: Mapping[Setting, Reference] = field(default_factory=dict)  # of settings
    part: str = ""  # which part of a story it is

    @cached_property
    def fine(self) -> tuple[Entry, ...]:
        return tuple(entry for entry in self.entries if entry.error is None)

    @property
    def failed(self) -> tuple[Entry, ...]:
        return tuple(entry for entry in self.entries if entry.error is not None)

    @property
    def missing(self) -> int:
        return max(self.wanted - len(self.entries) - len(self.damaged), 0)

    def readable(self, tell: Callable[[int], None] = lambda done: None) -> Result:
        """Return the result with runs that cannot be read as damaged ones; `tell` gets how many are read."""
        kept, damaged, done = [], list(self.damaged), 0
        for entry in self.entries:
            if entry.error is None:
                done += 1
                try:
                    self.record(entry)
                    self.history(entry)
                except InputError as error:
                    damaged.append(_damaged(entry.folder, error))
                    continue
                finally:
                    tell(done)
            kept.append(entry)
        return replace(self, entries=tuple(kept), damaged=tuple(damaged))

    def gap(self, entry: Entry) -> float:
        """Return J / J_ref - 1 of a run at its end, nan where there is no reference that covers as much."""
        reference = self.references.get(entry.setting)
        uncovered = entry.figures.get("uncovered_area_m2") or 0.0
        if reference is None or abs(uncovered - reference.uncovered_area) > 1e-6:
            return float("nan")
        return entry.final / reference.mean_distance - 1.0

    def record(self, entry: Entry) -> Record:
        if entry.folder in self.loaded:
            return self.loaded[entry.folder].record
        record = Record.load(entry.folder)
        if not len(record) or not len(record.team) or not np.isfinite(record.positions).all():
            raise InputError(f"{entry.folder / 'record.npz'}: expected finite positions of robots")
        return record

    def history(self, entry: Entry) -> CostHistory | None:
        if entry.folder in self.loaded:
            return self.loaded[entry.folder].history
        path = entry.folder / "cost.csv"
        return read_history(path) if path.exists() else None


def with_references(result: Result, *, search: bool, tell: Callable[[int], None]) -> Result:
    """Return the result with centralized references, cached or by `search`; none where things change."""
    lattice = result.facts.get("lattice")
    first = {entry.setting: entry for entry in reversed(result.fine)}
    found = {}
    for done, (setting, entry) in enumerate(first.items(), start=1):
        record = result.record(entry)
        everybody = record.present.all() and record.working.all()
        if isinstance(lattice, int) and everybody and not record.environment.has_moving_obstacles:
            reference = _reference(record, lattice, search=search)
            if reference is not None:
                found[setting] = reference
        tell(done)
    return replace(result, references=found)


def _reference(record: Record, lattice: int, *, search: bool) -> Reference | None:
    environment, robots, radius = record.environment, len(record.team), float(record.team.radius.max())
    cache = ArrayCache.open_default()
    content = json.dumps(to_json(environment), sort_keys=True)
    key = ArrayCache.compute_key("optimum", __version__, content, robots, radius, lattice, RESTARTS)
    kept = None if cache is None else cache.load(key)
    if kept is not None:
        return Reference(*kept["reference"].tolist())
    if not search:
        return None
    try:
        best = find_optimum(environment, robots, radius=radius, lattice=lattice, restarts=RESTARTS)
    except ParameterError:
        return None  # more robots than have room at rest
    reference = Reference(best.mean_distance, best.uncovered_area)
    if cache is not None:
        cache.save(key, {"reference": np.array(reference)})
    return reference


def gathered(folder: Path) -> Result:
    """Return what is in the folder of a run, comparison or sweep; raises InputError that names the file."""
    if not folder.is_dir():
        raise InputError(f"{folder}: folder not found, expected the folder of a run, comparison or sweep")
    if (folder / "study.json").is_file():
        return _of_sweep(folder)
    complete_commit(folder)
    if not any((folder / name).is_file() for name in ("comparison.json", "run.json")):
        missing = "(there is no run.json, no comparison.json and no study.json)"
        raise InputError(f"{folder}: not the folder of a run, a comparison or a sweep {missing}")
    return _of_runs(folder)


def printable(text: str) -> str:
    """Return a text as a page can hold it: what is no character becomes a question mark of its own."""
    return "".join(c if c.isprintable() else "\ufffd" for c in text)


def _damaged(folder: Path, error: InputError) -> Damaged:
    reason = str(error).removeprefix(f"{folder}: ").replace(f"{folder}/", "")
    return Damaged(printable(folder.name), printable(reason))


def _of_runs(folder: Path) -> Result:
    kind: Kind = "run"
    parts, unfinished, path = [folder], False, folder / "comparison.json"
    if path.is_file():
        kind, document = "comparison", read_document(path, ComparisonDocument, "robocov-comparison", 1)
        parts, unfinished = [folder / name for name in document.folders], not document.runs
    saved: list[SavedRun] = []
    damaged: list[Damaged] = []
    for part in parts:
        if unfinished and not (part / "run.json").is_file():
            continue
        try:
            each = load_saved_runs(part)[0]
            same = [build_roster(run.record).environment for run in (*saved[:1], each)]
            if (same[0].boundary, same[0].obstacles) != (same[-1].boundary, same[-1].obstacles):
                raise InputError(f"{part / 'run.json'}: another map than in {saved[0].folder.name}")
            saved.append(each)
        except InputError as error:
            damaged.append(_damaged(part, error))
    if not saved and not damaged:
        raise InputError(f"{path}: there is no run in it")
    entries: list[Entry] = []
    maps: dict[str, Environment] = {}
    facts: dict[str, Any] = {}
    for each in saved:
        record, content = each.record, _json(each.folder / "run.json")
        name = printable(record.environment.name)
        maps.setdefault(name, build_roster(record).environment)
        facts = facts or {"duration_s": float(record.time[-1]), "dt_s": record.dt} | {
            key: content.get(key) for key in ("lattice", "team", "versions")
        }
        entries.append(
            Entry(
                map=name,
                controller=record.controller,
                label=printable(record.label),
                robots=len(record.team),
                team=(),
                start=None if record.start is None else printable(str(record.start)),
                seed=record.seed,
                gains=_gains(record.gains),
                figures=_figures(content.get("summary"), each.history),
                error=None,
                folder=each.folder,
            )
        )
    loaded = {each.folder: each for each in saved}
    known = _known_gains(entries, {})
    return Result(kind, folder, _labeled(entries), maps, len(parts), *known, facts, loaded, tuple(damaged))


def _of_sweep(folder: Path) -> Result:
    results = read_results(folder)
    study, path = results.study, folder / "study.json"
    try:
        maps = {str(each["name"]): from_json(each["map"], f"{path}: maps") for each in study["maps"]}
        gains = {name: list(each["choices"][0]) for name, each in study["gains"].items()}
        teams = [dict(team) for team in study["teams"]]
        wanted = int(study["runs"])
        facts = {name: study.get(name) for name in ("duration_s", "dt_s", "lattice", "cost_hz", "record_hz")}
    except RobocovError:
        raise
    except Exception as error:
        raise InputError(f"{path}: the study cannot be read: {type(error).__name__}: {error}") from error
    swept = [name for name in UNITS if len({team.get(name) for team in teams}) > 1]
    rows = list(results.rows())
    if not rows:
        raise InputError(f"{folder}: not one of the {wanted} runs of the sweep is done")
    entries = []
    for row in rows:
        controller, trouble = str(row["controller"]), row["error"]
        # a user's controller is not loaded for what it is called
        label = getattr(CONTROLLERS.get(controller), "label", controller.rpartition(":")[2])
        entries.append(
            Entry(
                map=printable(str(row["map"])),
                controller=controller,
                label=printable(label),
                robots=int(row["robots"]),
                team=tuple((name, row.get(name_parameter_column(name))) for name in swept),
                start=printable(str(row["start"])),
                seed=row["seed"],
                gains=_gains({name: row.get(get_gain_column(name)) for name in gains.get(controller, ())}),
                figures={name: row.get(name) for name in FIGURES} if trouble is None else {},
                error=None if trouble is None else printable(str(trouble)),
                folder=folder / "runs" / Path(str(row["run"])).name,
            )
        )
    if teams:
        facts["team"] = {name: value for name, value in teams[0].items() if name not in swept}
    facts["versions"] = None
    for entry in entries:
        with suppress(InputError):
            if entry.error is None:
                facts["versions"] = _json(entry.folder / "run.json").get("versions")
                break
    columns = {each["name"]: (each["unit"], each["meaning"]) for each in study.get("columns", ())}
    text = {name: columns.get(get_gain_column(name), ("", "")) for own in gains.values() for name in own}
    maps = {printable(name): environment for name, environment in maps.items()}
    known = _known_gains(entries, text)
    return Result("sweep", folder, _labeled(entries), maps, wanted, *known, facts, {})


def _labeled(entries: list[Entry]) -> tuple[Entry, ...]:
    labels: dict[str, str] = {}
    for entry in entries:
        if entry.controller not in labels:
            number = 1 + sum(label.partition(" #")[0] == entry.label for label in labels.values())
            labels[entry.controller] = entry.label if number == 1 else f"{entry.label} #{number}"
    return tuple(replace(entry, label=labels[entry.controller]) for entry in entries)


def _gains(gains: Mapping[str, Value]) -> Gains:
    known = ((name, printable(value) if isinstance(value, str) else value) for name, value in gains.items())
    return tuple((printable(name), value) for name, value in known)


def _known_gains(
    entries: list[Entry], others: Mapping[str, tuple[str, str]]
) -> tuple[dict[str, str], dict[str, str]]:
    """Return units and meanings of gains: of the built-in controllers, and what a table says of others."""
    kinds = dict.fromkeys(CONTROLLERS[each.controller] for each in entries if each.controller in CONTROLLERS)
    gains = {name: gain for kind in kinds for name, gain in get_gains(kind).items()}
    units = {name: gain.unit for name, gain in gains.items()}
    meanings = {name: gain.meaning for name, gain in gains.items()}
    for name, (unit, meaning) in others.items():
        if unit or meaning:
            units.setdefault(name, "" if unit == "1" else printable(unit))
            meanings.setdefault(name, printable(meaning))
    return units, meanings


def _figures(summary: Any, history: CostHistory | None) -> dict[str, float | None]:
    known = summary if isinstance(summary, dict) else {}
    figures: dict[str, float | None] = {}
    for name in FIGURES:
        value = known.get(name)
        if name == "path_length_m" and isinstance(value, list) and value:
            value = sum(value) / len(value)
        figures[name] = value if isinstance(value, int | float) and not isinstance(value, bool) else None
    if history is not None and len(history.time):
        final = float(history.mean_distance[-1])
        if figures["mean_distance_m"] is None and np.isfinite(final):
            figures["mean_distance_m"] = final
        if figures["mean_distance_over_run_m"] is None and np.isfinite(history.mean_distance).all():
            figures["mean_distance_over_run_m"] = compute_mean_over_run(history.time, history.mean_distance)
    return figures


def _json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected an object, got {quote(content)}")
    return content
