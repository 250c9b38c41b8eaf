"""Reading results of the benchmark: whatever cannot be the result of a run is rejected."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from robocov.errors import InputError
from robocov_app.benchmark.results import ENTRIES, read_result

Change = Callable[[dict[str, Any]], object]


def change_first_row(**metrics: object) -> Change:
    """Return a function that changes metrics in the first row of a result."""
    return lambda result: result["rows"][0].update(metrics)


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (change_first_row(mean_distance_m=None), "rows[0]: mean_distance_m: expected a number, got None"),
        (change_first_row(uncovered_area_m2=None), "rows[0]: uncovered_area_m2: expected a number, got None"),
        (change_first_row(contacts=True), "rows[0]: contacts: expected a number, got True"),
        (change_first_row(contacts=-5), "rows[0]: contacts: expected at least 0, got -5"),
        (change_first_row(deciding_s=-1e300), "rows[0]: deciding_s: expected at least 0, got -1e+300"),
        (change_first_row(gap_to_bound=-0.2), "rows[0]: gap_to_bound: expected at least 0, got -0.2"),
        (repeat_first_row, "rows[1]: expected a run without an earlier row, got ideal on blocks-a, seed 0"),
        (
            lambda result: result["entry"].update(information="telepathy"),
            "entry: information: expected one of own, shared map, whole map, got 'telepathy'",
        ),
    ],
)
def test_impossible_results_are_rejected(change: Change, message: str, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    with pytest.raises(InputError) as caught:
        read_changed_entry(change, path)
    assert str(caught.value).startswith(f"{path}: {message}")
