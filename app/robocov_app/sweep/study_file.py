"""Study files, TOML: their structure as pydantic models, and what is wrong with them in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, ValidationError
from pydantic_core import ErrorDetails

from robocov.environment import Environment
from robocov.errors import InputError, one_line, place, shown, unknown_name
from robocov.files.strictjson import parse_toml, read_bytes
from robocov.mapfile import bundled_maps, load_map
from robocov_app.sweep.gains import NO_LIMIT, Method, Range, Sampling, Scale, once
from robocov_app.sweep.study import ALL, MOST_RUNS, Study, StudyMap


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


def _shape(value: object) -> str:
    """Return which of the shapes that a value may have it is meant to be."""
    if isinstance(value, list):
        return "list"
    return "table" if isinstance(value, dict) else "one"


class RangeModel(_Model):
    """A range of a gain, which is sampled."""

    low: float
    high: float
    scale: Scale = "linear"


class SamplingModel(_Model):
    """How ranges are sampled."""

    method: Method
    samples: int
    seed: int = 0


def _kind(value: object) -> str:
    return "word" if isinstance(value, str) else "number"


_Texts: TypeAlias = Annotated[
    Annotated[str, Tag("one")] | Annotated[list[str], Tag("list")], Discriminator(_shape)
]
_Wholes: TypeAlias = Annotated[
    Annotated[int, Tag("one")] | Annotated[list[int], Tag("list")], Discriminator(_shape)
]
_Value: TypeAlias = Annotated[
    Annotated[float, Tag("number")] | Annotated[Literal["null"], Tag("word")], Discriminator(_kind)
]
_GainValue: TypeAlias = Annotated[
    Annotated[float, Tag("number")] | Annotated[str, Tag("word")], Discriminator(_kind)
]
_Values: TypeAlias = Annotated[
    Annotated[_Value, Tag("one")] | Annotated[list[_Value], Tag("list")], Discriminator(_shape)
]
_Gain: TypeAlias = Annotated[
    Annotated[_GainValue, Tag("one")]
    | Annotated[list[_GainValue], Tag("list")]
    | Annotated[RangeModel, Tag("table")],
    Discriminator(_shape),
]


class TeamModel(_Model):
    """Parameters of the robots: a value, or a list of which each is tried."""

    radius: _Values | None = None
    max_speed: _Values | None = None
    max_acceleration: _Values | None = None
    viscosity: _Values | None = None
    sensing_range: _Values | None = None
    communication_range: _Values | None = None
    group: list[dict[str, Any]] | None = None


_Condition: TypeAlias = Annotated[
    Annotated[_GainValue, Tag("one")] | Annotated[list[_GainValue], Tag("list")], Discriminator(_shape)
]


class ConditionsModel(_Model):
    """What goes wrong during the runs: a value, or a list of which each is tried."""

    loss: _Condition | None = None
    delay: _Condition | None = None
    message_rate: _Condition | None = None
    forget_after: _Condition | None = None
    position_noise: _Condition | None = None
    sensing_noise: _Condition | None = None
    failure_rate: _Condition | None = None
    fail: _Condition | None = None
    join: _Condition | None = None


class StudyModel(_Model):
    """A study file. What is not given is as `Study` has it."""

    maps: _Texts
    controllers: _Texts
    robots: _Wholes | None = None
    starts: _Texts | None = None
    seeds: _Wholes | None = None
    duration: float | None = None
    dt: float | None = None
    lattice: int | None = None
    cost_hz: float | None = None
    record_hz: float | None = None
    metrics: bool | None = None
    team: TeamModel = TeamModel()
    conditions: ConditionsModel = ConditionsModel()
    gains: dict[str, dict[str, _Gain]] = {}
    sampling: SamplingModel | None = None


_TEXTS = "a text, or a list of texts,"
_WHOLES = "a whole number, or a list of whole numbers,"
_VALUE = f'a number, or "{NO_LIMIT}" for no limit,'
_GAIN_VALUE = f'a number, "{NO_LIMIT}" for no limit, or a word,'
_VALUES = "a number, or a list of numbers,"
_WANTED: dict[tuple[str, ...], tuple[str, ...]] = {
    # what is wanted at a key, and in its items; * is any key
    ("maps",): ("a list of names of maps, or of paths beside this file,", "a text"),
    ("controllers",): ("a list of controllers", "a text"),
    ("robots",): (_WHOLES, "a whole number"),
    ("starts",): (_TEXTS, "a text"),
    ("seeds",): ("how many seeds, or a list of seeds,", "a whole number"),
    ("lattice",): ("a whole number",),
    ("metrics",): ("true or false",),
    ("team",): ("a table [team]",),
    ("team", "group"): ("tables [[team.group]]", "a table"),
    ("team", "*"): (_VALUES, _VALUE),
    ("conditions",): ("a table [conditions]",),
    ("conditions", "*"): ("a number or a text, or a list of them,", "a number or a text"),
    ("gains",): ("tables [gains.NAME]",),
    ("gains", "*"): ("a table of gains",),
    ("gains", "*", "*"): ("a number or a word, a list of them, or a range {low, high},", _GAIN_VALUE),
    ("gains", "*", "*", "scale"): ('"linear" or "log"',),
    ("sampling",): ("a table [sampling]",),
    ("sampling", "method"): ('"sobol", "latin-hypercube" or "halton"',),
    ("sampling", "samples"): ("a whole number",),
    ("sampling", "seed"): ("a whole number",),
}


def read_study(path: Path | str) -> Study:
    """Return the study in a TOML file.

    Raises InputError in one line: the file, the key, the value and what was wanted; of unknown keys the
    nearest known one.
    """
    path = Path(path)
    where = one_line(path)
    return study_of(parse_toml(read_bytes(path), where), path.parent, where)


def study_of(document: dict[str, Any], folder: Path, where: str) -> Study:
    """Return the study that a parsed file describes; relative paths begin at `folder`."""
    try:
        model = StudyModel.model_validate(document)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        # a misspelt key is also a missing one: naming the key that is there helps more
        details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
        more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
        raise InputError(f"{where}: {_message(details[0], document)}{more}") from None
    given: dict[str, Any] = {}
    for name, value in model:
        if value is not None and name not in ("team", "conditions", "gains", "sampling"):
            given[name] = value if isinstance(value, list) or name in _ALONE else [value]
    given |= {name: value for name, value in model.team if value is not None}
    given["conditions"] = {name: value for name, value in model.conditions if value is not None}
    try:
        given["maps"] = _maps(given["maps"], folder)
        if isinstance(model.seeds, int):
            given["seeds"] = _first_seeds(model.seeds)
        if model.sampling is not None:
            given["sampling"] = Sampling(**dict(model.sampling))
        gains = {name: {key: _gain(value) for key, value in law.items()} for name, law in model.gains.items()}
        return Study(**given, gains=gains, folder=folder)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


_ALONE = ("duration", "dt", "lattice", "cost_hz", "record_hz", "metrics")  # keys whose values are never lists


def _gain(value: Any) -> Any:
    return Range(**dict(value)) if isinstance(value, RangeModel) else value


def _first_seeds(count: int) -> range:
    if not 1 <= count <= MOST_RUNS:
        raise InputError(f"seeds: {shown(count)}, but a whole number from 1 to {MOST_RUNS} was wanted")
    return range(count)


def _maps(entries: list[str], folder: Path) -> list[StudyMap]:
    known = bundled_maps()
    if entries == [ALL]:
        entries = list(known)
    once(entries, ("maps",))
    maps: dict[str, StudyMap] = {}
    for k, entry in enumerate(entries):
        try:
            name, environment = _named_map(entry, folder)
        except InputError as error:
            raise InputError(f"maps[{k}]: {error}") from error
        if name in maps:
            wanted = f"maps whose names differ, and there is a {name!r} already,"
            raise InputError(f"maps[{k}]: {shown(entry)}, but {wanted} were wanted")
        maps[name] = StudyMap(name, environment)
    return list(maps.values())


def _named_map(entry: str, folder: Path) -> tuple[str, Environment]:
    """Return what a map is called in the table, and the map."""
    known = bundled_maps()
    if entry in known:
        return entry, load_map(known[entry])
    if not entry.endswith(".json"):
        raise InputError(unknown_name("map", entry, known))
    path = folder / entry
    return path.stem, load_map(path)


def _message(detail: ErrorDetails, document: object) -> str:
    """Return one structural error in the project's words: key, value, what was wanted."""
    path, value = _located(detail, document)
    if detail["type"] == "extra_forbidden":
        *parent, key = path
        at = f"{place(parent)}: " if parent else ""
        return f"{at}{unknown_name('key', str(key), _keys(tuple(parent)))}"
    found = "missing" if detail["type"] == "missing" else shown(value)
    keys = tuple(step for step in path if isinstance(step, str))
    for pattern, wanted in _WANTED.items():
        if len(pattern) == len(keys) and all(p in ("*", key) for p, key in zip(pattern, keys, strict=True)):
            return f"{place(path)}: {found}, but {wanted[len(path) - len(keys)]} was wanted"
    return f"{place(path)}: {found}, but a number was wanted"


def _located(detail: ErrorDetails, document: object) -> tuple[list[str | int], object]:
    """Return the path of an error in the file, where pydantic names shapes among the steps, and the value."""
    path: list[str | int] = []
    value: Any = document
    steps = list(detail["loc"])
    for k, step in enumerate(steps):
        last = k == len(steps) - 1
        if isinstance(value, dict) and (step in value or (last and detail["type"] == "missing")):
            path.append(step)
            value = value.get(step)
        elif isinstance(value, list) and isinstance(step, int):
            path.append(step)
            value = value[step]
    return path, value


def _keys(parent: tuple[str | int, ...]) -> list[str]:
    """Return the keys that a table of the file may have."""
    tables: dict[int, dict[object, type[_Model]]] = {
        0: {(): StudyModel},
        1: {("team",): TeamModel, ("conditions",): ConditionsModel, ("sampling",): SamplingModel},
    }
    model = tables.get(len(parent), {}).get(parent, RangeModel)
    return list(model.model_fields)
