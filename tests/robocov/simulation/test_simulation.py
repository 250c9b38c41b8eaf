from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS as ALL
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


def digest(record: Record) -> str:
    together = hashlib.sha256()
    for name in ARRAYS:
        together.update(np.ascontiguousarray(getattr(record, name)).tobytes())
    return together.hexdigest()


def digests() -> list[str]:
    """Return what says whether runs of all laws, and of one under conditions, are the same bit for bit."""
    room = load_map("rooms")
    starts, noisy = (
        room.start().sample(6, seed=3),
        Conditions(0.2, 0.1, position_noise=0.02, failure_rate=0.01),
    )
    runs = [Simulation(room, make_controller(name), starts, dt=1 / 20) for name in ALL]
    runs += [Simulation(room, each, starts, dt=1 / 20, conditions=noisy) for each in CONTROLLERS]
    runs.append(Simulation(room, Rapf(), starts, Team.homogeneous(6, kinematics="unicycle"), 1 / 20))
    return [digest(each.run(2.0)) for each in runs]


@pytest.mark.parametrize(
    "environment",
    [
        {
            "PYTHONHASHSEED": "1",
            "OPENBLAS_CORETYPE": "Prescott",
            "NPY_DISABLE_CPU_FEATURES": "AVX512_SKX AVX2",
        },
        # all kernels are compiled anew for it
        pytest.param({"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}, marks=pytest.mark.slow),
    ],
    ids=["libraries", "instructions"],
)
@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_runs_are_the_same_in_another_process_on_any_x86_processor(environment: dict[str, str]) -> None:
    script = "import sys; sys.path.insert(0, sys.argv[1]); import test_simulation as t; print(*t.digests())"
    command = [sys.executable, "-W", "ignore", "-c", script, str(Path(__file__).parent)]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    here = digests()
    assert done.stdout.split() == here
    assert len(set(here)) == len(here)


@pytest.mark.parametrize("controller", CONTROLLERS, ids=["rapf", "paper", "rpf", "lloyd"])
@settings(max_examples=5)
@given(branch=st.integers(0, 400), seed=st.integers(0, 100))
def test_copies_continue_identically(
    cluttered: Environment, controller: Controller, branch: int, seed: int
) -> None:
    simulation = Simulation(cluttered, controller, cluttered.start().sample(6, seed=seed))
    for _ in range(branch):
        simulation.step()
    twin = simulation.copy()
    assert twin.time == simulation.time
    for _ in range(200):
        simulation.step()
    before = twin.positions.copy()
    assert (branch == 0) or not np.array_equal(before, simulation.positions)
    for _ in range(200):
        twin.step()
    assert (twin.positions == simulation.positions).all()
    assert (twin.velocities == simulation.velocities).all()


def transformed(environment: Environment, turn: np.ndarray) -> Environment:
    def moved(ring: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        return tuple(tuple(point) for point in (np.array(ring) @ turn.T).tolist())

    return Environment(
        environment.name,
        moved(environment.boundary),
        tuple(PolygonObstacle(moved(shape.vertices)) for shape in environment.obstacles),  # type: ignore[union-attr]
    )


@pytest.mark.parametrize("controller", [Rapf(), Rpf(), Lloyd()], ids=["rapf", "rpf", "lloyd"])
@pytest.mark.parametrize(
    "turn",
    [np.diag([-1.0, 1.0]), np.array([[0.0, -1.0], [1.0, 0.0]]), np.array([[0.6, -0.8], [0.8, 0.6]])],
    ids=["mirror", "quarter turn", "turn"],
)
def test_runs_rotate_and_mirror_with_the_map(controller: Controller, turn: np.ndarray) -> None:
    room = Environment(
        "room",
        ((0.0, 0.0), (9.0, 0.0), (10.0, 7.0), (1.0, 8.0)),
        (
            PolygonObstacle(((3.0, 3.0), (5.0, 3.0), (5.0, 3.5), (3.5, 3.5), (3.5, 5.0), (3.0, 5.0))),
            PolygonObstacle(((6.5, 4.0), (7.5, 4.2), (7.0, 5.5))),
        ),
    )
    starts = np.array([[1.0, 1.0], [1.6, 0.8], [1.2, 1.9], [2.2, 1.4], [0.8, 2.6]])
    straight = Simulation(room, controller, starts).run(6.0)
    turned = Simulation(transformed(room, turn), controller, starts @ turn.T).run(6.0)
    # rounding differs, and repulsion amplifies it; 1e-5 m is far below anything that means something
    np.testing.assert_allclose(turned.positions, straight.positions @ turn.T, atol=1e-5)
    assert np.abs(straight.positions[-1] - starts).max() > 0.5


def test_rapf_beats_rpf_among_obstacles_without_contacts() -> None:
    """One run of the paper's figures 4 to 7; the study of the paper looks at many."""
    rooms = load_map("rooms")
    cost = CoverageCost(rooms, lattice=32)
    starts = rooms.start().sample(6, seed=0)
    rapf, rpf = (Simulation(rooms, each, starts, dt=1 / 30).run(40.0) for each in (Rapf(), Rpf()))
    assert cost(rapf.positions[-1]).mean_distance < 0.95 * cost(rpf.positions[-1]).mean_distance
    assert count_contacts(rapf, compute_clearances(rapf)) == 0


def test_two_hundred_robots_spread_over_a_large_map() -> None:
    campus = load_map("campus")
    record = Simulation(campus, Rapf(), campus.start().sample(200, seed=0)).run(15.0)
    clearance = compute_clearances(record)
    assert clearance.min() > -2e-3
    moved = np.hypot(*(record.positions[-1] - record.positions[0]).T)
    assert np.median(moved) > 0.5
    assert np.isfinite(record.positions).all()


def test_records_respect_times_and_limits(cluttered: Environment) -> None:
    record = Simulation(cluttered, Rapf(), cluttered.start().sample(6), dt=0.02).run(5.0)
    assert len(record) == 251
    np.testing.assert_allclose(record.time, np.arange(251) * 0.02)
    assert np.hypot(*record.velocities.reshape(-1, 2).T).max() <= 1 + 1e-9
    moved = np.hypot(*np.diff(record.positions, axis=0).reshape(-1, 2).T)
    assert moved.max() <= 0.02 * (1 + 1e-6)


class Wild:
    """Returns whatever it was made with."""

    name = label = "wild"
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
    simulation = Simulation(empty, Wild(forces), [[2.0, 2.0], [4.0, 4.0]])
    with pytest.raises(ParameterError, match=message):
        simulation.step()


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([[3.0, 2.0]], r"starts\[0\] = \[3, 2\] is inside an obstacle"),
        ([[1.0, 1.0], [2.0, 8.0]], r"starts\[1\] = \[2, 8\] is inside an obstacle or outside the boundary"),
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
    class Array(Wild):
        def decide(self, seen: Observations, memory: object) -> Decision:
            return self.forces  # type: ignore[return-value]

    class Goals(Wild):
        def decide(self, seen: Observations, memory: object) -> Decision:
            return Decision(self.forces, goals=np.zeros((1, 2)))

    class Late(Wild):
        def begin(self, region: object, team: object) -> None:
            raise KeyError("late")

    starts = [[2.0, 2.0], [4.0, 4.0]]
    with pytest.raises(ParameterError, match=r"decide\(seen, memory\) returned .*, expected a Decision"):
        Simulation(empty, Array(np.zeros((2, 2))), starts).step()
    with pytest.raises(ParameterError, match=r"goals of shape \(1, 2\) at .*, expected \(2, 2\)"):
        Simulation(empty, Goals(np.zeros((2, 2))), starts).step()
    with pytest.raises(ParameterError, match=r"'wild': KeyError: 'late' \(test_simulation.py, line \d+\)"):
        Simulation(empty, Late(np.zeros((2, 2))), starts)
    for wrong in (Rapf, "rapf"):
        with pytest.raises(ParameterError, match=r"expected a controller, as in Rapf\(\), with a method"):
            Simulation(empty, wrong, starts)  # type: ignore[arg-type]
    simulation = Simulation(empty, Wild([[0, 0], [0, 0]]), starts)  # type: ignore[arg-type]
    simulation.step()
    for duration in (float("nan"), float("inf"), -1.0):
        with pytest.raises(ParameterError, match="duration"):
            simulation.run(duration)


def test_copies_have_a_memory_of_their_own(empty: Environment) -> None:
    class Counting(Wild):
        def begin(self, region: object, team: object) -> list[int]:  # type: ignore[override]
            return [0]

        def decide(self, seen: Observations, memory: list[int]) -> Decision:  # type: ignore[override]
            memory[0] += 1  # in place, as one should not
            return Decision(np.full((1, 2), 0.1 * memory[0]), memory=memory)

    simulation = Simulation(empty, Counting(np.zeros((1, 2))), [[2.0, 2.0]])
    for _ in range(3):
        simulation.step()
    assert (simulation.observe_and_decide().decision.memory, simulation.memory) == ([4], [3])
    assert simulation.with_changes(velocities=np.zeros((1, 2))).memory == [3]
    assert simulation.with_changes(controller=Counting(np.zeros((1, 2)))).memory == [0]
    twin = simulation.copy()
    for _ in range(5):
        simulation.step()
    for _ in range(5):
        twin.step()
    np.testing.assert_array_equal(twin.positions, simulation.positions)


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
    twin = simulation.copy()
    for _ in range(4):
        simulation.step()
        twin.step()
    assert simulation.memory.own == twin.memory.own == [[5]]
    assert twin.positions.tobytes() == simulation.positions.tobytes()


def test_memory_assigned_by_a_controller_for_one_robot_reaches_its_next_step(empty: Environment) -> None:
    class Numbering:
        def force(self, own: OwnView) -> list[float]:
            own.memory = (own.memory or 0) + own.number + 1
            return [0.0, 0.0]

    simulation = Simulation(empty, Numbering(), [[2.0, 2.0], [4.0, 4.0]])
    for _ in range(3):
        simulation.step()
    assert simulation.memory.own == [3, 6]


class NewsReader(Wild):
    """Is informed of the map, and pushes by the largest density that it has read of."""

    information = "whole map"

    def __init__(self, mass: float = 0.0) -> None:
        super().__init__(np.full((1, 2), mass))

    def inform(self, environment: Environment) -> NewsReader:
        return NewsReader(float(environment.free_masses.sum()))


def test_a_new_density_reaches_a_controller_that_knows_the_map(empty: Environment) -> None:
    simulation = Simulation(empty, NewsReader(), [[2.0, 2.0]])
    twin = simulation.with_density(empty.with_density(Uniform(3.0)))
    before = simulation.observe_and_decide().decision.forces
    after = twin.observe_and_decide().decision.forces
    np.testing.assert_allclose(after, 3.0 * before)
    assert simulation.environment is empty


def test_changes_keep_the_number_of_steps(empty: Environment) -> None:
    """Times are multiples of the control period, and scans are taken in the same steps."""
    simulation = Simulation(empty, Howard(), [[2.0, 2.0], [3.0, 3.0]], dt=0.03)
    twin = simulation.copy()
    for _ in range(40):
        simulation.step()
        twin.step()
        twin = twin.with_changes()
        assert twin.time == simulation.time
        assert (twin.observe().scans is None) == (simulation.observe().scans is None)


def test_a_state_has_two_finite_numbers_for_each_robot() -> None:
    positions = np.array([[2.0, 2.0], [3.0, 3.0]])
    with pytest.raises(StartError, match=r"velocities: expected finite \[x, y\] for each robot"):
        TeamState(positions, velocities=np.zeros((1, 2)))
    with pytest.raises(StartError, match=r"steering: expected finite \[heading, turning rate\]"):
        TeamState(positions, steering=np.full((2, 2), np.inf))
    assert len(TeamState(positions)) == 2


def test_team_and_starts_must_agree(empty: Environment) -> None:
    with pytest.raises(ParameterError, match="team: expected 1 robots, one for each start, got 3"):
        Simulation(empty, Rapf(), [[1.0, 1.0]], Team.homogeneous(3))


def test_runs_follow_the_equations_of_motion() -> None:
    """(23)-(28) written once more, plainly, and integrated by scipy: a run converges to it with its step."""
    from scipy.integrate import solve_ivp

    side, k_rep, rho_0, k_att, nu = 6.0, 0.3, 2.0, 0.5, 2.0
    square = shapely.box(0, 0, side, side)
    starts = np.array([[1.0, 1.2], [1.8, 1.0], [1.5, 2.1]])

    def force(points: np.ndarray, i: int) -> np.ndarray:
        here = points[i]
        cell = square
        total = np.zeros(2)
        walls = [(here[0], 0.0), (here[0], side), (0.0, here[1]), (side, here[1])]
        sources = [min(walls, key=lambda wall: np.hypot(*(here - wall)))]
        for j, other in enumerate(points):
            if j != i:
                sources.append(other)
                middle, along = (here + other) / 2, (other - here) / np.hypot(*(other - here))
                across = np.array([-along[1], along[0]])
                half = [middle + 99 * across, middle - 99 * across, middle - 99 * across - 99 * along]
                cell = cell.intersection(shapely.Polygon([*half, middle + 99 * across - 99 * along]))
        for source in sources:
            away = here - np.asarray(source)
            rho = np.hypot(*away)
            if rho < rho_0:
                total += k_rep * (1 / rho - 1 / rho_0) * away / rho**3
        goal = np.array(cell.centroid.coords[0])
        return total + k_att * (goal - here) * np.hypot(*(goal - here)) ** 2

    def motion(time: float, state: np.ndarray) -> np.ndarray:
        points, velocities = state.reshape(2, 3, 2)
        forces = np.array([force(points, i) for i in range(3)])
        return np.concatenate([velocities.ravel(), (forces - nu * velocities).ravel()])

    exact = solve_ivp(motion, (0, 3), np.concatenate([starts.ravel(), np.zeros(6)]), rtol=1e-6, atol=1e-8)
    expected = exact.y[:6, -1].reshape(3, 2)
    room = Environment("room", ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side)))
    team = Team.homogeneous(3, max_speed=100.0, max_acceleration=1e4, viscosity=nu, sensing_range=5.0)
    law = Rapf(k_rep=k_rep, rho_0=rho_0, k_att=k_att, attraction_limit=None)
    errors = [
        np.abs(Simulation(room, law, starts, team, dt).run(3.0).positions[-1] - expected).max()
        for dt in (1 / 60, 1 / 240)
    ]
    assert errors[1] < 0.005
    assert errors[1] < 0.4 * errors[0], "the error shrinks with the step"


def test_a_controller_cannot_change_the_world(cluttered: Environment) -> None:
    seen = Simulation(cluttered, Lloyd(), cluttered.start().sample(4)).observe()
    for array in (seen.positions, seen.velocities, seen.obstacle_points, seen.region.vertices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    simulation = Simulation(cluttered, Lloyd(), cluttered.start().sample(4))
    for _ in range(300):  # Lloyd's robots touch walls here
        simulation.step()
        assert not simulation.positions.flags.writeable
        assert not simulation.velocities.flags.writeable


class TestChanges:
    ROOM = load_map("rooms")

    def moving(self, controller: Controller | None = None) -> Simulation:
        simulation = Simulation(self.ROOM, controller or Rapf(), self.ROOM.start().sample(6, seed=1))
        for _ in range(90):
            simulation.step()
        return simulation

    def test_without_changes_a_simulation_continues_identically(self) -> None:
        before = self.moving()
        after, twin = before.with_changes(), before.copy()
        assert after.time == before.time == pytest.approx(1.5)
        for _ in range(120):
            after.step()
            twin.step()
        np.testing.assert_array_equal(after.positions, twin.positions)
        np.testing.assert_array_equal(after.velocities, twin.velocities)
        assert after.time == pytest.approx(twin.time)
        # the one that was changed stays where it is
        assert before.time == pytest.approx(1.5)

    def test_another_controller_continues_from_the_same_state(self) -> None:
        before = self.moving()
        after = before.with_changes(controller=Rpf())
        assert after.controller == Rpf()
        np.testing.assert_array_equal(after.positions, before.positions)
        np.testing.assert_array_equal(after.velocities, before.velocities)
        assert after.observe_and_decide().seen.time == before.time

    def test_obstacles_and_robots_can_be_removed(self) -> None:
        before = self.moving()
        emptier = Environment("emptier", self.ROOM.boundary, self.ROOM.obstacles[1:], self.ROOM.starts)
        after = before.with_changes(environment=emptier)
        assert after.environment is emptier
        fewer = after.with_changes(
            team=Team.homogeneous(4), positions=after.positions[:4], velocities=after.velocities[:4]
        )
        fewer.step()
        assert fewer.positions.shape == (4, 2)

    @pytest.mark.parametrize("controller", [Lloyd(), Rpf(k_rep=50.0, rho_0=9.0)], ids=["lloyd", "rpf"])
    def test_robots_in_contact_are_accepted(self, controller: Controller) -> None:
        simulation = Simulation(self.ROOM, controller, self.ROOM.start().sample(10, seed=1))
        for k in range(600):
            simulation.step()
            if k % 20 == 0:
                simulation.with_changes()

    def test_errors_name_robots_inside_a_new_obstacle(self) -> None:
        before = self.moving()
        x, y = before.positions[2].tolist()
        block = PolygonObstacle(
            ((x - 0.3, y - 0.3), (x + 0.3, y - 0.3), (x + 0.3, y + 0.3), (x - 0.3, y + 0.3))
        )
        blocked = Environment("blocked", self.ROOM.boundary, (*self.ROOM.obstacles, block))
        with pytest.raises(StartError, match=r"starts\[2\] = .* is inside an obstacle"):
            before.with_changes(environment=blocked)

    def test_arrays_of_wrong_size_or_content_are_rejected(self) -> None:
        before = self.moving()
        with pytest.raises(ParameterError, match="team: expected 6 robots, one for each start, got 3"):
            before.with_changes(team=Team.homogeneous(3))
        with pytest.raises(StartError, match=r"velocities: expected finite \[x, y\] for each robot"):
            before.with_changes(velocities=np.full((6, 2), np.nan))
        with pytest.raises(ParameterError, match=r"external_forces of shape \(2, 2\)"):
            before.step(np.zeros((2, 2)))
        with pytest.raises(ParameterError, match=r"external_forces: .* finite newtons"):
            before.step(np.full((6, 2), np.inf))

    def test_external_forces_move_only_their_robot(self) -> None:
        before = self.moving()
        pushed, alone = before.copy(), before.copy()
        pushes = np.zeros((6, 2))
        pushes[0] = 0.0, 5.0
        pushed.step(pushes)
        alone.step()
        np.testing.assert_array_equal(pushed.positions[1:], alone.positions[1:])
        assert pushed.velocities[0, 1] > alone.velocities[0, 1] + 0.05

    def test_given_forces_replace_those_of_the_controller(self) -> None:
        before = self.moving()
        driven, alone = before.copy(), before.copy()
        for _ in range(5):
            driven.step(forces=alone.observe_and_decide().decision.forces)
            alone.step()
        assert driven.positions.tobytes() == alone.positions.tobytes()
        driven.step(forces=np.zeros((6, 2)))
        alone.step()
        assert driven.velocities.tobytes() != alone.velocities.tobytes()
        with pytest.raises(ParameterError, match=r"forces of shape \(2, 2\)"):
            driven.step(forces=np.zeros((2, 2)))
        with pytest.raises(ParameterError, match=r"forces: .* finite newtons"):
            driven.step(forces=np.full((6, 2), np.inf))


def test_simulations_have_a_short_repr(empty: Environment) -> None:
    simulation = Simulation(empty, Rapf(), empty.start().sample(3), dt=0.05)
    simulation.step()
    assert repr(simulation) == "<Simulation rapf on empty, 3 robots, at 0.05 s>"


CART = CircleObstacle((2, 1), 0.6, "cart", ObstaclePath(((2, 1), (8, 1)), 0.5, "back-and-forth"))
BUSY = Environment("busy", ((0, 0), (10, 0), (10, 6), (0, 6)), (CART,))
TROUBLE = Conditions(delay=0.05, sensing_noise=0.01, failures=((2, 0.2),), joins=((3, 0.4),))


def busy() -> Simulation:
    return Simulation(BUSY, Rapf(), [[4.0, 2.0], [4.0, 3.0], [6.0, 3.0]], conditions=TROUBLE)


def test_observing_changes_nothing() -> None:
    asked, left = busy(), busy()
    for _ in range(40):
        assert asked.observe_and_decide() is asked.observe_and_decide()
        assert asked.observe() is asked.observe_and_decide().seen
        assert asked.sensor is asked.sensor
        inbox = asked.inbox
        assert asked.copy().observe_and_decide().inbox is not inbox is asked.inbox
        asked.step()
        left.step()
    assert asked.positions.tobytes() == left.positions.tobytes()
    assert asked.observe().obstacle_points.tobytes() == left.observe().obstacle_points.tobytes()


@pytest.mark.parametrize("made", [busy, TestChanges().moving], ids=["everything changes", "rooms"])
def test_copies_share_nothing_that_changes(made: Callable[[], Simulation]) -> None:
    simulation = made()
    simulation.step()
    twin, places, ranges = simulation.copy(), simulation.positions, simulation.team.sensing_range
    before = simulation.positions.tobytes(), simulation.sensor.find_nearest_points(places, ranges).tobytes()
    for _ in range(60):
        twin.step()
    assert (
        simulation.positions.tobytes(),
        simulation.sensor.find_nearest_points(places, ranges).tobytes(),
    ) == before
    assert simulation.working.all() or simulation.working.tolist() == [True, True, False]
    for _ in range(60):
        simulation.step()
    assert simulation.positions.tobytes() == twin.positions.tobytes()
    places = twin.positions
    assert (
        simulation.sensor.find_nearest_points(places, ranges).tobytes()
        == twin.sensor.find_nearest_points(places, ranges).tobytes()
    )
