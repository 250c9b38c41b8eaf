from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, Rapf, get_information, make_controller
from robocov.controllers.frontier_median import FrontierMedian
from robocov.controllers.greedy_submodular import GreedySubmodular
from robocov.controllers.shared_map import Circle, Situation, assign_goals, list_circles, update_maps
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Observations, Scans
from robocov.observation.neighbours import Neighbours
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.window import Window
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
ROOMS = Environment(
    "two rooms",
    SQUARE,
    (
        WallObstacle(((4.0, 0.0), (4.0, 5.0)), 0.2),
        WallObstacle(((4.0, 6.2), (4.0, 8.0)), 0.2),
        WallObstacle(((0.0, 4.0), (2.5, 4.0)), 0.2),
    ),
)
CORNER = [[0.8, 0.8], [1.3, 0.8], [0.8, 1.3], [1.3, 1.3]]
LAWS = ("frontier-median", "greedy-submodular", "voronoi-graph")
RASTER = Raster(ROOMS.region, 0.1)


def simulation(name: str, n: int = 4, **limits: float) -> Simulation:
    law = make_controller(name, {"nodes": 400.0})
    return Simulation(ROOMS, law, CORNER[:n], Team.homogeneous(n, **limits), dt=0.05)


def situation(state: np.ndarray, at: list[list[float]]) -> Situation:
    known = DiscoveredMap(RASTER, state.astype(np.uint8))
    window = Window.build_around(RASTER, np.array([1.0, 1.0]), np.inf, 400)
    ways = GridPlanner(known, window, 0.13)
    places = np.array(at)
    return Situation(places, np.full(places.shape, np.nan), None, known, ways, None, 3.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_the_team_covers_both_rooms_touches_nothing_and_rests(name: str) -> None:
    record = simulation(name).run(40.0)
    clearance = compute_clearances(record)
    assert count_contacts(record, clearance) == 0 and clearance.min() > 0.005
    cost = CoverageCost(ROOMS, lattice=32)
    rapf = Simulation(ROOMS, Rapf(), CORNER, dt=0.05).run(40.0)
    assert cost(record.positions[-1]).mean_distance < 0.9 * cost(rapf.positions[-1]).mean_distance
    assert (record.positions[-1, :, 0] > 4.1).sum() == 2
    assert np.abs(record.positions[-1] - record.positions[-40]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("limits", [{"communication_range": 2.0}, {"sensing_range": 1.0}])
def test_with_short_ranges_nothing_is_touched_and_all_come_to_rest(
    name: str, limits: dict[str, float]
) -> None:
    record = simulation(name, **limits).run(120.0)
    assert count_contacts(record, compute_clearances(record)) == 0
    assert np.abs(record.positions[-1] - record.positions[-40]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_copies_and_repeated_runs_go_on_identically(name: str) -> None:
    one, other = simulation(name), simulation(name)
    for _ in range(50):
        one.step()
        other.step()
    twin = one.copy()
    for each in (one, other, twin):
        for _ in range(50):
            each.step()
    assert one.positions.tobytes() == other.positions.tobytes() == twin.positions.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_who_fails_is_forgotten_and_its_place_taken(name: str) -> None:
    some = Simulation(
        ROOMS, make_controller(name, {"nodes": 400.0}), CORNER, dt=0.05,
        conditions=Conditions(failures=((4, 2.0),)),
    )  # fmt: skip
    some.run(30.0)
    assert some.memory.plans[0].group.robots.tolist() == [0, 1, 2]


def test_what_they_go_by() -> None:
    assert {get_information(CONTROLLERS[name]) for name in LAWS} == {"shared map"}
    with pytest.raises(ParameterError, match=r"voronoi-graph.nodes: expected a whole number from 16"):
        make_controller("voronoi-graph", {"nodes": 3})


def observed(
    neighbours: Neighbours, distances: np.ndarray, hit: bool
) -> tuple[Observations, Scans, list[Circle]]:
    n, at = len(distances), np.tile([2.02, 2.02], (len(distances), 1))
    scans, around = Scans(distances, np.full(distances.shape, hit)), list_circles(neighbours)
    return (
        Observations(at, np.zeros((n, 2)), neighbours, np.full((n, 2), np.nan), ROOMS.region),
        scans,
        around,
    )


def test_maps_go_to_those_who_hear() -> None:
    states = np.random.default_rng(0).choice([UNKNOWN, FREE, WALL], size=(4, *RASTER.shape)).astype(np.uint8)
    maps, blind = [DiscoveredMap(RASTER, state) for state in states], np.zeros((4, 8))
    first = states[(states != UNKNOWN).argmax(axis=0), *np.indices(RASTER.shape)]
    together = update_maps(maps, *observed(Neighbours(4), blind, False))
    assert np.array_equal(together[0].state, first) and len({id(known) for known in together}) == 1
    # each knows best what it has seen itself; else the first counts that has
    line = Neighbours.from_ranges(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [9.0, 0.0]]), np.full(4, 1.5))
    told = update_maps(maps, *observed(line, blind, False))
    assert np.array_equal(told[0].state, np.where(states[0] != UNKNOWN, states[0], states[1]))
    assert np.array_equal(told[1].state == UNKNOWN, (states[:3] == UNKNOWN).all(axis=0))
    assert told[3] is maps[3]


def test_what_one_has_mistaken_is_corrected_by_whoever_sees_it() -> None:
    """Robot 1 takes for free what robot 2 sees to be a wall; two pairs do not hear each other."""
    free, nothing = (DiscoveredMap(RASTER, np.full(RASTER.shape, each, np.uint8)) for each in (FREE, UNKNOWN))
    pairs = Neighbours.from_ranges(
        np.array([[0.0, 0.0], [1.0, 0.0], [8.0, 0.0], [9.0, 0.0]]), np.full(4, 1.5)
    )
    distances = np.array([[0.0], [1.0], [0.0], [0.0]])
    seen, scans, around = observed(pairs, distances, False)
    scans.hit[1] = True
    told = update_maps([free, nothing, free, nothing], seen, scans, around)
    assert told[0] is told[1] and told[2] is told[3] and told[0] is not told[2]
    assert told[0].is_blocked[20, 30] and not told[2].is_blocked[20, 30]
    assert (told[0].state >= WALL).sum() == 1


def test_the_sum_of_squared_ways_is_the_least() -> None:
    rng = np.random.default_rng(1)
    now = situation(np.full(RASTER.shape, FREE), rng.uniform(1, 7, (5, 2)).tolist())
    nodes = rng.choice(np.flatnonzero(now.planner.is_roomy), 5, replace=False)
    places = now.planner.nodes[nodes]
    away = np.array([now.planner.compute_distances_from(at[None])[nodes] for at in now.positions]) ** 2
    best = min(permutations(range(5)), key=lambda order: away[range(5), order].sum())
    assert np.array_equal(assign_goals(now, places), places[list(best)])


def test_robots_go_to_different_frontiers_and_to_none_on_a_whole_map() -> None:
    law = FrontierMedian()
    state = np.full(RASTER.shape, FREE)
    at = [[4.0, 3.0], [4.0, 5.0], [4.0, 4.0]]
    _, final, _ = law.compute_placement(situation(state, at))
    assert final
    # specks are no frontier
    state[20:60:5, 10:70:4] = UNKNOWN
    assert law.compute_placement(situation(state, at)).is_final
    state[:, :20] = state[:, 60:] = UNKNOWN
    goals, final, _ = law.compute_placement(situation(state, at))
    assert not final
    assert np.ptp(goals[:, 0]) > 3.0
    columns = np.sort(goals[:, 0])
    assert columns[0] == pytest.approx(2.05) and columns[-1] == pytest.approx(5.95)
    # behind a wall there is nothing to look for
    state[:, 20] = state[:, 59] = WALL
    assert law.compute_placement(situation(state, at)).is_final


def test_a_frontier_that_stays_is_left_alone() -> None:
    """Who stands where it was to go has looked; so has who does not get on."""
    law = FrontierMedian()
    simulated = simulation("frontier-median")
    for _ in range(5):
        simulated.step()
    plan = simulated.memory.plans[0]
    assert not plan.placement.is_final
    for at in (plan.placement.goals, plan.group.positions):
        now = Situation(at, plan.placement.goals, plan, plan.known_map, plan.planner, None, 3.0)
        looked = law.compute_placement(now).notes
        assert all((np.hypot(*(looked - place).T) < 1e-9).any() for place in plan.placement.goals)


def test_a_final_plan_is_made_again_for_another_density() -> None:
    """A plan that stays while nothing changes depends on the density, too."""
    controller = GreedySubmodular(nodes=100.0)
    density = Gaussians((Gaussian((7.0, 7.0), 50.0, 0.5),), floor=0.01)
    seen = Observations(
        np.array([[1.0, 1.0]]), np.zeros((1, 2)), Neighbours(1), np.full((1, 2), np.nan), ROOMS.region
    )
    known_map = DiscoveredMap(RASTER, np.full(RASTER.shape, FREE, dtype=np.uint8))
    memory = replace(controller.begin(ROOMS.region, Team.homogeneous(1)), maps=(known_map,))
    first = controller.decide(seen, memory).memory
    later = replace(seen, time=5.0)
    same = controller.decide(later, first).memory
    assert same.plans[0].placement is first.plans[0].placement
    other = controller.decide(replace(later, density=density), first).memory
    assert np.hypot(*(other.plans[0].placement.goals[0] - [7.0, 7.0])) < 1.0
