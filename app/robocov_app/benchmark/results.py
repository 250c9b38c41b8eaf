"""Results of the benchmark: their rows, gaps and files."""

import gzip
import hashlib
import io
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robocov.controllers.registry import update_gain_names
from robocov.errors import InputError
from robocov.files.result_folder import require_result
from robocov.files.strictjson import MAX_BYTES, parse_json, read_bytes
from robocov_app.benchmark import suite
from robocov_app.benchmark.result_checks import (
    METRICS,
    RESULTS_VERSION_PATTERN,
    Row,
    check_head,
    check_row,
    check_sent_bytes,
)
from robocov_app.runs.cost import AREA_TOLERANCE_M2
from robocov_app.sweep.ledger import Entry
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome

RESULT_FILE = "result.json"
"""Name of the file of a result."""
ENTRIES = Path(__file__).parent / "entries"
"""Folder with the results of the built-in controllers, compressed with ``gzip -9 -n``."""
RESULT_FORMAT = {"format": "robocov-benchmark", "version": 1}
"""Entries of a result that identify its format."""
_FORMER_METRIC_NAMES = {"told_bytes": "sent_bytes"}
"""Names of metrics in rows of earlier versions, with those of today."""
_MAX_ERROR_CHARS = 1000
"""Maximum length of an error in a row. A verification receives at least as many characters of an error."""
_FIRST_VERSION_WITH_MESSAGES = 5
"""Version of the results from which on the built-in controllers share maps by messages."""


def find_reference(map_name: str, robots: int) -> Mapping[str, Any]:
    """Return the reference placement for a map of the suite.

    Parameters
    ----------
    map_name : str
        Name of the map.
    robots : int
        Number of robots.

    Returns
    -------
    Mapping
        The entry of the suite's file, with ``positions_m``, ``mean_distance_m`` and ``lower_bound_m``.

    Raises
    ------
    InputError
        If the file has no such reference.
    """
    references = suite.load_frozen_maps().get(map_name, {}).get("references", {})
    reference = references.get(str(robots))
    if reference is None:
        raise InputError(
            f"map {map_name}: no reference for a team of {robots}; "
            "`robocov benchmark references` computes the missing ones"
        )
    return dict(reference)


def build_row(track: str, task: Task, run: Entry | Outcome, effort: bytes) -> Row:
    """Build the row of a run in a result.

    Parameters
    ----------
    track : str
        Name of the track.
    task : Task
        The run.
    run : Entry or Outcome
        The metrics of the run, or its error.
    effort : bytes
        Content of the run's ``effort.json``.

    Returns
    -------
    dict
    """
    head: Row = {"track": track, "map": task.map, "seed": task.seed}
    if run.error is not None:
        return {**head, "error": run.error[:_MAX_ERROR_CHARS]}
    metrics = {name: run.metrics[name] for name in METRICS}
    row = {**head, **metrics, **json.loads(effort), **compute_gaps(track, task.map, metrics)}
    _update_row_names(row)
    return row


def compute_gaps(track: str, map_name: str, metrics: Mapping[str, Any]) -> dict[str, float | None]:
    """Compute the gaps of a run to the reference placement and to the certified lower bound.

    Parameters
    ----------
    track, map_name : str
        Track and map of the run.
    metrics : Mapping
        Metrics of the run.

    Returns
    -------
    dict
        ``gap`` is J / J_ref - 1, and ``gap_to_bound`` is J / J_bound - 1. Both are None if the team covered
        a different area from that of the reference. ``gap_to_bound`` is also None if no bound is known.
    """
    reference = find_reference(map_name, suite.TRACKS[track].survivors)
    if abs(metrics["uncovered_area_m2"] - reference["uncovered_area_m2"]) > AREA_TOLERANCE_M2:
        return {"gap": None, "gap_to_bound": None}
    cost = metrics["mean_distance_m"]
    bound = reference["lower_bound_m"]
    gap_to_bound = cost / bound - 1.0 if bound else None
    return {"gap": cost / reference["mean_distance_m"] - 1.0, "gap_to_bound": gap_to_bound}


def identify_suite() -> dict[str, str]:
    """Return the version of the suite, and the SHA-256 of its maps and reference costs.

    The lower bounds are not hashed, because costs and gaps do not depend on them.
    """
    costs = {}
    for name, entry in suite.load_frozen_maps().items():
        by_size = {size: reference["mean_distance_m"] for size, reference in entry["references"].items()}
        costs[name] = [entry["sha256"], by_size]
    digest = hashlib.sha256(json.dumps(costs, sort_keys=True).encode()).hexdigest()
    return {"version": suite.VERSION, "sha256": digest}


def describe_method() -> list[str]:
    """Return sentences that describe the method of the benchmark and its metrics."""
    return [
        f"Maps, starts, seeds and tracks are those of suite {suite.VERSION}, whose maps have hashes.",
        f"J is the mean geodesic distance to the nearest robot on {suite.LATTICE} x {suite.LATTICE} sites, "
        "weighted by the density of a map, with the present obstacles and working robots.",
        "The gap is J / J_ref - 1 at the end; J_ref is the lowest of 24 searches for the best placement with "
        "the whole map known, for the number of robots that work at the end. It is an upper bound of the "
        "optimum.",
        "near_final_s: the time from which J stays within 5% of its final value. settled_at_s: the time "
        "from which no robot moves 5 cm in any 4 s. path_length_m: mean over robots. work_J: integral of "
        "|F v|, all robots.",
        "sent_bytes: what all robots send, received or not: 20 bytes (number and position) a robot and "
        "control period, or at the message rate, and the messages of the controller, such as shared maps.",
        "deciding_s: processor time of the controller alone, all robots; it depends on the machine.",
    ]


def shares_maps_by_messages(result: Mapping[str, Any]) -> bool:
    """Return whether robots shared maps only by messages, or did not share maps.

    Parameters
    ----------
    result : Mapping
        As returned by `read_result`.

    Returns
    -------
    bool
        False for entries of built-in controllers with the information "shared map" that were made with a
        version in which these controllers did not send messages.
    """
    entry = result["entry"]
    if entry["information"] != "shared map" or entry["source_sha256"]:
        return True
    version = get_results_version(result["versions"])
    return version is None or version >= _FIRST_VERSION_WITH_MESSAGES


def get_results_version(versions: Mapping[str, str]) -> int | None:
    """Return the version of the results: a number that changes whenever the same runs give different results.

    Parameters
    ----------
    versions : Mapping
        Versions of packages, such as those of a result.

    Returns
    -------
    int or None
        None if the versions do not contain it.
    """
    version = RESULTS_VERSION_PATTERN.search(str(versions.get("robocov", "")))
    return None if version is None else int(version[1])


def read_result(path: Path) -> dict[str, Any]:
    """Read a result of the benchmark.

    Parameters
    ----------
    path : Path
        A result file, which may be compressed (``.gz``), or a folder that contains ``result.json``.

    Returns
    -------
    dict
        The result, whose keys and types have been checked. Whatever the file contains, ``is_bundled`` is
        False; see `load_bundled_results`.

    Raises
    ------
    InputError
        If the file is missing or damaged, is not a result of the benchmark, or belongs to another suite.
    """
    if not path.is_file():
        require_result(path, "the folder or the file of a result of the benchmark", (RESULT_FILE,))
        path = path / RESULT_FILE
    content = read_bytes(path)
    if path.suffix == ".gz":
        content = _decompress(content, path)
    result = parse_json(content, str(path))
    if not isinstance(result, dict) or {name: result.get(name) for name in RESULT_FORMAT} != RESULT_FORMAT:
        raise InputError(f"{path}: expected a result of robocov benchmark")
    if result.get("suite") != identify_suite():
        raise InputError(
            f"{path}: suite: expected the suite of {suite.SUITE_FILE.name}, got {result.get('suite')}"
        )
    check_head(result, path)
    result["is_bundled"] = False
    _update_gain_names(result["entry"])
    result["method"] = [_update_metric_names(str(sentence)) for sentence in result["method"]]
    runs = set()
    for k, row in enumerate(result["rows"]):
        location = f"{path}: rows[{k}]"
        _update_row_names(row)
        check_row(row, location)
        check_sent_bytes(row, result["entry"]["information"], location)
        run = (row["track"], row["map"], row["seed"])
        if run in runs:
            raise InputError(
                f"{location}: expected a run without an earlier row, "
                f"got {row['track']} on {row['map']}, seed {row['seed']}"
            )
        runs.add(run)
    return result


def _decompress(content: bytes, path: Path) -> bytes:
    """Decompress the content of a file, up to one byte more than a JSON file may have."""
    try:
        with gzip.open(io.BytesIO(content)) as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: cannot be unpacked: {error}") from None


def check_gaps(result: Mapping[str, Any], path: Path) -> None:
    """Raise InputError if the gaps of a result do not follow from its costs.

    Parameters
    ----------
    result : Mapping
        As returned by `read_result`.
    path : Path
        Its file, for the message.
    """
    for k, row in enumerate(result["rows"]):
        if "error" in row:
            continue
        for name, value in compute_gaps(row["track"], row["map"], row).items():
            if row[name] != value:
                raise InputError(
                    f"{path}: rows[{k}]: {name}: expected {value} from its cost, got {row[name]}"
                )


def _update_gain_names(entry: dict[str, Any]) -> None:
    """Replace, in place, the names of gains that were renamed since an entry was made."""
    for key in ("gains", "set"):
        entry[key] = update_gain_names(entry["controller"], entry[key])


def _update_metric_names(text: str) -> str:
    """Replace, in a text, the names of metrics that were renamed."""
    for former_name, name in _FORMER_METRIC_NAMES.items():
        text = text.replace(former_name, name)
    return text


def _update_row_names(row: Any) -> None:
    """Replace, in place, the names of metrics that were renamed since a row was made."""
    for former_name, name in _FORMER_METRIC_NAMES.items():
        if isinstance(row, dict) and former_name in row:
            row[name] = row.pop(former_name)


def load_bundled_results() -> list[dict[str, Any]]:
    """Return the results of the built-in controllers, which are part of robocov."""
    results = [read_result(path) for path in sorted(ENTRIES.glob("*.json.gz"))]
    for result in results:
        result["is_bundled"] = True
    return results
