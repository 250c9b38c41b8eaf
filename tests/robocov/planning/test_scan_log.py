"""Logs of scans: the map depends on the scans alone, not on when they arrived."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import REGION
from property_examples import count_examples

from robocov.observation import Scans
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.raster import Raster
from robocov.planning.scan_log import (
    REPORTED_ROUNDS,
    Checkpoint,
    NumberedScan,
    ScanLog,
    _thin_out,
    number_scans,
)

RASTER = Raster(REGION, 0.1)
UNKNOWN_MAP = DiscoveredMap.build_unknown(RASTER)
ROBOT_COUNT = 3
RAYS = 24


def build_scans(seed: int, round_count: int, max_distance: float = 3.0) -> list[NumberedScan]:
    """Return random scans of all robots, in the order of rounds and robots."""
    rng = np.random.default_rng(seed)
    numbered_scans = []
    for number in range(round_count):
        positions = rng.uniform((1.0, 1.0), (7.0, 3.0), size=(ROBOT_COUNT, 2))
        distances = rng.uniform(0.1, max_distance, size=(ROBOT_COUNT, RAYS))
        scans = Scans(distances, rng.random(distances.shape) < 0.5)
        numbered_scans += number_scans(scans, positions, REGION, round_number=number, time=0.5 * number)
    return numbered_scans


def build_log(scans: list[NumberedScan], robot_radius: float | None = None) -> ScanLog:
    """Return a log with scans that have all arrived at the same time, and their map."""
    return ScanLog.build_empty(ROBOT_COUNT, UNKNOWN_MAP, robot_radius).add(scans).update_map()


def drop_randomly(scans: list[NumberedScan], seed: int, fraction: float) -> list[NumberedScan]:
    """Return the scans that are left after some have been lost."""
    is_lost = np.random.default_rng(seed).random(len(scans)) < fraction
    return [scan for scan, lost in zip(scans, is_lost, strict=True) if not lost]


@settings(max_examples=count_examples(20))
@given(
    seed=st.integers(0, 2**32),
    max_distance=st.sampled_from([0.4, 3.0]),
    group_size=st.integers(1, 9),
    radius=st.sampled_from([None, 0.1, 0.7]),
)
def test_the_map_does_not_depend_on_the_order_of_arrival(
    seed: int, max_distance: float, group_size: int, radius: float | None
) -> None:
    scans = build_scans(seed, 10, max_distance)
    expected = build_log(scans, radius).known_map
    # A loop over the scans is the definition.
    known_map = UNKNOWN_MAP
    step_m = REGION.diameter / 65535
    for scan in scans:
        known_map = known_map.add_scan(scan.position, scan.distances * step_m, scan.is_hit)
        if radius is not None:
            known_map = known_map.add_robots(scan.position[None], radius)
    np.testing.assert_array_equal(expected.state, known_map.state)

    arriving = [scans[i] for i in np.random.default_rng(seed).permutation(len(scans))]
    log = build_log([], radius)
    for first in range(0, len(arriving), group_size):
        log = log.add(arriving[first : first + group_size]).update_map()
    np.testing.assert_array_equal(log.known_map.state, expected.state)


def test_only_scans_near_a_late_one_are_added_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scans = build_scans(seed=0, round_count=10, max_distance=0.4)
    late_scan = scans[0]
    log = build_log([]).add(scans[1:16]).update_map().add(scans[16:]).update_map().add([late_scan])
    added_positions: list[np.ndarray] = []
    add_scans = DiscoveredMap.add_scans

    def add_scans_and_list(known_map: DiscoveredMap, positions: np.ndarray, *rest: Any) -> DiscoveredMap:
        added_positions.extend(positions)
        return add_scans(known_map, positions, *rest)

    monkeypatch.setattr(DiscoveredMap, "add_scans", add_scans_and_list)
    assert log.update_map().known_map is not log.known_map
    offsets = np.abs(np.array(added_positions) - late_scan.position)
    assert 2 <= len(offsets) < 20
    assert offsets.max() < 1.3


def test_scans_are_stored_with_the_precision_of_their_size() -> None:
    scan = build_scans(seed=0, round_count=1)[0]
    distances = np.random.default_rng(0).uniform(0.0, 20.0, size=(1, RAYS))
    scans = Scans(distances, distances > 0.0)
    stored = number_scans(scans, np.array([[1.0, 1.0]]), REGION, round_number=0, time=0.0)[0]
    step_m = REGION.diameter / 65535
    expected = np.minimum(distances[0], REGION.diameter)
    np.testing.assert_allclose(stored.distances * step_m, expected, atol=0.51 * step_m)
    assert scan.size == 32 + 2 * RAYS + 3
    assert not stored.distances.flags.writeable


def test_scans_that_are_known_change_nothing() -> None:
    scans = build_scans(seed=0, round_count=4)
    log = build_log(scans)
    assert log.add(scans[3:7]) is log
    assert log.update_map() is log


def test_a_map_whose_cells_stay_the_same_stays_the_same_object() -> None:
    """Plans on this map stay valid."""
    scans = build_scans(seed=0, round_count=2)
    log = build_log(scans)
    blind = Scans(np.zeros((ROBOT_COUNT, RAYS)), np.zeros((ROBOT_COUNT, RAYS), dtype=bool))
    positions = np.array([scan.position for scan in scans[:ROBOT_COUNT]])
    later = log.add(number_scans(blind, positions, REGION, round_number=2, time=1.0)).update_map()
    assert later is not log
    assert later.known_map is log.known_map


@given(seed=st.integers(0, 2**32), fraction=st.floats(0.0, 0.9))
def test_an_inventory_reports_which_scans_are_missing(seed: int, fraction: float) -> None:
    scans = build_scans(seed=0, round_count=8)
    complete = ScanLog.build_empty(ROBOT_COUNT, UNKNOWN_MAP).add(scans)
    remaining = drop_randomly(scans, seed, fraction)
    inventory = ScanLog.build_empty(ROBOT_COUNT, UNKNOWN_MAP).add(remaining).inventory
    is_missing = inventory.find_missing(complete.is_present)
    for scan in scans:
        is_remaining = scan in remaining
        assert inventory.contains(scan) == is_remaining
        assert is_missing[scan.round_number, scan.robot] == (not is_remaining)


def test_scans_long_after_the_first_missing_one_are_not_reported() -> None:
    scans = build_scans(seed=0, round_count=REPORTED_ROUNDS + 10)
    own_scans = [scan for scan in scans if scan.robot == 0]
    inventory = ScanLog.build_empty(ROBOT_COUNT, UNKNOWN_MAP).add(own_scans[1:2]).inventory
    is_missing = inventory.find_missing(np.ones((len(own_scans), ROBOT_COUNT), dtype=bool))
    reported_rounds = [0, *range(2, REPORTED_ROUNDS + 1)]
    assert np.flatnonzero(is_missing[:, 0]).tolist() == reported_rounds
    assert not inventory.contains(own_scans[-1])


def test_checkpoints_become_sparser_with_age() -> None:
    checkpoints = [Checkpoint(0, UNKNOWN_MAP)]
    for round_count in range(1, 400):
        checkpoints = list(_thin_out([*checkpoints, Checkpoint(round_count, UNKNOWN_MAP)]))
        counts = np.array([each.round_count for each in checkpoints])
        assert counts[0] == 0
        assert counts[-1] == round_count
        gaps = np.diff(counts)
        assert (gaps <= np.maximum(1, round_count - counts[1:])).all()
    assert len(checkpoints) < 20


@pytest.mark.parametrize("scan_count", [1, 3, 5])
def test_a_log_does_not_change_when_scans_are_added(scan_count: int) -> None:
    scans = build_scans(seed=1, round_count=3)
    log = build_log(scans[:scan_count])
    state = log.known_map.state.copy()
    is_present = log.is_present.copy()
    log.add(scans).update_map()
    np.testing.assert_array_equal(log.known_map.state, state)
    np.testing.assert_array_equal(log.is_present, is_present)
