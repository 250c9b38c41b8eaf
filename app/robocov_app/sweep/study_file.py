"""Study files, TOML: what may stand in them, and what is wrong with them in one line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, get_args

from robocov.errors import InputError, JsonPath, describe_unknown_name, format_path, quote, to_one_line
from robocov.files.strictjson import parse_toml, read_bytes
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.sweep.gains import NO_LIMIT
from robocov_app.sweep.parameters import CONDITIONS, KINEMATIC_DEFAULTS, TEAM_PARAMETERS
from robocov_app.sweep.paths import require_distinct
from robocov_app.sweep.sampling import Range, Sampling, SamplingMethod, Scale
from robocov_app.sweep.study import Study, StudyMap

ALL_MAPS = "*"
"""Stands for all bundled maps."""
Check: TypeAlias = Callable[[Any], Any]  # returns a value as it is meant; ValueError for one of another kind


class _Value(NamedTuple):
    """Accepted values of a key in words: one value, lists of an `item`, or a table."""

    wanted: str
    one: Check | None = None
    item: _Value | None = None
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


_TEXT, _WHOLE = _Value("a string", _of(str)), _Value("a whole number", _of(int))
_NUMBER, _WORD = _Value("a number", _of(int, float)), _Value("a number or a string", _of(int, float, str))
_LIMIT = _Value(f'a number, or "{NO_LIMIT}" for no limit', _of(int, float, words=(NO_LIMIT,)))
_SCALE = _Value('"linear" or "log"', _of(words=get_args(Scale)))
_METHOD = _Value('"sobol", "latin-hypercube" or "halton"', _of(words=get_args(SamplingMethod)))


def _several(wanted: str, item: _Value) -> _Value:
    return _Value(wanted, item.one, item)


_TEXTS = _several("a string, or a list of strings", _TEXT)
_TEAM = _several("a number, or a list of numbers", _LIMIT)
_CONDITION = _several("a number or a string, or a list of them", _WORD)
_GAIN = _Value(
    "a number or a word, a list of them, or a range {low, high}",
    _WORD.one,
    _WORD._replace(wanted=f'a number, "{NO_LIMIT}" for no limit, or a word'),
    _Table("", {"low": _NUMBER, "high": _NUMBER, "scale": _SCALE}, ("low", "high")),
)
_GROUPS = _Value("tables [[team.group]]", item=_Value("a table", _of(dict)))
_OF_TEAM = dict.fromkeys((*TEAM_PARAMETERS, *KINEMATIC_DEFAULTS), _TEAM) | {
    "kinematics": _TEXTS,
    "group": _GROUPS,
}
_SAMPLING = {"method": _METHOD, "samples": _WHOLE, "seed": _WHOLE}
_STUDY = _Table(
    "a table",
    {
        "maps": _several("a list of names of maps, or of paths beside this file", _TEXT),
        "controllers": _several("a list of controllers", _TEXT),
        "robots": _several("a whole number, or a list of whole numbers", _WHOLE),
        "starts": _TEXTS,
        "seeds": _several("how many seeds, or a list of seeds", _WHOLE),
        **dict.fromkeys(("duration", "dt", "cost_hz", "record_hz"), _NUMBER),
        "lattice": _WHOLE,
        "metrics": _Value("true or false", _of(bool)),
        "max_runs": _WHOLE,
        "team": _Table("a table [team]", _OF_TEAM),
        "conditions": _Table("a table [conditions]", dict.fromkeys(CONDITIONS, _CONDITION)),
        "gains": _Table("tables [gains.NAME]", {"*": _Table("a table of gains", {"*": _GAIN})}),
        "sampling": _Table("a table [sampling]", _SAMPLING, ("method", "samples")),
    },
    ("maps", "controllers"),
)
"""Schema of a study file. What is not given is as `Study` has it."""


def _read(
    given: Any, wanted: _Value | _Table, path: JsonPath, unknown: list[str], mistakes: list[str]
) -> Any:
    """Return what is given as it is meant; `unknown` keys are told first: a misspelt one is also missing."""
    one, item, table = wanted[1:] if isinstance(wanted, _Value) else (None, None, wanted)
    if table is not None and isinstance(given, dict):
        keys = table.keys if "*" not in table.keys else dict.fromkeys(given, table.keys["*"])
        above = f"{format_path(path)}: " if path else ""
        unknown += [above + describe_unknown_name("key", key, keys) for key in given if key not in keys]
        missing = {format_path((*path, key)): keys[key].wanted for key in table.required if key not in given}
        mistakes += [f"{at}: missing, expected {what}" for at, what in missing.items()]
        there = [key for key in keys if key in given]
        return {key: _read(given[key], keys[key], (*path, key), unknown, mistakes) for key in there}
    if item is not None and isinstance(given, list):
        return [_read(value, item, (*path, k), unknown, mistakes) for k, value in enumerate(given)]
    with suppress(ValueError, OverflowError):
        if one is not None:
            return one(given)
    mistakes.append(f"{format_path(path)}: expected {wanted.wanted}, got {quote(given)}")
    return None


def read_study(path: Path | str) -> Study:
    """Return the study in a TOML file; raises InputError with file, key, expected and given value."""
    path = Path(path)
    where = to_one_line(path)
    return study_of(parse_toml(read_bytes(path), where), path.parent, where)


def study_of(document: dict[str, Any], folder: Path, where: str) -> Study:
    """Return the study that a parsed file describes; relative paths begin at `folder`."""
    unknown: list[str] = []
    mistakes: list[str] = []
    given = _read(document, _STUDY, (), unknown, mistakes)
    if mistakes := unknown + mistakes:
        more = f" (and {len(mistakes) - 1} more)" if len(mistakes) > 1 else ""
        raise InputError(f"{where}: {mistakes[0]}{more}")
    try:
        if isinstance(given.get("seeds"), int):
            count = given["seeds"]
            if count < 1:
                raise InputError(f"seeds: expected a whole number from 1, got {quote(count)}")
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
    known = list_bundled_maps()
    if entries == [ALL_MAPS]:
        entries = list(known)
    require_distinct(entries, ("maps",))
    maps: dict[str, StudyMap] = {}
    for k, entry in enumerate(entries):
        try:
            if entry not in known and not entry.endswith(".json"):
                raise InputError(describe_unknown_name("map", entry, known))
            name = entry if entry in known else (folder / entry).stem
            environment = load_map(known.get(entry, folder / entry))
        except InputError as error:
            raise InputError(f"maps[{k}]: {error}") from error
        if name in maps:
            wanted = f"maps whose names differ, and there is a {name!r} already"
            raise InputError(f"maps[{k}]: expected {wanted}, got {quote(entry)}")
        maps[name] = StudyMap(name, environment)
    return list(maps.values())
