"""Suspicious runs: teams that never move, and final costs far above those of RAPF."""

from __future__ import annotations

from typing import Any

from robocov_app.benchmark.page.anomalies import find_anomalies


def test_teams_that_never_move_or_end_far_above_rapf_are_found() -> None:
    def build_result(costs: list[float], path_length: float = 5.0) -> dict[str, Any]:
        rows = [
            {
                "track": "ideal",
                "map": f"map {k}",
                "seed": 0,
                "mean_distance_m": cost,
                "path_length_m": path_length,
            }
            for k, cost in enumerate(costs)
        ]
        return {"rows": [*rows, {"track": "ideal", "map": "failed", "seed": 0, "error": "it failed"}]}

    rapf = build_result([1.0, 1.0, 1.0])
    assert find_anomalies(rapf, rapf) == []
    (anomaly,) = find_anomalies(build_result([0.5, 0.5, 1.5]), rapf)
    assert anomaly == ("ideal", "map 2", 0, "cost more than 1.2 times that of RAPF")
    # A controller that is usually worse than RAPF is no surprise.
    assert find_anomalies(build_result([1.5, 1.5, 1.5]), rapf) == []
    at_rest = find_anomalies(build_result([0.9, 0.9, 0.9], path_length=0.01), rapf)
    assert {anomaly.reason for anomaly in at_rest} == {"at rest from the start"} and len(at_rest) == 3
