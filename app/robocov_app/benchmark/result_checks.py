"""Checks of results of the benchmark: whatever cannot be the result of runs is rejected.

All checks compare values of a result with each other and with the definition of its track. None needs a run
or a reference placement.
"""

import re
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias, get_args

from robocov.conditions.communication import POSITION_BYTES
from robocov.controllers.base import Information
from robocov.defaults import DEFAULT_DT_S
from robocov.errors import InputError, format_bound, quote
from robocov.metrics.clearance import MAX_CONTACT_GAP_M
from robocov_app.benchmark import suite
from robocov_app.sweep.worker import list_result_versions

Row: TypeAlias = dict[str, Any]
"""One run of a result: its track, map and seed, and its metrics or its error."""
METRICS = (
    "mean_distance_m",
    "mean_distance_over_run_m",
    "uncovered_area_m2",
    "near_final_s",
    "settled_at_s",
    "path_length_m",
    "work_J",
    "contacts",
    "min_clearance_m",
    "stuck_robots",
)
"""Metrics of a run that a row contains in addition to its effort and its gaps."""
MAX_LABEL_CHARS = 60
"""Maximum length of the label of an entry."""
MIN_GAP = -0.05
"""Minimum gap to a reference placement. The lower bounds of the suite prove that no gap is below -0.034. The
limit is also applied to references without a lower bound, for which nothing is proven."""
MAX_TEXT_CHARS = 200
"""Maximum length of the name of a controller, gain, package or file, and of the value of a gain as text."""
MAX_ITEMS = 200
"""Maximum number of gains, packages, or selected tracks or maps."""
RESULTS_VERSION_PATTERN = re.compile(r"\(results (\d+)\)")
"""Number of the results' version in that of robocov; see `robocov_app.sweep.worker.list_result_versions`."""
_MAX_METRIC = 1e15
"""Maximum of all metrics, which no run reaches."""
_ROUNDING = 1e-9
"""Fraction by which rounding errors may change a cost or a time."""
_BLANK_LETTERS = "\u115f\u1160\u2800\u3164\uffa0"
"""Letters and symbols that are displayed as empty space."""
_MAX_COMBINING_MARKS = 3
"""Maximum number of combining marks in succession. More of them would cover the lines above and below."""
_MARK_CATEGORIES = ("Mn", "Me")
"""Unicode categories of marks that are displayed above, below or around another character."""
_WIDE_CHARACTERS = re.compile("[\u2e3a\u2e3b\ua9c1-\ua9cd\ufdfa-\ufdfd\U00012000-\U0001254f]")
"""Dashes, ligatures and signs that are several times as wide as a letter, and would cover other text."""

_HEAD_TYPES = {"entry": dict, "selection": dict, "versions": dict, "rows": list, "method": list}
_ENTRY_TYPES = {
    "controller": str,
    "label": str,
    "information": str,
    "gains": dict,
    "set": dict,
    "source_sha256": str | None,
}
_SELECTION_TYPES = {"quick": bool, "tracks": list, "maps": list}
_RUN_TYPES = {"track": str, "map": str, "seed": int}
_FAILED_ROW_TYPES = {**_RUN_TYPES, "error": str}
_ROW_TYPES = {
    **_RUN_TYPES,
    **dict.fromkeys((*METRICS, "gap", "gap_to_bound"), int | float | None),
    **dict.fromkeys(
        ("mean_distance_m", "uncovered_area_m2", "path_length_m", "sent_bytes", "deciding_s"),
        int | float,
    ),
    "contacts": int,
    "stuck_robots": int | None,
}
_METRICS_THAT_MAY_BE_NEGATIVE = ("min_clearance_m", "gap", "gap_to_bound")
_TYPE_NAMES: Mapping[Any, str] = {
    dict: "an object",
    list: "a list",
    str: "a string",
    bool: "true or false",
    int: "a whole number",
    str | None: "a string or null",
    int | None: "a whole number or null",
    int | float: "a number",
    int | float | None: "a number or null",
}


def check_head(result: Mapping[str, Any], path: Path) -> None:
    """Raise InputError unless everything but the rows of a result has the expected types and values.

    Parameters
    ----------
    result : Mapping
        Content of a file with the format and the suite of a result.
    path : Path
        Its file, for the message.
    """
    _require_types(result, _HEAD_TYPES, path)
    _check_entry(result["entry"], f"{path}: entry")
    selection = result["selection"]
    _require_types(selection, _SELECTION_TYPES, f"{path}: selection")
    for name in ("tracks", "maps"):
        _check_texts(selection[name], f"{path}: selection: {name}")
    versions = result["versions"]
    _require_types(versions, dict.fromkeys(list_result_versions(), str), f"{path}: versions")
    _check_texts([*versions, *versions.values()], f"{path}: versions")
    if not RESULTS_VERSION_PATTERN.search(versions["robocov"]):
        raise InputError(
            f"{path}: versions: robocov: expected a version such as "
            f"{list_result_versions()['robocov']}, got {quote(versions['robocov'])}"
        )


def _check_entry(entry: Mapping[str, Any], location: str) -> None:
    """Raise InputError unless the description of a controller is complete and short enough for a page."""
    _require_types(entry, _ENTRY_TYPES, location)
    label = entry["label"]
    if _is_blank(label) or len(label) > MAX_LABEL_CHARS:
        raise InputError(
            f"{location}: label: expected 1 to {MAX_LABEL_CHARS} characters, some of them visible, "
            f"got {quote(label)}"
        )
    _require_readable(label, f"{location}: label")
    if entry["information"] not in get_args(Information):
        expected = ", ".join(get_args(Information))
        raise InputError(
            f"{location}: information: expected one of {expected}, got {quote(entry['information'])}"
        )
    _check_texts([entry["controller"]], f"{location}: controller")
    _check_texts([entry["source_sha256"] or ""], f"{location}: source_sha256")
    for name in ("gains", "set"):
        gains = entry[name]
        _check_texts(gains, f"{location}: {name}")
        _check_texts([str(value) for value in gains.values()], f"{location}: {name}")


def _is_blank(text: str) -> bool:
    """Return whether a text contains no visible character."""
    for character in text:
        is_letter_or_symbol = unicodedata.category(character)[0] in "LNPS"
        if is_letter_or_symbol and character not in _BLANK_LETTERS:
            return False
    return True


def _check_texts(texts: Iterable[Any], location: str) -> None:
    """Raise InputError unless a list has few items, and all of them are short strings."""
    items = list(texts)
    if len(items) > MAX_ITEMS:
        raise InputError(f"{location}: expected at most {MAX_ITEMS} items, got {len(items)}")
    for item in items:
        if not isinstance(item, str) or len(item) > MAX_TEXT_CHARS:
            raise InputError(
                f"{location}: expected strings of at most {MAX_TEXT_CHARS} characters, got {quote(item)}"
            )
        _require_readable(item, location)


def _require_readable(text: str, location: str) -> None:
    """Raise InputError if a text would cover other text on a page."""
    mark_count = 0
    for character in unicodedata.normalize("NFC", text):
        is_mark = unicodedata.category(character) in _MARK_CATEGORIES
        mark_count = mark_count + 1 if is_mark else 0
        if mark_count > _MAX_COMBINING_MARKS:
            raise InputError(
                f"{location}: expected at most {_MAX_COMBINING_MARKS} combining marks in succession, got more"
            )
    if _WIDE_CHARACTERS.search(text):
        raise InputError(f"{location}: expected no characters that cover others, got {quote(text)}")


def check_row(row: Any, location: str) -> None:
    """Raise InputError unless a row belongs to a run of the suite, and its metrics are possible.

    Parameters
    ----------
    row : object
        The row, which may be anything.
    location : str
        File and number of the row, for the message.
    """
    has_failed = isinstance(row, dict) and "error" in row
    _require_types(row, _FAILED_ROW_TYPES if has_failed else _ROW_TYPES, location)
    if not _is_run_of_suite(row):
        run = quote(f"{row['track']} on {row['map']}, seed {row['seed']}")
        raise InputError(f"{location}: {run} is not a run of the suite")
    if has_failed:
        return
    for name in sorted(_ROW_TYPES.keys() - _RUN_TYPES.keys()):
        minimum = 0.0
        if name in _METRICS_THAT_MAY_BE_NEGATIVE:
            minimum = -_MAX_METRIC
        _check_range(row, name, location, minimum=minimum)
    track = suite.TRACKS[row["track"]]
    for name in ("near_final_s", "settled_at_s"):
        _check_range(row, name, location, maximum=track.duration * (1.0 + _ROUNDING))
    _check_range(row, "stuck_robots", location, maximum=track.robots)
    _check_costs(row, location)
    _check_clearance(row, location)


def check_sent_bytes(row: Row, information: str, location: str) -> None:
    """Raise InputError if robots do not send their positions, or send messages that they must not send.

    Parameters
    ----------
    row : dict
        Row of a run, as checked by `check_row`.
    information : str
        Information that the controller declares. With "own", robots send nothing but their positions.
    location : str
        Place of the row, for the message.
    """
    if "error" in row:
        return
    track = suite.TRACKS[row["track"]]
    message_rate = track.changes.get("conditions", {}).get("message_rate", 1.0 / DEFAULT_DT_S)
    bytes_per_robot = POSITION_BYTES * message_rate * track.duration
    # Robots that fail may have sent nothing.
    min_bytes = track.survivors * bytes_per_robot
    if row["sent_bytes"] < min_bytes * (1.0 - _ROUNDING):
        raise InputError(
            f"{location}: sent_bytes: expected at least {format_bound(min_bytes)} for positions, "
            f"got {row['sent_bytes']}"
        )
    position_bytes = track.robots * bytes_per_robot
    if information == "own" and row["sent_bytes"] > position_bytes * (1.0 + _ROUNDING):
        raise InputError(
            f"{location}: sent_bytes: expected at most {format_bound(position_bytes)} for positions, "
            f"got {row['sent_bytes']}. A controller whose robots send messages must declare "
            'information = "shared map"'
        )


def _is_run_of_suite(row: Row) -> bool:
    """Return whether the track of a row has runs on its map and with its seed."""
    track = suite.TRACKS.get(row["track"])
    return track is not None and row["map"] in track.maps and row["seed"] in track.seeds


def _check_range(
    row: Row, name: str, location: str, *, minimum: float = 0.0, maximum: float = _MAX_METRIC
) -> None:
    """Raise InputError if a metric is outside a range."""
    value = row[name]
    if value is not None and value < minimum:
        raise InputError(f"{location}: {name}: expected at least {format_bound(minimum)}, got {quote(value)}")
    if value is not None and value > maximum:
        raise InputError(f"{location}: {name}: expected at most {format_bound(maximum)}, got {quote(value)}")


def _check_costs(row: Row, location: str) -> None:
    """Raise InputError if no placement of the robots can have the costs of a row."""
    cost = row["mean_distance_m"]
    if cost <= 0.0:
        raise InputError(f"{location}: mean_distance_m: expected more than 0, got {cost}")
    gap = row["gap"]
    if gap is not None and gap < MIN_GAP:
        raise InputError(
            f"{location}: gap: expected at least {MIN_GAP}, got {gap}. "
            "No placement is so much better than the reference"
        )
    gap_to_bound = row["gap_to_bound"]
    if gap_to_bound is None:
        return
    if gap_to_bound < -_ROUNDING:
        raise InputError(
            f"{location}: gap_to_bound: expected at least 0, got {gap_to_bound}. "
            "No placement has a lower cost than the lower bound"
        )
    mean_cost = row["mean_distance_over_run_m"]
    bound = cost / (1.0 + gap_to_bound)
    if mean_cost is not None and _is_bound_constant(row) and mean_cost < bound * (1.0 - _ROUNDING):
        raise InputError(
            f"{location}: mean_distance_over_run_m: expected at least the lower bound {bound}, "
            f"got {mean_cost}"
        )


def _is_bound_constant(row: Row) -> bool:
    """Return whether the lower bound at the end of a run is valid during the whole run."""
    track = suite.TRACKS[row["track"]]
    return not track.failures and row["map"] not in suite.OTHER_FAMILIES["moving"]


def _check_clearance(row: Row, location: str) -> None:
    """Raise InputError if the minimum clearance from walls contradicts the contacts of a row."""
    track = suite.TRACKS[row["track"]]
    clearance = row["min_clearance_m"]
    if clearance is None:
        return
    if clearance < -track.radius:
        raise InputError(
            f"{location}: min_clearance_m: expected at least {-track.radius}, got {clearance}. "
            "The distance of a robot's center from a wall cannot be negative"
        )
    has_contact = clearance <= MAX_CONTACT_GAP_M
    if has_contact and not row["contacts"]:
        raise InputError(f"{location}: contacts: expected at least 1 for a clearance of {clearance} m, got 0")
    # A single robot can only touch walls.
    is_alone = track.robots == 1
    if is_alone and row["contacts"] and not has_contact:
        raise InputError(
            f"{location}: contacts: expected 0 for one robot with a clearance of {clearance} m, "
            f"got {row['contacts']}"
        )


def _require_types(values: Any, types: Mapping[str, Any], location: object) -> None:
    """Raise InputError unless a JSON object has all keys in `types`, with values of these types."""
    for name, expected in types.items():
        if not isinstance(values, dict) or name not in values:
            raise InputError(f"{location}: {name}: missing, expected a complete result")
        # A bool is an int in Python.
        is_wrong_bool = isinstance(values[name], bool) and expected is not bool
        if is_wrong_bool or not isinstance(values[name], expected):
            type_name = _TYPE_NAMES[expected]
            raise InputError(f"{location}: {name}: expected {type_name}, got {quote(values[name])}")
