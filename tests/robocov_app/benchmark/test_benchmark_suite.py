"""The frozen suite: maps match their file, tuning maps are separate, references have the stated cost."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from robocov.controllers.geodesic_lloyd import GeodesicPlanner
from robocov.cost import CoverageCost
from robocov.environment import DiscStart, Environment, WallObstacle
from robocov.errors import InputError, ParameterError
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.benchmark import suite
from robocov_app.benchmark.maps.large_plans import LARGE_PLANS
from robocov_app.benchmark.oracle import Oracle, assign_goals
from robocov_app.benchmark.references import list_references

SAMPLED_MAPS = (
    "rooms",
    "forklifts",
    "blocks-7001",
    "homes-7001",
    "traffic-7002",
    "dense-yards-7001",
    "wards-7001",
    "tunnels-7003",
    "worlds-7002",
)
WALLED = Environment(
    "walled",
    ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)),
    (WallObstacle(((2.0, 0.0), (2.0, 2.0)), 0.1),),
    {"left": DiscStart((0.8, 0.8), 0.6)},
)


def load_frozen_hashes(names: tuple[str, ...]) -> dict[str, str]:
    return {name: suite.load_frozen_maps()[name]["sha256"] for name in names}


def compute_hashes(names: tuple[str, ...]) -> dict[str, str]:
    return {name: suite.compute_map_hash(suite.build_map(name)) for name in names}


def test_sampled_maps_equal_the_frozen_maps() -> None:
    assert compute_hashes(SAMPLED_MAPS) == load_frozen_hashes(SAMPLED_MAPS)


@pytest.mark.slow
def test_all_maps_equal_the_frozen_maps() -> None:
    names = tuple(suite.FAMILY_OF)
    assert compute_hashes(names) == load_frozen_hashes(names)
    assert set(suite.load_frozen_maps()) == set(names)


def test_a_changed_map_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    changed = replace(suite.build_map("rooms"), name="rooms, a little different")
    monkeypatch.setattr(suite, "build_map", lambda name: changed)
    with pytest.raises(InputError, match="map rooms: expected the map of suite v1"):
        suite.load_suite_map("rooms")


def test_the_name_of_a_ranking_selects_all_of_its_tracks() -> None:
    tracks = ["plans-one-robot", "plans-small", "plans-medium", "plans-large", "plans-crowd"]
    expected = suite.select_maps(tracks, [], quick=False)
    assert suite.select_maps(["plans", "plans-large"], [], quick=False) == expected
    with pytest.raises(ParameterError, match="unknown track 'plan'"):
        suite.select_maps(["plan"], [], quick=False)


def test_the_suite_is_complete_and_tuning_maps_are_separate() -> None:
    assert len(suite.FAMILIES) >= 6
    assert len(suite.TRACKS["ideal"].maps) >= 60
    tuning = set(suite.TRACKS["tuning"].maps)
    assert all(tuning.isdisjoint(suite.TRACKS[name].maps) for name in suite.TRACKS if name != "tuning")
    families = {**suite.FAMILIES, **suite.OTHER_FAMILIES}
    assert sum(map(len, families.values())) == len(suite.FAMILY_OF), "each map is in one family"
    for setting in list_references():
        references = suite.load_frozen_maps()[setting.map_name]["references"]
        assert len(references[str(setting.robots)]["positions_m"]) == setting.robots


def test_robots_have_the_same_size_on_all_tracks_of_a_map() -> None:
    """Otherwise, a reference placement for this map and team size would not be that of both tracks."""
    radii: dict[str, set[float]] = {}
    for track in suite.TRACKS.values():
        for name in track.maps:
            radii.setdefault(name, set()).add(track.radius)
    assert all(len(sizes) == 1 for sizes in radii.values())


def test_references_have_the_stated_cost() -> None:
    settings = {(setting.map_name, setting.robots): setting for setting in list_references()}
    assert settings["worlds-7001", 32].radius == 1.0
    for name, robots in (("rooms-7001", 4), ("dense-yards-7001", 6), ("worlds-7001", 32)):
        reference = suite.load_frozen_maps()[name]["references"][str(robots)]
        radius = settings[name, robots].radius
        cost = CoverageCost(suite.load_suite_map(name), suite.LATTICE, radius=radius)
        result = cost(np.array(reference["positions_m"]))
        assert result.mean_distance == pytest.approx(reference["mean_distance_m"], rel=1e-12)


def test_unknown_tracks_and_maps_are_rejected() -> None:
    with pytest.raises(ParameterError, match="--track: unknown track 'ideel': did you mean 'ideal'"):
        suite.select_maps(["ideel"], [], quick=False)
    with pytest.raises(
        ParameterError, match="--maps: unknown map of the benchmark 'room': did you mean 'rooms'"
    ):
        suite.select_maps([], ["room"], quick=False)
    with pytest.raises(ParameterError, match="--maps: expected a map of ideal, got forklifts"):
        suite.select_maps(["ideal"], ["forklifts"], quick=False)


def test_tracks_on_large_plans_have_each_plan_once() -> None:
    """The two tracks with the smallest teams have the same plans."""
    tracks = {name: track for name, track in suite.TRACKS.items() if name.startswith("plans-")}
    for track in tracks.values():
        assert [suite.FAMILY_OF[name] for name in track.maps] == list(LARGE_PLANS)
    assert tracks.pop("plans-one-robot").maps == tracks["plans-small"].maps
    names = [name for track in tracks.values() for name in track.maps]
    assert sorted(names) == sorted(name for kind in LARGE_PLANS for name in suite.OTHER_FAMILIES[kind])


def test_quick_has_one_map_of_each_family() -> None:
    for maps in suite.select_maps([], [], quick=True).values():
        assert [suite.FAMILY_OF[name] for name in maps] == list(suite.FAMILIES)


def test_the_oracle_assigns_goals_as_brute_force_does() -> None:
    planner = GeodesicPlanner(WALLED, 0.13, 8, radius=0.1)
    rng = np.random.default_rng(0)
    for _ in range(5):
        points = rng.uniform((0.2, 0.2), (3.8, 2.8), (2, 4, 2))
        positions, goals = np.clip(points, 0.2, (1.8, 2.8))
        distances = planner.paths.compute_distances(positions, goals)
        assignment = assign_goals(planner, positions, goals)
        costs = {order: (distances[range(4), order] ** 2).sum() for order in permutations(range(4))}
        assert assignment.tolist() == list(min(costs, key=costs.__getitem__))


def test_the_oracle_moves_around_walls_and_reassigns_goals_after_a_failure() -> None:
    goals = [[3.2, 0.6], [1.0, 2.4]]
    stages = [[0.0, [0, 1], goals], [9.0, [1], [[0.5, 0.5]]]]
    environment = replace(WALLED, extra={"oracle": stages})
    starts = WALLED.start("left").sample(2, seed=1)
    record = Simulation(environment, Oracle(), starts, Team.homogeneous(2)).run(18.0)
    middle = record.positions[int(8.9 * 60)]
    assert min(np.abs(middle - goals).max(), np.abs(middle[::-1] - goals).max()) < 0.05
    assert np.abs(record.positions[-1] - [goals[1], (0.5, 0.5)]).max() < 0.05
    with pytest.raises(ParameterError, match="expected a map with the best placement"):
        Simulation(WALLED, Oracle(), starts, Team.homogeneous(2))
