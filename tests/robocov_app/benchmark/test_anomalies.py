"""Suspicious runs: teams that never move, and final costs far above those of RAPF."""

from __future__ import annotations

from typing import Any

from robocov_app.benchmark.page.anomalies import find_anomalies


def build_rows(costs: list[float], path_length: float = 5.0, track: str = "ideal") -> list[dict[str, Any]]:
    return [
        {
            "track": track,
            "map": f"map {k}",
            "seed": 0,
            "mean_distance_m": cost,
            "path_length_m": path_length,
        }
        for k, cost in enumerate(costs)
    ]


def build_result(costs: list[float], path_length: float = 5.0) -> dict[str, Any]:
    failed = {"track": "ideal", "map": "failed", "seed": 0, "error": "it failed"}
    return {"rows": [*build_rows(costs, path_length), failed]}


def test_teams_that_never_move_or_end_far_above_rapf_are_found() -> None:
    rapf = build_result([1.0, 1.0, 1.0])
    assert find_anomalies(rapf, rapf) == []
    (anomaly,) = find_anomalies(build_result([0.5, 0.5, 1.5]), rapf)
    assert anomaly == ("ideal", "map 2", 0, "cost more than 1.2 times that of RAPF")
    # A controller that is usually worse than RAPF is no surprise.
    assert find_anomalies(build_result([1.5, 1.5, 1.5]), rapf) == []
    at_rest = find_anomalies(build_result([0.9, 0.9, 0.9], path_length=0.01), rapf)
    assert {anomaly.reason for anomaly in at_rest} == {"at rest from the start"} and len(at_rest) == 3


def test_a_track_on_which_an_otherwise_far_better_controller_fails_is_found() -> None:
    rapf = {"rows": build_rows([1.0, 1.0, 1.0]) + build_rows([1.0, 1.0], track="lossy")}

    def find_tracks(ideal_cost: float) -> list[str]:
        rows = build_rows([ideal_cost] * 3) + build_rows([1.5, 1.1], track="lossy")
        return [anomaly.track for anomaly in find_anomalies({"rows": rows}, rapf)]

    assert find_tracks(0.8) == ["lossy"]
    assert find_tracks(0.95) == []
