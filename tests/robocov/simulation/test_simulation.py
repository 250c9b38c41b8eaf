"""Simulations of one run: copies, changes, records, and faults of controllers."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS as ALL_CONTROLLERS
from robocov.controllers import Controller, Howard, Lloyd, OwnView, Rapf, Rpf, make_controller
from robocov.cost import CoverageCost
from robocov.density import Uniform
from robocov.environment import CircleObstacle, Environment, ObstaclePath, PolygonObstacle
from robocov.errors import ParameterError, StartError
from robocov.mapfile import load_map
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Decision, Observations
from robocov.record import ARRAYS, Record
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

CONTROLLERS = [Rapf(), Rapf(k_rep=1.0, k_att=3.0, attraction_limit=None), Rpf(), Lloyd()]


def compute_digest(record: Record) -> str:
    digest = hashlib.sha256()
    for name in ARRAYS:
        digest.update(np.ascontiguousarray(getattr(record, name)).tobytes())
    return digest.hexdigest()


def compute_digests(names: Sequence[str]) -> list[str]:
    """Return digests of runs of some controllers, of the paper's under conditions, and of unicycles."""
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=3)
    conditions = Conditions(loss=0.2, delay=0.1, position_noise=0.02, failure_rate=0.01)
    unicycles = Team.homogeneous(6, kinematics="unicycle")
    dt = 1 / 20
    simulations = [Simulation(rooms, make_controller(name), starts, dt=dt) for name in names]
    simulations += [
        Simulation(rooms, controller, starts, dt=dt, conditions=conditions) for controller in CONTROLLERS
    ]
    simulations.append(Simulation(rooms, Rapf(), starts, unicycles, dt))
    return [compute_digest(simulation.run(2.0)) for simulation in simulations]


@pytest.mark.parametrize(
    ("names", "environment"),
    [
        (
            list(ALL_CONTROLLERS),
            {
                "PYTHONHASHSEED": "1",
                "OPENBLAS_CORETYPE": "Prescott",
                "NPY_DISABLE_CPU_FEATURES": "AVX512_SKX AVX2",
            },
        ),
        # Kernels are compiled again for this processor, which takes long for those of all controllers.
        (["rapf", "rpf", "lloyd"], {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}),
    ],
    ids=["libraries", "instructions"],
)
@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_runs_are_the_same_in_another_process_on_any_x86_processor(
    names: list[str], environment: dict[str, str]
) -> None:
    script = (
        "import sys; sys.path[:0] = sys.argv[1:3]\n"
        "from test_simulation import compute_digests\n"
        "print(*compute_digests(sys.argv[3:]))\n"
    )
    folder = Path(__file__).parent
    command = [sys.executable, "-W", "ignore", "-c", script, str(folder), str(folder.parent), *names]
    process = subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, check=True
    )
    digests = compute_digests(names)
    assert process.stdout.split() == digests
    assert len(set(digests)) == len(digests)


@pytest.mark.parametrize("controller", CONTROLLERS, ids=["rapf", "paper", "rpf", "lloyd"])
@settings(max_examples=count_examples(5))
@given(branch=st.integers(0, 400), seed=st.integers(0, 100))
def test_copies_continue_identically(
    cluttered: Environment, controller: Controller, branch: int, seed: int
) -> None:
    simulation = Simulation(cluttered, controller, cluttered.start().sample(6, seed=seed))
    for _ in range(branch):
        simulation.step()
    copy = simulation.copy()
    assert copy.time == simulation.time
    for _ in range(200):
        simulation.step()
    assert not np.array_equal(copy.positions, simulation.positions)
    for _ in range(200):
        copy.step()
    np.testing.assert_array_equal(copy.positions, simulation.positions)
    np.testing.assert_array_equal(copy.velocities, simulation.velocities)


def transform(environment: Environment, matrix: np.ndarray) -> Environment:
    def transform_ring(ring: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        return tuple(tuple(point) for point in (np.array(ring) @ matrix.T).tolist())

    return Environment(
        environment.name,
        transform_ring(environment.boundary),
        tuple(PolygonObstacle(transform_ring(shape.vertices)) for shape in environment.obstacles),  # type: ignore[union-attr]
    )


@pytest.mark.parametrize("controller", [Rapf(), Rpf(), Lloyd()], ids=["rapf", "rpf", "lloyd"])
@pytest.mark.parametrize(
    "matrix",
    [np.diag([-1.0, 1.0]), np.array([[0.0, -1.0], [1.0, 0.0]]), np.array([[0.6, -0.8], [0.8, 0.6]])],
    ids=["mirror", "quarter turn", "rotation"],
)
def test_runs_rotate_and_mirror_with_the_map(controller: Controller, matrix: np.ndarray) -> None:
    room = Environment(
        "room",
        ((0.0, 0.0), (9.0, 0.0), (10.0, 7.0), (1.0, 8.0)),
        (
            PolygonObstacle(((3.0, 3.0), (5.0, 3.0), (5.0, 3.5), (3.5, 3.5), (3.5, 5.0), (3.0, 5.0))),
            PolygonObstacle(((6.5, 4.0), (7.5, 4.2), (7.0, 5.5))),
        ),
    )
    starts = np.array([[1.0, 1.0], [1.6, 0.8], [1.2, 1.9], [2.2, 1.4], [0.8, 2.6]])
    original = Simulation(room, controller, starts).run(6.0)
    transformed = Simulation(transform(room, matrix), controller, starts @ matrix.T).run(6.0)
    # Rounding errors differ, and repulsion amplifies them.
    np.testing.assert_allclose(transformed.positions, original.positions @ matrix.T, atol=1e-5)
    assert np.abs(original.positions[-1] - starts).max() > 0.5


def test_rapf_beats_rpf_among_obstacles_without_contacts() -> None:
    """A run as in the paper's figures 4 to 7."""
    rooms = load_map("rooms")
    cost = CoverageCost(rooms, lattice=32)
    starts = rooms.start().sample(6, seed=0)
    rapf = Simulation(rooms, Rapf(), starts, dt=1 / 30).run(40.0)
    rpf = Simulation(rooms, Rpf(), starts, dt=1 / 30).run(40.0)
    assert cost(rapf.positions[-1]).mean_distance < 0.95 * cost(rpf.positions[-1]).mean_distance
    assert count_contacts(rapf, compute_clearances(rapf)) == 0


def test_two_hundred_robots_spread_over_a_large_map() -> None:
    campus = load_map("campus")
    record = Simulation(campus, Rapf(), campus.start().sample(200, seed=0)).run(15.0)
    assert compute_clearances(record).min() > -2e-3
    displacements = np.hypot(*(record.positions[-1] - record.positions[0]).T)
    assert np.median(displacements) > 0.5
    assert np.isfinite(record.positions).all()


def test_records_respect_times_and_limits(cluttered: Environment) -> None:
    record = Simulation(cluttered, Rapf(), cluttered.start().sample(6), dt=0.02).run(5.0)
    assert len(record) == 251
    np.testing.assert_allclose(record.time, np.arange(251) * 0.02)
    assert np.hypot(*record.velocities.reshape(-1, 2).T).max() <= 1 + 1e-9
    displacements = np.hypot(*np.diff(record.positions, axis=0).reshape(-1, 2).T)
    assert displacements.max() <= 0.02 * (1 + 1e-6)


class FixedForces:
    """A controller that returns given forces without checking them."""

    name = "fixed-forces"
    label = "Fixed forces"
    summary = ""

    def __init__(self, forces: np.ndarray) -> None:
        self.forces = forces

    def begin(self, region: object, team: object) -> None:
        return None

    def decide(self, seen: Observations, memory: object) -> Decision:
        return Decision(self.forces)


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        (np.zeros((3, 2)), r"returned forces of shape \(3, 2\) at .*, expected \(2, 2\)"),
        ("east", r"returned forces 'east' at 0.000 s .*, expected numbers of shape"),
        (None, r"returned forces None at .*, expected numbers of shape"),
        (
            np.full((2, 2), 1.0 + 2.0j),
            r"returned forces .*1.*2.*j.* at 0.000 s .*, expected numbers of shape",
        ),
        (np.array([[0.0, 0.0], [np.nan, 1.0]]), r"returned the force \[nan, 1.0\] for robot 2 at 0.000 s"),
    ],
)
def test_invalid_forces_of_a_controller_are_rejected(
    empty: Environment, forces: np.ndarray, message: str
) -> None:
    simulation = Simulation(empty, FixedForces(forces), [[2.0, 2.0], [4.0, 4.0]])
    with pytest.raises(ParameterError, match=message):
        simulation.step()


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([[3.0, 2.0]], r"starts\[0\] = \[3, 2\] is inside an obstacle"),
        ([[1.0, 1.0], [2.0, 8.0]], r"starts\[1\] = \[2, 8\] is inside an obstacle or outside the boundary"),
        ([[385123.25, 1.0]], r"starts\[0\] = \[385123.25, 1\] is inside an obstacle or outside"),
        ([[1.0, 0.05]], r"starts\[0\] = \[1, 0.05\] is 0.05 m from a wall"),
        ([[1.0, 1.0], [1.1, 1.0]], r"starts\[0\] and starts\[1\] are 0.1 m apart"),
        ([[np.nan, 1.0]], r"starts\[0\]"),
        ([1.0, 2.0], r"starts: expected an array of shape \(n, 2\) with n >= 1, got shape \(2,\)"),
    ],
)
def test_impossible_starts_are_rejected(
    cluttered: Environment, starts: list[list[float]], message: str
) -> None:
    with pytest.raises(StartError, match=message):
        Simulation(cluttered, Rapf(), starts)


@pytest.mark.parametrize("dt", [0.0, -1.0, 2.0, float("nan"), float("inf")])
def test_impossible_control_periods_are_rejected(empty: Environment, dt: float) -> None:
    with pytest.raises(ParameterError, match="dt: "):
        Simulation(empty, Rapf(), [[1.0, 1.0]], dt=dt)


def test_invalid_controllers_and_decisions_are_rejected(empty: Environment) -> None:
    class ReturnsArray(FixedForces):
        def decide(self, seen: Observations, memory: object) -> Decision:
            return self.forces  # type: ignore[return-value]

    class ReturnsTooFewGoals(FixedForces):
        def decide(self, seen: Observations, memory: object) -> Decision:
            return Decision(self.forces, goals=np.zeros((1, 2)))

    class FailsAtStart(FixedForces):
        def begin(self, region: object, team: object) -> None:
            raise KeyError("start")

    starts = [[2.0, 2.0], [4.0, 4.0]]
    with pytest.raises(
        ParameterError, match=r"decide\(observations, memory\) returned .*, expected a Decision"
    ):
        Simulation(empty, ReturnsArray(np.zeros((2, 2))), starts).step()
    with pytest.raises(ParameterError, match=r"goals of shape \(1, 2\) at .*, expected \(2, 2\)"):
        Simulation(empty, ReturnsTooFewGoals(np.zeros((2, 2))), starts).step()
    with pytest.raises(
        ParameterError, match=r"'fixed-forces': KeyError: 'start' \(test_simulation.py, line \d+\)"
    ):
        Simulation(empty, FailsAtStart(np.zeros((2, 2))), starts)
    for controller in (Rapf, "rapf"):
        with pytest.raises(ParameterError, match=r"expected a controller, as in Rapf\(\), with a method"):
            Simulation(empty, controller, starts)  # type: ignore[arg-type]
    simulation = Simulation(empty, FixedForces([[0, 0], [0, 0]]), starts)  # type: ignore[arg-type]
    simulation.step()
    for duration in (float("nan"), float("inf"), -1.0):
        with pytest.raises(ParameterError, match="duration"):
            simulation.run(duration)


def test_copies_have_a_memory_of_their_own(empty: Environment) -> None:
    class ChangesItsMemory(FixedForces):
        def begin(self, region: object, team: object) -> list[int]:  # type: ignore[override]
            return [0]

        def decide(self, seen: Observations, memory: list[int]) -> Decision:  # type: ignore[override]
            memory[0] += 1
            return Decision(np.full((1, 2), 0.1 * memory[0]), memory=memory)

    simulation = Simulation(empty, ChangesItsMemory(np.zeros((1, 2))), [[2.0, 2.0]])
    for _ in range(3):
        simulation.step()
    assert (simulation.observe_and_decide().decision.memory, simulation.memory) == ([4], [3])
    assert simulation.with_changes(controller=ChangesItsMemory(np.zeros((1, 2)))).memory == [0]
    changed = simulation.with_changes(velocities=np.zeros((1, 2)))
    copy = simulation.copy()
    for other in (changed, copy):
        assert other.memory == [3]
        assert other.memory is not simulation.memory
    for _ in range(5):
        simulation.step()
    for _ in range(5):
        copy.step()
    np.testing.assert_array_equal(copy.positions, simulation.positions)


@pytest.mark.parametrize("name", ["lloyd", "tangentbug", "boosting", "gp-ucb", "greedy-submodular"])
def test_controllers_know_new_properties_of_robots(empty: Environment, name: str) -> None:
    simulation = Simulation(empty, make_controller(name), [[2.0, 2.0]])
    simulation.run(0.5)
    team = Team.homogeneous(1, radius=0.2, viscosity=6.0, max_speed=0.3)
    changed = simulation.with_changes(team=team)
    changed.step()
    assert changed.memory.team is team


class OwnCounter:
    """Counts its steps in a list that it changes in place, and has no method ``begin``."""

    def force(self, own: OwnView) -> list[float]:
        if own.memory is None:
            own.memory = [0]
        own.memory[0] += 1
        return [0.1 * own.memory[0], 0.0]


def test_copies_are_independent_of_memory_assigned_by_a_controller_for_one_robot(empty: Environment) -> None:
    simulation = Simulation(empty, OwnCounter(), [[2.0, 2.0]])
    simulation.step()
    simulation.observe_and_decide()
    copy = simulation.copy()
    for _ in range(4):
        simulation.step()
        copy.step()
    assert simulation.memory.by_robot == copy.memory.by_robot == [[5]]
    assert copy.positions.tobytes() == simulation.positions.tobytes()


def test_memory_assigned_by_a_controller_for_one_robot_reaches_its_next_step(empty: Environment) -> None:
    class Numbering:
        def force(self, own: OwnView) -> list[float]:
            own.memory = (own.memory or 0) + own.number + 1
            return [0.0, 0.0]

    simulation = Simulation(empty, Numbering(), [[2.0, 2.0], [4.0, 4.0]])
    for _ in range(3):
        simulation.step()
    assert simulation.memory.by_robot == [3, 6]


class MassController(FixedForces):
    """Is informed of the map, and returns forces as large as the mass of its free space."""

    information = "whole map"

    def __init__(self, mass: float = 0.0) -> None:
        super().__init__(np.full((1, 2), mass))

    def inform(self, environment: Environment) -> MassController:
        return MassController(float(environment.free_masses.sum()))


def test_a_new_density_reaches_a_controller_that_knows_the_map(empty: Environment) -> None:
    simulation = Simulation(empty, MassController(), [[2.0, 2.0]])
    copy = simulation.with_density(empty.with_density(Uniform(3.0)))
    before = simulation.observe_and_decide().decision.forces
    after = copy.observe_and_decide().decision.forces
    np.testing.assert_allclose(after, 3.0 * before)
    assert simulation.environment is empty


def test_changes_keep_the_number_of_steps(empty: Environment) -> None:
    """Times are multiples of the control period, and scans are taken in the same steps."""
    simulation = Simulation(empty, Howard(), [[2.0, 2.0], [3.0, 3.0]], dt=0.03)
    copy = simulation.copy()
    for _ in range(40):
        simulation.step()
        copy.step()
        copy = copy.with_changes()
        assert copy.time == simulation.time
        assert (copy.observe().scans is None) == (simulation.observe().scans is None)


def test_a_state_has_two_finite_numbers_for_each_robot() -> None:
    positions = np.array([[2.0, 2.0], [3.0, 3.0]])
    with pytest.raises(StartError, match=r"velocities: expected finite \[x, y\] for each robot"):
        TeamState(positions, velocities=np.zeros((1, 2)))
    with pytest.raises(StartError, match=r"steering: expected finite \[heading, turning rate\]"):
        TeamState(positions, steering=np.full((2, 2), np.inf))
    with pytest.raises(StartError, match=r"starts\[1\]: expected finite numbers, got \[3.0, nan\]"):
        TeamState(np.array([[2.0, 2.0], [3.0, np.nan]]))
    assert len(TeamState(positions)) == 2


def test_robots_that_are_too_fast_to_be_simulated_are_rejected(empty: Environment) -> None:
    positions = np.array([[2.0, 2.0], [3.0, 3.0]])
    state = TeamState(positions, velocities=np.array([[0.0, 0.0], [0.0, -1e30]]))
    message = r"velocities\[1\]: expected numbers from -10000 to 10000 m/s, got \[0.0, -1e\+30\]"
    with pytest.raises(StartError, match=message):
        Simulation(empty, Rapf(), state)


@pytest.mark.parametrize("steps", [-1, 1.5, "3", None])
def test_the_number_of_steps_before_a_state_is_a_whole_number(steps: object) -> None:
    with pytest.raises(ParameterError, match="steps: expected a whole number of at least 0, got"):
        TeamState(np.array([[2.0, 2.0]]), steps=steps)  # type: ignore[arg-type]


def test_team_and_starts_must_agree(empty: Environment) -> None:
    with pytest.raises(ParameterError, match="team: expected 1 robot, one for each start, got 3"):
        Simulation(empty, Rapf(), [[1.0, 1.0]], Team.homogeneous(3))


def test_runs_follow_the_equations_of_motion() -> None:
    """Runs converge to a plain implementation of (23) to (28), integrated by SciPy."""
    from scipy.integrate import solve_ivp

    side = 6.0
    k_rep = 0.3
    rho_0 = 2.0
    k_att = 0.5
    nu = 2.0
    square = shapely.box(0, 0, side, side)
    starts = np.array([[1.0, 1.2], [1.8, 1.0], [1.5, 2.1]])

    def build_half_plane(position: np.ndarray, other: np.ndarray) -> shapely.Polygon:
        """Return the points closer to a position than to another one, as a large rectangle."""
        middle = (position + other) / 2
        direction = (other - position) / np.hypot(*(other - position))
        left = middle + 99 * np.array([-direction[1], direction[0]])
        right = middle - 99 * np.array([-direction[1], direction[0]])
        return shapely.Polygon([left, right, right - 99 * direction, left - 99 * direction])

    def compute_force(positions: np.ndarray, i: int) -> np.ndarray:
        position = positions[i]
        x, y = position
        wall_points = [(x, 0.0), (x, side), (0.0, y), (side, y)]
        sources = [min(wall_points, key=lambda point: np.hypot(*(position - point)))]
        cell = square
        for other in np.delete(positions, i, axis=0):
            sources.append(other)
            cell = cell.intersection(build_half_plane(position, other))
        repulsion = np.zeros(2)
        for source in sources:
            offset = position - np.asarray(source)
            rho = np.hypot(*offset)
            if rho < rho_0:
                repulsion += k_rep * (1 / rho - 1 / rho_0) * offset / rho**3
        goal_offset = np.array(cell.centroid.coords[0]) - position
        return repulsion + k_att * goal_offset * np.hypot(*goal_offset) ** 2

    def compute_derivative(time: float, state: np.ndarray) -> np.ndarray:
        positions, velocities = state.reshape(2, 3, 2)
        forces = np.array([compute_force(positions, i) for i in range(3)])
        return np.concatenate([velocities.ravel(), (forces - nu * velocities).ravel()])

    initial_state = np.concatenate([starts.ravel(), np.zeros(6)])
    solution = solve_ivp(compute_derivative, (0, 3), initial_state, rtol=1e-6, atol=1e-8)
    expected = solution.y[:6, -1].reshape(3, 2)
    room = Environment("room", ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side)))
    team = Team.homogeneous(3, max_speed=100.0, max_acceleration=1e4, viscosity=nu, sensing_range=5.0)
    controller = Rapf(k_rep=k_rep, rho_0=rho_0, k_att=k_att, attraction_limit=None)
    errors = []
    for dt in (1 / 60, 1 / 240):
        record = Simulation(room, controller, starts, team, dt).run(3.0)
        errors.append(np.abs(record.positions[-1] - expected).max())
    assert errors[1] < 0.005
    assert errors[1] < 0.4 * errors[0]


def test_a_controller_cannot_change_the_world(cluttered: Environment) -> None:
    seen = Simulation(cluttered, Lloyd(), cluttered.start().sample(4)).observe()
    for array in (seen.positions, seen.velocities, seen.obstacle_points, seen.region.vertices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    simulation = Simulation(cluttered, Lloyd(), cluttered.start().sample(4))
    # Lloyd's robots also touch walls in this run.
    for _ in range(300):
        simulation.step()
        assert not simulation.positions.flags.writeable
        assert not simulation.velocities.flags.writeable


class TestChanges:
    ROOM = load_map("rooms")

    def build_moving(self) -> Simulation:
        simulation = Simulation(self.ROOM, Rapf(), self.ROOM.start().sample(6, seed=1))
        for _ in range(90):
            simulation.step()
        return simulation

    def test_without_changes_a_simulation_continues_identically(self) -> None:
        original = self.build_moving()
        changed = original.with_changes()
        copy = original.copy()
        assert changed.time == original.time == pytest.approx(1.5)
        for _ in range(120):
            changed.step()
            copy.step()
        np.testing.assert_array_equal(changed.positions, copy.positions)
        np.testing.assert_array_equal(changed.velocities, copy.velocities)
        assert changed.time == copy.time
        assert original.time == pytest.approx(1.5)

    def test_another_controller_continues_from_the_same_state(self) -> None:
        original = self.build_moving()
        changed = original.with_changes(controller=Rpf())
        assert changed.controller == Rpf()
        np.testing.assert_array_equal(changed.positions, original.positions)
        np.testing.assert_array_equal(changed.velocities, original.velocities)
        assert changed.observe_and_decide().seen.time == original.time

    def test_obstacles_and_robots_can_be_removed(self) -> None:
        original = self.build_moving()
        emptier = Environment("emptier", self.ROOM.boundary, self.ROOM.obstacles[1:], self.ROOM.starts)
        changed = original.with_changes(environment=emptier)
        assert changed.environment is emptier
        smaller = changed.with_changes(
            team=Team.homogeneous(4), positions=changed.positions[:4], velocities=changed.velocities[:4]
        )
        smaller.step()
        assert smaller.positions.shape == (4, 2)

    @pytest.mark.parametrize("controller", [Lloyd(), Rpf(k_rep=50.0, rho_0=9.0)], ids=["lloyd", "rpf"])
    def test_robots_in_contact_are_accepted(self, controller: Controller) -> None:
        simulation = Simulation(self.ROOM, controller, self.ROOM.start().sample(10, seed=1))
        for step in range(600):
            simulation.step()
            if step % 20 == 0:
                simulation.with_changes()

    def test_errors_name_robots_inside_a_new_obstacle(self) -> None:
        simulation = self.build_moving()
        x, y = simulation.positions[2].tolist()
        block = PolygonObstacle(
            ((x - 0.3, y - 0.3), (x + 0.3, y - 0.3), (x + 0.3, y + 0.3), (x - 0.3, y + 0.3))
        )
        blocked = Environment("blocked", self.ROOM.boundary, (*self.ROOM.obstacles, block))
        with pytest.raises(StartError, match=r"starts\[2\] = .* is inside an obstacle"):
            simulation.with_changes(environment=blocked)

    def test_arrays_of_wrong_size_or_content_are_rejected(self) -> None:
        simulation = self.build_moving()
        with pytest.raises(ParameterError, match="team: expected 6 robots, one for each start, got 3"):
            simulation.with_changes(team=Team.homogeneous(3))
        with pytest.raises(StartError, match=r"velocities: expected finite \[x, y\] for each robot"):
            simulation.with_changes(velocities=np.full((6, 2), np.nan))
        message = r"external_forces: expected an array of shape \(6, 2\), got shape \(2, 2\)"
        with pytest.raises(ParameterError, match=message):
            simulation.step(np.zeros((2, 2)))
        with pytest.raises(ParameterError, match=r"external_forces: .* finite forces in newtons"):
            simulation.step(np.full((6, 2), np.inf))

    def test_external_forces_move_only_their_robot(self) -> None:
        pushed = self.build_moving()
        undisturbed = pushed.copy()
        external_forces = np.zeros((6, 2))
        external_forces[0, 1] = 5.0
        pushed.step(external_forces)
        undisturbed.step()
        np.testing.assert_array_equal(pushed.positions[1:], undisturbed.positions[1:])
        assert pushed.velocities[0, 1] > undisturbed.velocities[0, 1] + 0.05

    def test_given_forces_replace_those_of_the_controller(self) -> None:
        driven = self.build_moving()
        original = driven.copy()
        for _ in range(5):
            driven.step(forces=original.observe_and_decide().decision.forces)
            original.step()
        assert driven.positions.tobytes() == original.positions.tobytes()
        driven.step(forces=np.zeros((6, 2)))
        original.step()
        assert driven.velocities.tobytes() != original.velocities.tobytes()
        with pytest.raises(ParameterError, match=r"forces: expected an array of shape \(6, 2\), got "):
            driven.step(forces=np.zeros((2, 2)))
        with pytest.raises(ParameterError, match=r"forces: .* finite forces in newtons"):
            driven.step(forces=np.full((6, 2), np.inf))


def test_simulations_have_a_short_repr(empty: Environment) -> None:
    simulation = Simulation(empty, Rapf(), empty.start().sample(3), dt=0.05)
    simulation.step()
    assert repr(simulation) == "<Simulation rapf on empty, 3 robots, at 0.05 s>"


CART = CircleObstacle((2, 1), 0.6, "cart", ObstaclePath(((2, 1), (8, 1)), 0.5, "back-and-forth"))
HALL = Environment("hall", ((0, 0), (10, 0), (10, 6), (0, 6)), (CART,))
CONDITIONS = Conditions(delay=0.05, sensing_noise=0.01, failures=((2, 0.2),), joins=((3, 0.4),))


def build_changing() -> Simulation:
    """Build a simulation with a moving obstacle, messages, a failure and a robot that joins."""
    return Simulation(HALL, Rapf(), [[4.0, 2.0], [4.0, 3.0], [6.0, 3.0]], conditions=CONDITIONS)


def test_observing_changes_nothing() -> None:
    observed = build_changing()
    undisturbed = build_changing()
    for _ in range(40):
        assert observed.observe_and_decide() is observed.observe_and_decide()
        assert observed.observe() is observed.observe_and_decide().seen
        inbox = observed.inbox
        assert observed.copy().observe_and_decide().inbox is not inbox
        assert observed.inbox is inbox
        observed.step()
        undisturbed.step()
    assert observed.positions.tobytes() == undisturbed.positions.tobytes()
    assert observed.observe().obstacle_points.tobytes() == undisturbed.observe().obstacle_points.tobytes()


def sense_from(simulation: Simulation, positions: np.ndarray) -> bytes:
    """Return the bytes of the obstacle points that the sensor of a simulation finds from some positions."""
    return simulation.sensor.find_nearest_points(positions, simulation.team.sensing_range).tobytes()


@pytest.mark.parametrize(
    "build", [build_changing, TestChanges().build_moving], ids=["everything changes", "rooms"]
)
def test_copies_share_nothing_that_changes(build: Callable[[], Simulation]) -> None:
    simulation = build()
    simulation.step()
    copy = simulation.copy()
    positions = simulation.positions.copy()
    working = simulation.is_working.copy()
    obstacle_points = sense_from(simulation, positions)
    for _ in range(60):
        copy.step()
    np.testing.assert_array_equal(simulation.positions, positions)
    np.testing.assert_array_equal(simulation.is_working, working)
    assert sense_from(simulation, positions) == obstacle_points
    for _ in range(60):
        simulation.step()
    assert simulation.positions.tobytes() == copy.positions.tobytes()
    assert sense_from(simulation, copy.positions) == sense_from(copy, copy.positions)
