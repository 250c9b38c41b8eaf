"""Results of the benchmark for tests: small ones, and those that are part of robocov."""

from __future__ import annotations

from typing import Any

from robocov_app.benchmark.results import load_bundled_results

MAPS = ("blocks-a", "blocks-b")


def select_bundled_results(*controllers: str) -> list[dict[str, Any]]:
    """Return the bundled results of some controllers."""
    return [result for result in load_bundled_results() if result["entry"]["controller"] in controllers]


def build_result(label: str, gap: float, *, is_bundled: bool = False, **entry: Any) -> dict[str, Any]:
    """Build a result with the two runs of `short_ideal_track`."""
    rows = [
        {
            **dict.fromkeys(("stuck_robots", "contacts"), 0),
            "track": "ideal",
            "map": map_name,
            "seed": 0,
            "gap": gap,
            "gap_to_bound": None,
            "mean_distance_m": 2.0,
            "mean_distance_over_run_m": 3.0,
            "near_final_s": 9.0,
            "settled_at_s": 8.0,
            "path_length_m": 8.0 + gap,
            "work_J": 50.0,
            "sent_bytes": 4e5,
            "deciding_s": 0.1,
        }
        for map_name in MAPS
    ]
    default_entry = {
        "controller": "mine.py:Mine",
        "label": label,
        "information": "own",
        "gains": {},
        "set": {},
        "source_sha256": "1" * 64,
    }
    return {
        "entry": default_entry | entry,
        "rows": rows,
        "is_bundled": is_bundled,
        "versions": {"numpy": "2"},
    }


def build_bundled_rapf() -> dict[str, Any]:
    return build_result("RAPF", 0.3, is_bundled=True, controller="rapf", source_sha256=None)
