"""Study files in TOML, and one-line messages about their errors.

The schema below defines which values a key accepts. It is not a pydantic model, because a key may accept a
single value, a list of values or a table, and the message must describe the alternative that the user chose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, get_args

from robocov.errors import (
    InputError,
    JsonPath,
    describe_unknown_name,
    format_count,
    format_path,
    quote,
    to_one_line,
)
from robocov.files.paths import is_existing_file
from robocov.files.strictjson import parse_toml, read_bytes
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.sweep.study.gains import NO_LIMIT
from robocov_app.sweep.study.sampling import Range, Sampling, SamplingMethod, Scale
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.study.value_paths import require_distinct

ALL_MAPS = "*"
"""Name that selects all bundled maps."""
_ANY_KEY = "*"
"""Key of a table schema that matches all keys."""
_LIST_KEYS = ("maps", "controllers", "robots", "starts")
"""Keys for which `Study` expects a list, but a file may contain a single value."""

_Converter: TypeAlias = Callable[[Any], Any]
"""Converts a value to the required type; raises ValueError for values of other types."""


class _ValueSchema(NamedTuple):
    """Schema of a key: a single value, a list or a table. An alternative that is None is not accepted."""

    expected: str
    """Description of the accepted values."""
    convert: _Converter | None = None
    """Conversion of a single value."""
    item: _ValueSchema | None = None
    """Schema of the items of a list."""
    table: _TableSchema | None = None
    """Schema of a table."""


class _TableSchema(NamedTuple):
    """Schema of a table."""

    expected: str
    """Description of the table."""
    keys: Mapping[str, _Key]
    """Descriptions of the accepted keys."""
    required: tuple[str, ...] = ()
    """Keys that the table must contain."""


class _Key(NamedTuple):
    """Description of a key of a table."""

    meaning: str
    """Meaning of the value, with its unit and its default; Markdown."""
    schema: _ValueSchema | _TableSchema
    """Schema of the value."""


def _accept(*types: type, words: tuple[str, ...] = ()) -> _Converter:
    """Return a converter that accepts values of given types, and given words.

    A bool does not count as an int. If float is accepted, numbers become floats.
    """

    def convert(value: Any) -> Any:
        if isinstance(value, bool) != (bool in types):
            raise ValueError(value)
        if not isinstance(value, types) and value not in words:
            raise ValueError(value)
        if float in types and not isinstance(value, str):
            return float(value)
        return value

    return convert


def _accept_list(expected: str, item: _ValueSchema) -> _ValueSchema:
    """Return the schema of a single value or a list of such values."""
    return _ValueSchema(expected, item.convert, item)


_TEXT = _ValueSchema("a string", _accept(str))
_WHOLE_NUMBER = _ValueSchema("a whole number", _accept(int))
_NUMBER = _ValueSchema("a number", _accept(int, float))
_NUMBER_OR_TEXT = _ValueSchema("a number or a string", _accept(int, float, str))
_NUMBER_OR_NO_LIMIT = _ValueSchema(
    f'a number, or "{NO_LIMIT}" for no limit', _accept(int, float, words=(NO_LIMIT,))
)
_SCALE = _ValueSchema('"linear" or "log"', _accept(words=get_args(Scale)))
_METHOD = _ValueSchema('"sobol", "latin-hypercube" or "halton"', _accept(words=get_args(SamplingMethod)))

_TEXTS = _accept_list("a string, or a list of strings", _TEXT)
_TEAM_PARAMETER = _accept_list("a number, or a list of numbers", _NUMBER_OR_NO_LIMIT)
_CONDITION = _accept_list("a number or a string, or a list of them", _NUMBER_OR_TEXT)
_RANGE = _TableSchema(
    "a range {low, high}",
    {
        "low": _Key("Minimum", _NUMBER),
        "high": _Key("Maximum", _NUMBER),
        "scale": _Key("Scale on which samples are evenly spread (default: linear)", _SCALE),
    },
    required=("low", "high"),
)
_GAIN = _ValueSchema(
    "a number or a word, a list of them, or a range {low, high}",
    convert=_NUMBER_OR_TEXT.convert,
    item=_NUMBER_OR_TEXT._replace(expected=f'a number, "{NO_LIMIT}" for no limit, or a word'),
    table=_RANGE,
)
_GROUPS = _ValueSchema("tables [[team.group]]", item=_ValueSchema("a table", _accept(dict)))
_SAMPLING = _TableSchema(
    "a table [sampling]",
    {
        "method": _Key("Method of sampling", _METHOD),
        "samples": _Key("Number of samples of each controller's gains", _WHOLE_NUMBER),
        "seed": _Key("Seed of the samples (default: 0)", _WHOLE_NUMBER),
    },
    required=("method", "samples"),
)
_TEAM = _TableSchema(
    "a table [team]",
    {
        "radius": _Key("Radius of the robots, m", _TEAM_PARAMETER),
        "max_speed": _Key("Maximum speed of the robots, m/s", _TEAM_PARAMETER),
        "max_acceleration": _Key("Maximum acceleration of the robots, m/s²", _TEAM_PARAMETER),
        "viscosity": _Key("Viscosity of the robots, N s/m", _TEAM_PARAMETER),
        "sensing_range": _Key("Sensing range of the robots, m", _TEAM_PARAMETER),
        "communication_range": _Key("Communication range of the robots, m", _TEAM_PARAMETER),
        "kinematics": _Key("`point` or `unicycle`", _TEXTS),
        "track_width": _Key("Distance between the wheels of a unicycle, m", _TEAM_PARAMETER),
        "turning_rate": _Key("Maximum turning rate of a unicycle, rad/s", _TEAM_PARAMETER),
        "group": _Key("Groups of robots, as in a team file", _GROUPS),
    },
)
_CONDITIONS = _TableSchema(
    "a table [conditions]",
    {
        "loss": _Key("Probability that a message is lost", _CONDITION),
        "delay": _Key("Message latency, s", _CONDITION),
        "message_rate": _Key(
            "Messages per second that each robot sends (default: one in every step)", _CONDITION
        ),
        "bandwidth": _Key("Bytes per second that each robot can send (default: unlimited)", _CONDITION),
        "forget_after": _Key("Time without messages after which a robot is forgotten, s", _CONDITION),
        "position_noise": _Key("Standard deviation of the localization noise, m", _CONDITION),
        "sensing_noise": _Key("Standard deviation of the noise of the range sensor, m", _CONDITION),
        "failure_rate": _Key("Failures per second of each robot", _CONDITION),
        "fail": _Key("Failures, as in `3@20 5@40`", _CONDITION),
        "join": _Key("Late robots, as in `6@30:2.5,1`", _CONDITION),
        "density": _Key(
            "`known`, or `sensed` if robots have to measure the density (default: known)", _CONDITION
        ),
    },
)
_CONTROLLER_GAINS = _TableSchema(
    "a table of gains",
    {_ANY_KEY: _Key('A gain; `{low = 3, high = 100, scale = "log"}` is a range to sample', _GAIN)},
)
_GAINS = _TableSchema(
    "tables [gains.NAME]", {_ANY_KEY: _Key("Gains of a controller, by its name", _CONTROLLER_GAINS)}
)
_STUDY = _TableSchema(
    "a table",
    {
        "maps": _Key(
            'Names of bundled maps, or paths and patterns such as `"maps/*.json"` relative to this file; '
            '`"*"` for all bundled maps',
            _accept_list("a list of names of maps, or of paths relative to this file", _TEXT),
        ),
        "controllers": _Key(
            "Names of controllers, or `mine.py:MyController`", _accept_list("a list of controllers", _TEXT)
        ),
        "robots": _Key(
            "Number of robots (default: 6)",
            _accept_list("a whole number, or a list of whole numbers", _WHOLE_NUMBER),
        ),
        "starts": _Key('Names of starts; `"*"` for all starts of each map (default: the first one)', _TEXTS),
        "seeds": _Key(
            "Seeds of the starting positions and conditions: a list, or 10 for 0 to 9 (default: seed 0)",
            _accept_list("a number of seeds, or a list of seeds", _WHOLE_NUMBER),
        ),
        "duration": _Key("Simulated time, s (default: 60)", _NUMBER),
        "dt": _Key("Control period, s (default: 1/60)", _NUMBER),
        "cost_hz": _Key(
            "Evaluations of the cost per second; 0 for the first and last step only (default: 2)", _NUMBER
        ),
        "record_hz": _Key(
            "Saved samples per second; 0 for the first and last step only (default: 5)", _NUMBER
        ),
        "lattice": _Key(
            "Number of sites along each side of the map at which the cost is computed (default: 64)",
            _WHOLE_NUMBER,
        ),
        "metrics": _Key(
            "Whether the table contains the metrics of the record",
            _ValueSchema("true or false", _accept(bool)),
        ),
        "max_runs": _Key(
            "Maximum number of runs; larger studies are rejected (default: 100,000)", _WHOLE_NUMBER
        ),
        "team": _Key("Parameters of the robots", _TEAM),
        "conditions": _Key("Conditions under which the robots work", _CONDITIONS),
        "gains": _Key("Gains to try; all others have their defaults", _GAINS),
        "sampling": _Key("Sampling of all gains with a range", _SAMPLING),
    },
    required=("maps", "controllers"),
)
"""Schema of a study file. Missing keys have the defaults of `Study`."""


@dataclass
class _SchemaReader:
    """Converts the values of a document, and collects messages about its issues.

    Attributes
    ----------
    unknown_key_issues : list of str
        Messages about unknown keys. They come first, because a misspelled key also causes a missing one.
    other_issues : list of str
        All other messages.
    """

    unknown_key_issues: list[str] = field(default_factory=list)
    other_issues: list[str] = field(default_factory=list)

    @property
    def issues(self) -> list[str]:
        """All messages, the most helpful ones first."""
        return self.unknown_key_issues + self.other_issues

    def read(self, value: Any, schema: _ValueSchema | _TableSchema, path: JsonPath) -> Any:
        """Convert a value according to its schema. If it is invalid, add a message and return None."""
        table = schema if isinstance(schema, _TableSchema) else schema.table
        if table is not None and isinstance(value, dict):
            return self._read_table(value, table, path)
        if isinstance(schema, _ValueSchema):
            if schema.item is not None and isinstance(value, list):
                return [self.read(item, schema.item, (*path, k)) for k, item in enumerate(value)]
            if schema.convert is not None:
                try:
                    return schema.convert(value)
                except (ValueError, OverflowError):
                    pass
        self.other_issues.append(f"{format_path(path)}: expected {schema.expected}, got {quote(value)}")
        return None

    def _read_table(self, table: dict[str, Any], schema: _TableSchema, path: JsonPath) -> dict[str, Any]:
        """Convert the values of a table by key, and note unknown and missing keys."""
        keys = schema.keys
        if _ANY_KEY in keys:
            keys = dict.fromkeys(table, keys[_ANY_KEY])
        prefix = f"{format_path(path)}: " if path else ""
        for key in table:
            if key not in keys:
                self.unknown_key_issues.append(prefix + describe_unknown_name("key", key, keys))
        for key in schema.required:
            if key not in table:
                key_path = format_path((*path, key))
                self.other_issues.append(f"{key_path}: missing, expected {keys[key].schema.expected}")
        return {key: self.read(table[key], keys[key].schema, (*path, key)) for key in keys if key in table}


class KeyDescription(NamedTuple):
    """Description of a key of study files.

    Attributes
    ----------
    name : str
        Name of the key; keys of tables are dotted, such as ``team.radius``.
    meaning : str
        Meaning of the value, with its unit and its default; Markdown.
    expected : str
        Accepted values, and whether the key is required.
    """

    name: str
    meaning: str
    expected: str


def list_study_keys() -> list[KeyDescription]:
    """Describe all keys of study files, in the order of the handbook."""
    return list(_describe_keys(_STUDY, prefix=""))


def _describe_keys(table: _TableSchema, prefix: str) -> Iterator[KeyDescription]:
    """Describe the keys of a table and of the tables inside it."""
    for key, (meaning, schema) in table.keys.items():
        name = prefix + key.replace(_ANY_KEY, "NAME")
        expected = schema.expected
        if key in table.required:
            expected += ", required"
        yield KeyDescription(name, meaning, expected)
        if isinstance(schema, _TableSchema):
            yield from _describe_keys(schema, f"{name}.")


def read_study(path: Path | str) -> Study:
    """Read a study from a TOML file.

    Parameters
    ----------
    path : Path or str
        Path of the file.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        If the file cannot be read or is invalid. The message names the file, the key, and the expected and
        the actual value.
    """
    path = Path(path)
    source_name = to_one_line(path)
    return build_study(parse_toml(read_bytes(path), source_name), path.parent, source_name)


def build_study(document: dict[str, Any], folder: Path, source_name: str) -> Study:
    """Build a study from the content of a file.

    Parameters
    ----------
    document : dict
        Content of the file, as `parse_toml` returns it.
    folder : Path
        Folder to which relative paths refer.
    source_name : str
        Name of the file in messages.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        If the content is invalid.
    """
    reader = _SchemaReader()
    values = reader.read(document, _STUDY, ())
    if reader.issues:
        message = f"{source_name}: {reader.issues[0]}"
        other_count = len(reader.issues) - 1
        if other_count:
            message += f" (and {format_count(other_count, 'more issue')})"
        raise InputError(message)
    try:
        return Study(**_convert_to_arguments(values, folder), folder=folder)
    except InputError as error:
        raise InputError(f"{source_name}: {error}") from error


def _convert_to_arguments(values: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Convert the values of a study file to arguments of `Study`; the keys of the table "team" are merged."""
    arguments = dict(values)
    seeds = arguments.get("seeds")
    if isinstance(seeds, int):
        if seeds < 1:
            raise InputError(f"seeds: expected a whole number from 1, got {quote(seeds)}")
        arguments["seeds"] = range(seeds)
    for key in _LIST_KEYS:
        if key in arguments and not isinstance(arguments[key], list):
            arguments[key] = [arguments[key]]
    arguments["maps"] = _load_maps(arguments["maps"], folder)
    if "sampling" in arguments:
        arguments["sampling"] = Sampling(**arguments["sampling"])
    if "gains" in arguments:
        arguments["gains"] = {
            controller: _convert_ranges(gains) for controller, gains in arguments["gains"].items()
        }
    return {**arguments.pop("team", {}), **arguments}


def _convert_ranges(gains: dict[str, Any]) -> dict[str, Any]:
    """Convert the tables among the gains of a controller to ranges, and keep other values unchanged."""
    converted = {}
    for name, value in gains.items():
        converted[name] = Range(**value) if isinstance(value, dict) else value
    return converted


def _load_maps(entries: list[str], folder: Path) -> list[StudyMap]:
    """Load the maps of a study.

    Parameters
    ----------
    entries : list of str
        Names of bundled maps, and paths or patterns of map files relative to the folder; or `ALL_MAPS` alone.
    folder : Path
        Folder of the study file.

    Raises
    ------
    InputError
        If a map is unknown or cannot be read, or two maps have the same name.
    """
    bundled = list_bundled_maps()
    if entries == [ALL_MAPS]:
        entries = list(bundled)
    require_distinct(entries, ("maps",))
    maps: dict[str, StudyMap] = {}
    for k, entry in enumerate(entries):
        try:
            files = _find_map_files(entry, folder, bundled)
            found_maps = [StudyMap(name, load_map(path)) for name, path in files]
        except InputError as error:
            raise InputError(f"maps[{k}]: {error}") from error
        for found in found_maps:
            if found.name in maps:
                raise InputError(
                    f"maps[{k}]: expected maps with different names, got a second {quote(found.name)}"
                )
            maps[found.name] = found
    return list(maps.values())


def _find_map_files(entry: str, folder: Path, bundled: Mapping[str, Path]) -> list[tuple[str, Path]]:
    """Find the maps that an entry of a study names: a bundled map, a file, or all files that match a pattern.

    Parameters
    ----------
    entry : str
        Name of a bundled map, path of a map file, or pattern with "*" relative to the folder.
    folder : Path
        Folder of the study file.
    bundled : Mapping of str to Path
        Files of the bundled maps by name.

    Returns
    -------
    list of (str, Path)
        Name and file of each map.

    Raises
    ------
    InputError
        If there is no bundled map of this name, no file matches the pattern, the pattern is absolute, or it
        contains "**" next to other characters.
    """
    if entry in bundled:
        return [(entry, bundled[entry])]
    if not entry.endswith(".json"):
        raise InputError(describe_unknown_name("map", entry, bundled))
    path = folder / entry
    is_pattern = "*" in entry and not is_existing_file(path)
    if not is_pattern:
        return [(path.stem, path)]
    if Path(entry).is_absolute():
        raise InputError(f"expected a pattern relative to the study file, got {quote(entry)}")
    if any("**" in part and part != "**" for part in Path(entry).parts):
        raise InputError(f'expected "**" only in place of folders, such as "**/*.json", got {quote(entry)}')
    matches = sorted(folder.glob(entry))
    if not matches:
        raise InputError(f"expected a pattern that matches at least one file, got {quote(entry)}")
    return [(match.stem, match) for match in matches]
