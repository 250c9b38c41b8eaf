"""Study files, TOML: what may stand in them, and what is wrong with them in one line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, get_args

from robocov.environment import Environment
from robocov.errors import InputError, one_line, place, shown, unknown_name
from robocov.files.strictjson import parse_toml, read_bytes
from robocov.mapfile import bundled_maps, load_map
from robocov_app.sweep.gains import NO_LIMIT, Method, Range, Sampling, Scale, once
from robocov_app.sweep.study import ALL, CONDITIONS, MOST_RUNS, TEAM, UNICYCLES, Study, StudyMap

Check: TypeAlias = Callable[[Any], Any]
"""Returns a value as it is meant; raises ValueError when it is of another kind."""


class _Value(NamedTuple):
    """Accepted values of a key: one value, a list, or a table, and these in words."""

    one: Check | None
    wanted: str
    item: Check | None = None
    item_wanted: str = ""
    table: _Table | None = None


class _Table(NamedTuple):
    """A table: its keys, of which * is any, and those that must be there."""

    wanted: str
    keys: Mapping[str, _Value | _Table]
    required: tuple[str, ...] = ()


def _of(*kinds: type, words: tuple[str, ...] = ()) -> Check:
    """Return what checks the type of a value, or that it is one of some words; numbers become floats."""

    def check(value: Any) -> Any:
        if isinstance(value, bool) is not (bool in kinds) or not (isinstance(value, kinds) or value in words):
            raise ValueError(value)
        return float(value) if float in kinds and not isinstance(value, str) else value

    return check


_TEXT, _WHOLE, _NUMBER = _of(str), _of(int), _of(int, float)
_LIMIT, _WORD = _of(int, float, words=(NO_LIMIT,)), _of(int, float, str)

_TEXTS = "a text, or a list of texts,"
_WHOLES = "a whole number, or a list of whole numbers,"
_ONE = _Value(_NUMBER, "a number")
_COUNT = _Value(_WHOLE, "a whole number")
_RANGE = _Table(
    "",
    {"low": _ONE, "high": _ONE, "scale": _Value(_of(words=get_args(Scale)), '"linear" or "log"')},
    ("low", "high"),
)
_LIMIT_WORDS = f'a number, or "{NO_LIMIT}" for no limit,'
_TEAM = _Value(_LIMIT, "a number, or a list of numbers,", _LIMIT, _LIMIT_WORDS)
_KINDS = _Value(_TEXT, _TEXTS, _TEXT, "a text")
_CONDITION = _Value(_WORD, "a number or a text, or a list of them,", _WORD, "a number or a text")
_GAIN_WORDS = "a number or a word, a list of them, or a range {low, high},"
_GAIN = _Value(_WORD, _GAIN_WORDS, _WORD, f'a number, "{NO_LIMIT}" for no limit, or a word,', _RANGE)
_METHOD = _Value(_of(words=get_args(Method)), '"sobol", "latin-hypercube" or "halton"')
_GROUPS = _Value(None, "tables [[team.group]]", _of(dict), "a table")
_MAPS = "a list of names of maps, or of paths beside this file,"
_STUDY = _Table(
    "a table",
    {
        "maps": _Value(_TEXT, _MAPS, _TEXT, "a text"),
        "controllers": _Value(_TEXT, "a list of controllers", _TEXT, "a text"),
        "robots": _Value(_WHOLE, _WHOLES, _WHOLE, "a whole number"),
        "starts": _Value(_TEXT, _TEXTS, _TEXT, "a text"),
        "seeds": _Value(_WHOLE, "how many seeds, or a list of seeds,", _WHOLE, "a whole number"),
        **dict.fromkeys(("duration", "dt", "cost_hz", "record_hz"), _ONE),
        "lattice": _COUNT,
        "metrics": _Value(_of(bool), "true or false"),
        "team": _Table(
            "a table [team]",
            {**dict.fromkeys((*TEAM, *UNICYCLES), _TEAM), "kinematics": _KINDS, "group": _GROUPS},
        ),
        "conditions": _Table("a table [conditions]", dict.fromkeys(CONDITIONS, _CONDITION)),
        "gains": _Table("tables [gains.NAME]", {"*": _Table("a table of gains", {"*": _GAIN})}),
        "sampling": _Table(
            "a table [sampling]",
            {"method": _METHOD, "samples": _COUNT, "seed": _COUNT},
            ("method", "samples"),
        ),
    },
    ("maps", "controllers"),
)
"""Schema of a study file. What is not given is as `Study` has it."""


class _Reading:
    """Takes a document apart; `unknown` keys are told first: a misspelt one is also a missing one."""

    def __init__(self) -> None:
        self.unknown: list[str] = []
        self.mistakes: list[str] = []

    def table(self, given: dict[str, Any], table: _Table, path: tuple[str | int, ...] = ()) -> dict[str, Any]:
        keys = table.keys if "*" not in table.keys else dict.fromkeys(given, table.keys["*"])
        above = f"{place(path)}: " if path else ""
        self.unknown += [above + unknown_name("key", key, keys) for key in given if key not in keys]
        for key in table.required:
            if key not in given:
                self.mistakes.append(f"{place((*path, key))}: missing, but {keys[key].wanted} was wanted")
        return {key: self.value(given[key], keys[key], (*path, key)) for key in keys if key in given}

    def value(self, given: Any, wanted: _Value | _Table, path: tuple[str | int, ...]) -> Any:
        table = wanted if isinstance(wanted, _Table) else wanted.table
        if table is not None and isinstance(given, dict):
            return self.table(given, table, path)
        if isinstance(wanted, _Value) and wanted.item and isinstance(given, list):
            item = _Value(wanted.item, wanted.item_wanted)
            return [self.value(value, item, (*path, k)) for k, value in enumerate(given)]
        try:
            if isinstance(wanted, _Value) and wanted.one:
                return wanted.one(given)
        except (ValueError, OverflowError):
            pass
        self.mistakes.append(f"{place(path)}: {shown(given)}, but {wanted.wanted} was wanted")
        return None


def read_study(path: Path | str) -> Study:
    """Return the study in a TOML file; raises InputError: the file, the key, the value, what was wanted."""
    path = Path(path)
    where = one_line(path)
    return study_of(parse_toml(read_bytes(path), where), path.parent, where)


def study_of(document: dict[str, Any], folder: Path, where: str) -> Study:
    """Return the study that a parsed file describes; relative paths begin at `folder`."""
    reading = _Reading()
    given = reading.table(document, _STUDY)
    mistakes = reading.unknown + reading.mistakes
    if mistakes:
        more = f" (and {len(mistakes) - 1} more)" if len(mistakes) > 1 else ""
        raise InputError(f"{where}: {mistakes[0]}{more}")
    try:
        if isinstance(given.get("seeds"), int):
            count = given["seeds"]
            if not 1 <= count <= MOST_RUNS:
                wanted = f"a whole number from 1 to {MOST_RUNS}"
                raise InputError(f"seeds: {shown(count)}, but {wanted} was wanted")
            given["seeds"] = range(count)
        for name in ("maps", "controllers", "robots", "starts"):
            if name in given and not isinstance(given[name], list):
                given[name] = [given[name]]
        given["maps"] = _maps(given["maps"], folder)
        if "sampling" in given:
            given["sampling"] = Sampling(**given["sampling"])
        for law in given.get("gains", {}).values():
            law |= {name: Range(**value) for name, value in law.items() if isinstance(value, dict)}
        return Study(**given.pop("team", {}), **given, folder=folder)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


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
    known = bundled_maps()
    if entry in known:
        return entry, load_map(known[entry])
    if not entry.endswith(".json"):
        raise InputError(unknown_name("map", entry, known))
    path = folder / entry
    return path.stem, load_map(path)
