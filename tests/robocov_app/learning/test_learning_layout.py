"""Observations of learning robots: the layout of rows, and rejected layouts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import ParameterError
from robocov.observation import Observations, Scans
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team
from robocov.voronoi import partition
from robocov_app.learning import ObservationLayout

REGION = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]]))  # diameter: 10 m


def observe_at(
    positions: np.ndarray, communication_range: float = np.inf, seed: int = 0, rays: int = 0
) -> Observations:
    rng = np.random.default_rng(seed)
    n = len(positions)
    points = positions + rng.normal(scale=0.8, size=(n, 2))
    points[rng.random(n) < 0.4] = np.nan
    scans = Scans(rng.uniform(0.1, 3.0, (n, rays)), rng.random((n, rays)) < 0.5) if rays else None
    return Observations(
        positions,
        rng.uniform(-0.7, 0.7, size=(n, 2)),
        Neighbors.from_ranges(positions, np.full(n, communication_range)),
        points,
        REGION,
        scans=scans,
    )


def compute_row(
    layout: ObservationLayout, seen: Observations, robot: int, communication_range: float
) -> list[float]:
    """Compute one row of observations in plain Python, as a reference."""
    x, y = seen.positions[robot]
    row = [(x - 4.0) / 10.0, (y - 3.0) / 10.0, *seen.velocities[robot] / 0.8]
    point = seen.obstacle_points[robot]
    row += [0.0] * 3 if np.isnan(point[0]) else [(point[0] - x) / 2.0, (point[1] - y) / 2.0, 1.0]
    others = [k for k in range(len(seen.positions)) if k != robot]
    heard = [k for k in others if np.hypot(*(seen.positions[k] - [x, y])) <= communication_range]
    heard.sort(key=lambda k: (np.hypot(*(seen.positions[k] - [x, y])), k))
    for rank in range(layout.neighbors):
        if rank < len(heard):
            row += [*(seen.positions[heard[rank]] - [x, y]) / 10.0, 1.0]
        else:
            row += [0.0] * 3
    if layout.rays:
        distances = seen.scans.distances[robot]
        hit = seen.scans.is_hit[robot]
        row += [d / 2.0 if h else 1.0 for d, h in zip(distances, hit, strict=True)]
    if layout.centroid:
        row += [*(partition(seen.positions, REGION, seen.neighbors).centroids[robot] - [x, y]) / 10.0]
    return [min(max(value, -1.0), 1.0) for value in row]


@pytest.mark.parametrize("layout", [ObservationLayout(), ObservationLayout(0), ObservationLayout(2, 5, True)])
@pytest.mark.parametrize("communication_range", [np.inf, 2.5])
@pytest.mark.parametrize("n", [1, 3, 60])
def test_rows_contain_the_documented_values(
    layout: ObservationLayout, communication_range: float, n: int
) -> None:
    positions = np.random.default_rng(n).uniform((0, 0), (8, 6), size=(n, 2))
    seen = observe_at(positions, communication_range, n, layout.rays)
    team = Team.homogeneous(n, max_speed=0.8, sensing_range=2.0, communication_range=communication_range)
    rows = layout.build_rows(seen, team)
    assert rows.dtype == np.float32
    assert rows.shape == (n, layout.size)
    for robot in range(n):
        np.testing.assert_allclose(
            rows[robot], compute_row(layout, seen, robot, communication_range), atol=2e-6
        )


def test_blocks_cover_each_row() -> None:
    layout = ObservationLayout(3, 8, True)
    assert [*layout.blocks] == ["position", "velocity", "obstacle", "neighbor", "rays", "centroid"]
    covered = np.concatenate([np.arange(layout.size)[block] for block in layout.blocks.values()])
    assert covered.tolist() == list(range(layout.size))
    assert "rays" not in ObservationLayout().blocks
    assert "neighbor" not in ObservationLayout(0).blocks


@settings(max_examples=count_examples(30))
@given(seed=st.integers(0, 2**32), n=st.integers(2, 40), communication_range=st.floats(0.5, 5.0))
def test_a_row_depends_only_on_the_knowledge_of_its_robot(
    seed: int, n: int, communication_range: float
) -> None:
    """Changing anything outside robot i's ranges changes nothing in row i, not one bit."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform((0, 0), (8, 6), size=(n, 2))
    seen = observe_at(positions, communication_range, seed, rays=6)
    layout = ObservationLayout(3, 6, True)
    team = Team.homogeneous(n, communication_range=communication_range)
    i = int(rng.integers(n))
    before = layout.build_rows(seen, team)[i]
    heard = np.zeros(n, dtype=bool)
    heard[[*seen.neighbors.list_neighbors(i), i]] = True
    moved = positions.copy()
    for k in np.flatnonzero(~heard):
        position = rng.uniform((0, 0), (8, 6))
        if np.hypot(*(position - positions[i])) > communication_range:
            moved[k] = position
    other = observe_at(moved, communication_range, seed + 1, rays=6)
    for name in ("velocities", "obstacle_points"):
        getattr(other, name)[i] = getattr(seen, name)[i]
    other.scans.distances[i] = seen.scans.distances[i]
    other.scans.is_hit[i] = seen.scans.is_hit[i]
    assert layout.build_rows(other, team)[i].tobytes() == before.tobytes()


@settings(max_examples=count_examples(30))
@given(seed=st.integers(0, 2**32), n=st.integers(1, 20), sensing=st.sampled_from([0.0, 0.3, 3.0, np.inf]))
def test_rows_stay_within_their_bounds(seed: int, n: int, sensing: float) -> None:
    """Positions may be outside the region, and distances beyond the sensing range."""
    rng = np.random.default_rng(seed)
    seen = observe_at(rng.uniform((-5, -5), (13, 11), size=(n, 2)), np.inf, seed, rays=4)
    layout = ObservationLayout(2, 4, True)
    low, high = layout.bounds
    rows = layout.build_rows(seen, Team.homogeneous(n, max_speed=0.2, sensing_range=sensing))
    assert ((rows >= low) & (rows <= high)).all()


def test_rows_contain_the_positions_in_old_messages() -> None:
    positions = np.array([[1.0, 1.0], [2.0, 1.0]])
    linked = Neighbors.from_ranges(positions, np.full(2, 5.0))
    seen = Observations(
        positions,
        np.zeros((2, 2)),
        linked,
        np.full((2, 2), np.nan),
        REGION,
        reported_positions=np.array([[1.5, 1.0], [1.0, 3.0]]),
    )
    rows = ObservationLayout(1).build_rows(seen, Team.homogeneous(2))
    np.testing.assert_allclose(rows[:, 7:], [[0.05, 0.0, 1.0], [-0.1, 0.2, 1.0]], atol=1e-7)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"neighbors": -1}, r"observation.neighbors: expected a whole number from 0 to 1000, got -1"),
        ({"rays": 2.5}, r"observation.rays: expected a whole number"),
        ({"centroid": 1}, r"observation.centroid: expected true or false, got 1"),
    ],
)
def test_invalid_layouts_are_rejected(values: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        ObservationLayout(**values)


def test_a_scan_with_another_number_of_rays_is_rejected() -> None:
    seen = observe_at(np.array([[1.0, 1.0]]), rays=4)
    with pytest.raises(ParameterError, match=r"observation.rays: expected 6 rays in a scan, got 4"):
        ObservationLayout(rays=6).build_rows(seen, Team.homogeneous(1))
