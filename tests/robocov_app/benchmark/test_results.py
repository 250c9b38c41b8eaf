"""Reading results of the benchmark: whatever cannot be the result of a run is rejected."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from robocov.controllers import Adaptive, get_gain_values
from robocov.errors import InputError
from robocov.files.strictjson import MAX_BYTES
from robocov_app.benchmark.results import ENTRIES, RESULT_FILE, load_bundled_results, read_result

Change = Callable[[dict[str, Any]], object]


def change_first_row(**metrics: object) -> Change:
    """Return a function that changes metrics in the first row of a result."""
    return lambda result: result["rows"][0].update(metrics)


def change_part(name: str, **values: object) -> Change:
    """Return a function that changes values in a part of a result, such as its entry."""
    return lambda result: result[name].update(values)


def choose_row(track: str, **metrics: object) -> Change:
    """Return a function that replaces the rows by the first one of a track, and changes its metrics."""

    def change(result: dict[str, Any]) -> None:
        row = next(row for row in result["rows"] if row["track"] == track)
        result["rows"] = [row | metrics]

    return change


def repeat_first_row(result: dict[str, Any]) -> None:
    """Insert a copy of the first row below it."""
    result["rows"].insert(1, result["rows"][0])


def read_changed_entry(change: Change, path: Path) -> None:
    """Save the entry of RAPF after a change, and read it."""
    result = json.loads(gzip.decompress((ENTRIES / "rapf.json.gz").read_bytes()))
    change(result)
    path.write_text(json.dumps(result))
    read_result(path)


def test_an_unchanged_entry_is_read(tmp_path: Path) -> None:
    read_changed_entry(lambda result: None, tmp_path / "result.json")


def test_labels_in_all_scripts_need_only_one_visible_character(tmp_path: Path) -> None:
    for label in ("🤖", "制", "\u3164a", "Tiếng Việt", "שָׁלוֹם", "ที่นี่", "1\ufe0f\u20e3"):
        read_changed_entry(change_part("entry", label=label), tmp_path / "result.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (change_first_row(mean_distance_m=None), "rows[0]: mean_distance_m: expected a number, got None"),
        (change_first_row(uncovered_area_m2=None), "rows[0]: uncovered_area_m2: expected a number, got None"),
        (change_first_row(contacts=True), "rows[0]: contacts: expected a whole number, got True"),
        (change_first_row(contacts=-5), "rows[0]: contacts: expected at least 0, got -5"),
        (change_first_row(deciding_s=-1e300), "rows[0]: deciding_s: expected at least 0, got -1e+300"),
        (change_first_row(gap_to_bound=-0.2), "rows[0]: gap_to_bound: expected at least 0, got -0.2"),
        (repeat_first_row, "rows[1]: expected a run without an earlier row, got ideal on blocks-a, seed 0"),
        (
            change_part("entry", information="telepathy"),
            "entry: information: expected one of own, shared map, whole map, got 'telepathy'",
        ),
        (change_first_row(mean_distance_m=0.0), "rows[0]: mean_distance_m: expected more than 0, got 0.0"),
        (choose_row("plans-large", gap=-0.06), "rows[0]: gap: expected at least -0.05, got -0.06"),
        (
            change_first_row(mean_distance_over_run_m=0.5),
            "rows[0]: mean_distance_over_run_m: expected at least the lower bound",
        ),
        (change_first_row(settled_at_s=61.0), "rows[0]: settled_at_s: expected at most 60, got 61.0"),
        (change_first_row(near_final_s=61.0), "rows[0]: near_final_s: expected at most 60, got 61.0"),
        (change_first_row(seed=7), "rows[0]: 'ideal on blocks-a, seed 7' is not a run of the suite"),
        (
            change_first_row(map="tunnels-7001"),
            "rows[0]: 'ideal on tunnels-7001, seed 0' is not a run of the suite",
        ),
        # The entry contains this metric under its former name.
        (
            change_first_row(told_bytes=432001.0),
            "rows[0]: sent_bytes: expected at most 432000 for positions, got 432001.0",
        ),
        (
            choose_row("failures", told_bytes=287999.0),
            "rows[0]: sent_bytes: expected at least 288000 for positions, got 287999.0",
        ),
        (
            choose_row("lossy", told_bytes=14401.0),
            "rows[0]: sent_bytes: expected at most 14400 for positions, got 14401.0",
        ),
        (change_first_row(contacts=0.5), "rows[0]: contacts: expected a whole number, got 0.5"),
        (change_first_row(stuck_robots=0.5), "rows[0]: stuck_robots: expected a whole number or null, got"),
        (change_first_row(stuck_robots=7), "rows[0]: stuck_robots: expected at most 6, got 7"),
        (change_first_row(min_clearance_m=-0.2), "rows[0]: min_clearance_m: expected at least -0.1, got"),
        (
            choose_row("open-square", min_clearance_m=-1.1),
            "rows[0]: min_clearance_m: expected at least -1.0, got",
        ),
        (
            change_first_row(min_clearance_m=0.0005, contacts=0),
            "rows[0]: contacts: expected at least 1 for a clearance of 0.0005 m, got 0",
        ),
        (
            choose_row("one-robot", min_clearance_m=0.3, contacts=1),
            "rows[0]: contacts: expected 0 for one robot with a clearance of 0.3 m, got 1",
        ),
        (change_part("selection", tracks=[{}]), "selection: tracks: expected strings of at most"),
        (change_part("selection", maps=[["rooms"]]), "selection: maps: expected strings of at most"),
        (change_part("versions", numpy={"x": [1]}), "versions: numpy: expected a string, got {'x': [1]}"),
        (change_part("versions", python={"x": [1]}), "versions: expected strings of at most"),
        (change_part("versions", robocov="0.1.0"), "versions: robocov: expected a version such as 0.1.0"),
        (lambda result: result["versions"].pop("scipy"), "versions: scipy: missing, expected"),
        (
            change_part("entry", label="\u2800\u3164"),
            "entry: label: expected 1 to 60 characters, some of them visible",
        ),
        (
            change_part("entry", label="A" + 5 * "\u0301"),
            "entry: label: expected at most 3 combining marks in succession, got more",
        ),
        (
            change_part("entry", set={"pull": "a" + 4 * "\u0489"}),
            "entry: set: expected at most 3 combining marks in succession, got more",
        ),
        (
            change_part("entry", label="Mine\u2e3b"),
            "entry: label: expected no characters that cover others, got",
        ),
        (change_part("entry", label=" "), "entry: label: expected 1 to 60 characters, some of them visible"),
        (change_part("entry", label="W" * 61), "entry: label: expected 1 to 60 characters, some of them"),
        (change_first_row(work_J=1e30), "rows[0]: work_J: expected at most 1e+15, got 1e+30"),
        (change_part("entry", controller="x" * 201), "entry: controller: expected strings of at most 200"),
        (
            change_part("entry", gains={f"gain {k}": 1.0 for k in range(201)}),
            "entry: gains: expected at most 200 items, got 201",
        ),
        (change_part("entry", set={"pull": "x" * 201}), "entry: set: expected strings of at most 200"),
    ],
)
def test_impossible_results_are_rejected(change: Change, message: str, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    with pytest.raises(InputError) as caught:
        read_changed_entry(change, path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_a_compressed_file_is_read_only_up_to_the_maximum_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "result.json.gz"
    path.write_bytes(gzip.compress(bytes(4 * MAX_BYTES), compresslevel=1))
    # Decompressing everything at once would need the memory for everything.
    monkeypatch.setattr("gzip.decompress", lambda _: pytest.fail("decompressed without a limit"))
    with pytest.raises(InputError, match="expected at most 50 MB, got more"):
        read_result(path)


def test_former_names_in_results_are_updated(tmp_path: Path) -> None:
    content = gzip.decompress((ENTRIES / "adaptive.json.gz").read_bytes()).decode()
    path = tmp_path / "result.json"
    path.write_text(content.replace('"min_density"', '"least"').replace("sent_bytes", "told_bytes"))
    result = read_result(path)
    assert any(sentence.startswith("sent_bytes: ") for sentence in result["method"])
    assert result["entry"]["gains"] == get_gain_values(Adaptive())
    for row in result["rows"]:
        assert "error" in row or (row["sent_bytes"] > 0.0 and "told_bytes" not in row)


def test_no_file_contains_a_bundled_result(tmp_path: Path) -> None:
    result = json.loads(gzip.decompress((ENTRIES / "rapf.json.gz").read_bytes()))
    (tmp_path / RESULT_FILE).write_text(json.dumps({**result, "is_bundled": True}))
    assert read_result(tmp_path)["is_bundled"] is False
    assert all(result["is_bundled"] for result in load_bundled_results())
