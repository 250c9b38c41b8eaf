"""Properties of all controllers, for example that robots use only their own information."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

import robocov as rc
from robocov.controllers import (
    CONTROLLERS,
    Adaptive,
    Boosting,
    Controller,
    IndividualControllerAdapter,
    Lloyd,
    OwnView,
    Rapf,
    Rpf,
    inform_controller,
)
from robocov.controllers.gains import gain
from robocov.environment import Environment
from robocov.observation import Decision, Observations, Scans
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team

REGION = Region(np.array([[0.0, 0.0], [11.0, -1.0], [12.0, 8.0], [3.0, 10.0]]))


@dataclass(frozen=True)
class Homing:
    """An individual controller that uses everything that a robot knows."""

    stiffness: float = gain(0.5, "N/m", "pull to the centroid")

    def force(self, own: OwnView) -> np.ndarray:
        pull = self.stiffness * (own.centroid - own.position) - 0.1 * own.velocity
        away = sum(
            ((own.position - other) / (1 + np.hypot(*(own.position - other))) for other in own.neighbors),
            0.0,
        )
        wall = 0.0 if own.obstacle_point is None else own.position - own.obstacle_point
        return pull + 0.1 * away + 0.1 * wall + 0.01 * own.cell.mean(axis=0)


class ViewKeeping:
    """An individual controller that keeps the last view of each robot."""

    def __init__(self) -> None:
        self.views: dict[int, OwnView] = {}

    def force(self, own: OwnView) -> np.ndarray:
        self.views[own.number] = own
        return own.centroid - own.position


ROOM = Environment("room", tuple((x, y) for x, y in REGION.vertices.tolist()))
SHARING = ("frontier-median", "greedy-submodular", "voronoi-graph")
COARSE = {
    "geodesic-lloyd": {"lattice": 8.0},
    "diffeomorphism": {"lattice": 8.0},
    "local-search": {"nodes": 100.0},
    "exemplar": {"nodes": 100.0},
    "adaptive": {"basis": 3.0},
    **{name: {"nodes": 100.0, "period": 0.4} for name in SHARING},
}
MAX_ROBOTS = {"atlas": 12, "atlas-shared": 12, **dict.fromkeys(SHARING, 3)}
"""Teams of controllers that plan are small here, because these are slow."""
ALL_CONTROLLERS = [
    *(inform_controller(kind(**COARSE.get(name, {})), ROOM) for name, kind in CONTROLLERS.items()),
    Adaptive(estimate="gp"),
    *(Boosting(boost=boost) for boost in ("p", "neighbors")),
    *(Rapf(target=target, height=0.5) for target in ("sensing", "median")),
    Lloyd(target="median"),
    *(Rapf(cells="time", target=target) for target in ("centroid", "median")),
    Lloyd(cells="time"),
    IndividualControllerAdapter(Homing()),
]
PARAMETERS = [
    pytest.param(
        controller, id=controller.name, marks=[pytest.mark.slow] if controller.name in MAX_ROBOTS else []
    )
    for controller in ALL_CONTROLLERS
]


def sample_scans(controller: Controller, n: int, rng: np.random.Generator) -> Scans | None:
    """Return random scans of n robots, if the controller requests scans."""
    scanning = getattr(controller, "scanning", None)
    if scanning is None:
        return None
    distances = rng.uniform(0.3, 4.0, size=(n, scanning.rays))
    return Scans(np.minimum(distances, 3.0), distances < 3.0)


def sample_observations(positions: np.ndarray, reach: float, seed: int) -> Observations:
    """Return random observations of robots with a communication range."""
    rng = np.random.default_rng(seed)
    n = len(positions)
    obstacle_points = positions + rng.normal(scale=0.8, size=(n, 2))
    obstacle_points[rng.random(n) < 0.4] = np.nan
    ranges = np.full(n, reach)
    neighbors = Neighbors.from_ranges(positions, ranges)
    seen = Observations(positions, rng.normal(size=(n, 2)), neighbors, obstacle_points, REGION, 3.0)
    return replace(seen, max_speeds=rng.choice([0.4, 0.7, 1.0], n))


def extract_row(decision: Decision, i: int) -> list[np.ndarray]:
    """Return everything that a decision contains for robot i."""
    arrays = [decision.forces, *(decision.terms[name] for name in sorted(decision.terms))]
    if decision.goals is not None:
        arrays.append(decision.goals)
    return [array[i].copy() for array in arrays]


@pytest.mark.parametrize("controller", PARAMETERS)
@settings(max_examples=count_examples(20))
@given(seed=st.integers(0, 2**32), n=st.integers(2, 60), reach=st.floats(0.5, 6.0))
def test_a_robot_uses_only_what_it_knows(controller: Controller, seed: int, n: int, reach: float) -> None:
    """Row i of a decision stays the same, bit for bit, if anything that robot i does not know is changed."""
    rng = np.random.default_rng(seed)
    n = min(n, MAX_ROBOTS.get(controller.name, n))
    positions = rng.uniform((3, 1), (10, 7), size=(n, 2))
    team = Team.homogeneous(n, communication_range=reach)
    i = int(rng.integers(n))
    memory = controller.begin(REGION, team)
    changed_memory = controller.begin(REGION, team)
    # After the first step, a robot could use forbidden information only through its memory.
    for step in range(3):
        seen = sample_observations(positions, reach, seed + step)
        seen = replace(seen, time=step * 0.2, scans=sample_scans(controller, n, rng))
        changed = change_others(seen, i, reach, rng)
        decision = controller.decide(seen, memory)
        changed_decision = controller.decide(changed, changed_memory)
        for expected, actual in zip(extract_row(decision, i), extract_row(changed_decision, i), strict=True):
            assert expected.tobytes() == actual.tobytes()
        memory = decision.memory
        changed_memory = changed_decision.memory
        positions = positions + rng.uniform(-0.05, 0.05, size=(n, 2))


def change_others(seen: Observations, i: int, reach: float, rng: np.random.Generator) -> Observations:
    """Return observations in which everything is changed that robot i does not know."""
    n = len(seen.positions)
    positions = seen.positions
    is_neighbor = np.arange(n) == i
    is_neighbor[seen.neighbors.list_neighbors(i)] = True
    moved = positions.copy()
    strangers = np.flatnonzero(~is_neighbor)
    for k in strangers:
        position = rng.uniform((0, -1), (12, 10))
        if REGION.contains(position) and np.hypot(*(position - positions[i])) > reach:
            moved[k] = position
    is_other = np.arange(n)[:, None] != i
    neighbors = Neighbors.from_ranges(moved, np.full(n, reach))
    assert np.array_equal(neighbors.list_neighbors(i), seen.neighbors.list_neighbors(i))
    changed = replace(
        seen,
        positions=moved,
        velocities=np.where(is_other, rng.normal(size=(n, 2)), seen.velocities),
        neighbors=neighbors,
        obstacle_points=np.where(is_other, moved + rng.normal(size=(n, 2)), seen.obstacle_points),
    )
    max_speeds = np.array(seen.max_speeds)
    max_speeds[strangers] = rng.choice([0.3, 0.7, 2.0], len(strangers))
    changed = replace(changed, max_speeds=max_speeds)
    if seen.scans is None:
        return changed
    distances = rng.uniform(0.3, 3.0, seen.scans.distances.shape)
    distances = np.where(is_other, distances, seen.scans.distances)
    return replace(changed, scans=Scans(distances, seen.scans.is_hit ^ is_other))


@pytest.mark.parametrize("controller", PARAMETERS)
def test_the_information_test_can_fail(controller: Controller) -> None:
    """The information of a robot changes its decision, so the previous test is not trivial."""
    positions = np.array([[4.0, 4.0], [5.0, 4.5], [8.0, 6.0]])
    team = Team.homogeneous(3)
    seen = sample_observations(positions, np.inf, 1)
    # Some decisions depend only on a direction, or on the nearest node of a lattice.
    steps = {
        "dispersion": [0.5, 0.7],
        "geodesic-lloyd": [1.2, 0.6],
        "local-search": [-1.8, -1.0],
        "exemplar": [-1.8, -1.0],
        "atlas": [-2.5, -3.0],
        "atlas-shared": [-0.9, -0.4],
        **{name: [-0.85, -0.45] for name in SHARING},
    }
    step = steps.get(controller.name, [0.6, 0.3])
    moved = sample_observations(positions + [[0, 0], step, [0, 0]], np.inf, 1)
    force = controller.decide(seen, controller.begin(REGION, team)).forces[0]
    changed_force = controller.decide(moved, controller.begin(REGION, team)).forces[0]
    assert not np.array_equal(force, changed_force)


@pytest.mark.parametrize("kind", [Rapf, Lloyd])
def test_cells_by_time_are_those_by_distance_for_equal_speeds(kind: type[Rapf] | type[Lloyd]) -> None:
    positions = np.random.default_rng(3).uniform(3, 7, size=(9, 2))
    team = Team.homogeneous(9)
    seen = sample_observations(positions, 4.0, 3)

    def decide(controller: Controller, max_speeds: np.ndarray | None) -> np.ndarray:
        known = replace(seen, max_speeds=max_speeds)
        return controller.decide(known, controller.begin(REGION, team)).forces

    for speeds in (None, np.full(9, 0.7)):
        assert decide(kind(cells="time"), speeds).tobytes() == decide(kind(), speeds).tobytes()
    assert not np.array_equal(decide(kind(cells="time"), seen.max_speeds), decide(kind(), seen.max_speeds))


@pytest.mark.parametrize("kind", [Rapf, Rpf], ids=["rapf", "rpf"])
def test_forces_are_the_sum_of_their_terms(kind: type[Rapf] | type[Rpf]) -> None:
    seen = sample_observations(np.random.default_rng(0).uniform(3, 7, size=(9, 2)), np.inf, 0)
    decision = kind().decide(seen, None)
    np.testing.assert_allclose(decision.forces, sum(decision.terms.values()), rtol=1e-12)


def test_rapf_without_attraction_is_rpf() -> None:
    seen = sample_observations(np.random.default_rng(0).uniform(3, 7, size=(9, 2)), np.inf, 0)
    rapf = Rapf(k_rep=0.7, rho_0=3.0, k_att=0.0).decide(seen, None).forces
    np.testing.assert_array_equal(rapf, Rpf(k_rep=0.7, rho_0=3.0).decide(seen, None).forces)


def test_repulsion_equals_a_plain_double_loop() -> None:
    positions = np.random.default_rng(5).uniform(2, 8, size=(25, 2))
    seen = sample_observations(positions, np.inf, 5)
    forces = Rpf(k_rep=0.4, rho_0=2.5).decide(seen, None).forces
    for i in range(25):
        sources = [positions[j] for j in range(25) if j != i]
        if np.isfinite(seen.obstacle_points[i]).all():
            sources.append(seen.obstacle_points[i])
        expected = np.zeros(2)
        for source in sources:
            rho = np.hypot(*(positions[i] - source))
            if rho <= 2.5:
                expected += 0.4 * (1 / rho - 1 / 2.5) * (positions[i] - source) / rho**3
        np.testing.assert_allclose(forces[i], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("controller", PARAMETERS)
@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_coincident_robots_get_finite_forces(controller: Controller, n: int) -> None:
    positions = np.tile([5.0, 4.0], (n, 1))
    seen = Observations(
        positions,
        np.zeros((n, 2)),
        Neighbors.from_ranges(positions, np.full(n, np.inf)),
        positions.copy(),
        REGION,
    )
    decision = controller.decide(seen, controller.begin(REGION, Team.homogeneous(n)))
    assert np.isfinite(decision.forces).all()


def test_two_robots_at_the_same_position_are_pushed_apart() -> None:
    positions = np.tile([5.0, 4.0], (2, 1))
    seen = Observations(positions, np.zeros((2, 2)), Neighbors(2), np.full((2, 2), np.nan), REGION)
    forces = Rpf().decide(seen, None).forces
    np.testing.assert_allclose(forces[0], -forces[1])
    assert np.hypot(*forces[0]) > 1.0


def test_lloyd_drives_within_its_limits() -> None:
    """At the desired velocity, far from the goal, the force only compensates viscosity."""
    positions = np.array([[2.0, 2.0]])
    goal = REGION.centroid
    heading = (goal - positions[0]) / np.hypot(*(goal - positions[0]))
    seen = Observations(positions, heading[None] * 1.0, Neighbors(1), np.full((1, 2), np.nan), REGION)
    controller = Lloyd()
    force = controller.decide(seen, controller.begin(REGION, Team.homogeneous(1))).forces
    np.testing.assert_allclose(force, 2.0 * heading[None], rtol=1e-9)


def test_the_view_of_a_robot_prints_nothing_about_the_cells_of_others() -> None:
    controller = ViewKeeping()
    rc.run(ROOM, controller, robots=2, duration=0.1)
    text = repr(controller.views[1])
    assert text.startswith("OwnView(number=1, position=")
    assert "cells" not in text
