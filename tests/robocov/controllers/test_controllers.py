from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import (
    CONTROLLERS,
    RECOMMENDED_CONTROLLER,
    Adaptive,
    Boosting,
    Controller,
    IndividualControllerAdapter,
    Lloyd,
    OwnView,
    Rapf,
    Rpf,
    get_gain_values,
    get_gains,
    get_information,
    inform_controller,
    make_controller,
)
from robocov.controllers.gains import Gain, Option, choice, gain
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Scans
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.team import Team

REGION = Region(np.array([[0.0, 0.0], [11.0, -1.0], [12.0, 8.0], [3.0, 10.0]]))


@dataclass(frozen=True)
class Homing:
    """A law for one robot that uses all that a robot knows."""

    stiffness: float = gain(0.5, "N/m", "pull to the centroid")

    def force(self, own: OwnView) -> np.ndarray:
        pull = self.stiffness * (own.centroid - own.position) - 0.1 * own.velocity
        away = sum(
            ((own.position - other) / (1 + np.hypot(*(own.position - other))) for other in own.neighbours),
            0.0,
        )
        wall = 0.0 if own.obstacle_point is None else own.position - own.obstacle_point
        return pull + 0.1 * away + 0.1 * wall + 0.01 * own.cell.mean(axis=0)


ROOM = Environment("room", tuple((x, y) for x, y in REGION.vertices.tolist()))
SHARING = ("frontier-median", "greedy-submodular", "voronoi-graph")
COARSE = {
    "geodesic-lloyd": {"lattice": 8.0},
    "diffeomorphism": {"lattice": 8.0},
    "adaptive": {"basis": 3.0},
    **{name: {"nodes": 100.0, "period": 0.4} for name in SHARING},
}
LARGEST = {"atlas": 12, "atlas-shared": 12, **dict.fromkeys(SHARING, 3)}
"""Teams of laws that plan are small here, as they are slow."""
ALL = [
    *(inform_controller(kind(**COARSE.get(name, {})), ROOM) for name, kind in CONTROLLERS.items()),
    Adaptive(estimate="gp"),
    *(Boosting(boost=word) for word in ("p", "neighbours")),
    *(Rapf(target=word, height=0.5) for word in ("sensing", "median")),
    Lloyd(target="median"),
    *(Rapf(cells="time", target=word) for word in ("centroid", "median")),
    Lloyd(cells="time"),
    IndividualControllerAdapter(Homing()),
]
EACH = [
    pytest.param(each, id=each.name, marks=[pytest.mark.slow] if each.name in LARGEST else []) for each in ALL
]


def scans(controller: Controller, n: int, rng: np.random.Generator) -> Scans | None:
    """What the rays of n robots might meet, if the controller wants to know."""
    wanted = getattr(controller, "scanning", None)
    if wanted is None:
        return None
    distances = rng.uniform(0.3, 4.0, size=(n, wanted.rays))
    return Scans(np.minimum(distances, 3.0), distances < 3.0)


def observations(positions: np.ndarray, reach: float, seed: int) -> Observations:
    rng = np.random.default_rng(seed)
    n = len(positions)
    points = positions + rng.normal(scale=0.8, size=(n, 2))
    points[rng.random(n) < 0.4] = np.nan
    ranges = np.full(n, reach)
    neighbours = Neighbours.from_ranges(positions, ranges)
    seen = Observations(positions, rng.normal(size=(n, 2)), neighbours, points, REGION, 3.0)
    return replace(seen, max_speeds=rng.choice([0.4, 0.7, 1.0], n))


def row(decision: Decision, i: int) -> list[np.ndarray]:
    parts = [decision.forces, *(decision.terms[name] for name in sorted(decision.terms))]
    if decision.goals is not None:
        parts.append(decision.goals)
    return [part[i].copy() for part in parts]


@pytest.mark.parametrize("controller", EACH)
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32), n=st.integers(2, 60), reach=st.floats(0.5, 6.0))
def test_a_robot_uses_only_what_it_knows(controller: Controller, seed: int, n: int, reach: float) -> None:
    """Changing anything outside robot i's ranges changes nothing in row i, not one bit."""
    rng = np.random.default_rng(seed)
    n = min(n, LARGEST.get(controller.name, n))
    positions = rng.uniform((3, 1), (10, 7), size=(n, 2))
    team = Team.homogeneous(n, communication_range=reach)
    i = int(rng.integers(n))
    one, other = controller.begin(REGION, team), controller.begin(REGION, team)
    # what is remembered must not tell it either
    for step in range(3):
        seen = observations(positions, reach, seed + step)
        seen = replace(seen, time=step * 0.2, scans=scans(controller, n, rng))
        telling = np.arange(n) == i
        if get_information(controller) == "shared map":
            telling = connected(seen.neighbours, i)
        changed = with_others_changed(seen, i, telling, reach, rng)
        decisions = controller.decide(seen, one), controller.decide(changed, other)
        for before, after in zip(row(decisions[0], i), row(decisions[1], i), strict=True):
            assert before.tobytes() == after.tobytes()
        one, other = decisions[0].memory, decisions[1].memory
        # who comes to be heard by moving may tell of those whom only it heard before
        if get_information(controller) != "shared map":
            positions = positions + rng.uniform(-0.05, 0.05, size=(n, 2))


def connected(neighbours: Neighbours, i: int) -> np.ndarray:
    """Return which robots may have told robot i of what they know, themselves or by others."""
    reached = np.zeros(neighbours.count, dtype=bool)
    left = [i]
    while left:
        k = left.pop()
        if not reached[k]:
            reached[k] = True
            left += neighbours.list_neighbours(k).tolist()
    return reached


def with_others_changed(
    seen: Observations, i: int, telling: np.ndarray, reach: float, rng: np.random.Generator
) -> Observations:
    """Return what is seen with all changed that robot i does not know, and nobody who is `telling` it."""
    n, positions = len(seen.positions), seen.positions
    others, heard = ~telling, telling.copy()
    heard[seen.neighbours.list_neighbours(i)] = True
    moved = positions.copy()
    strangers = np.flatnonzero(others & ~heard)
    for k in strangers:
        place = rng.uniform((0, -1), (12, 10))
        if REGION.contains(place) and np.hypot(*(place - positions[telling]).T).min() > reach:
            moved[k] = place
    velocities = np.where(others[:, None], rng.normal(size=(n, 2)), seen.velocities)
    points = np.where(others[:, None], moved + rng.normal(size=(n, 2)), seen.obstacle_points)
    neighbours = Neighbours.from_ranges(moved, np.full(n, reach))
    assert np.array_equal(neighbours.list_neighbours(i), seen.neighbours.list_neighbours(i))
    speeds = np.array(seen.max_speeds)
    speeds[strangers] = rng.choice([0.3, 0.7, 2.0], len(strangers))
    changed = replace(
        seen,
        positions=moved,
        velocities=velocities,
        neighbours=neighbours,
        obstacle_points=points,
        max_speeds=speeds,
    )
    if seen.scans is None:
        return changed
    distances = np.where(
        others[:, None], rng.uniform(0.3, 3.0, seen.scans.distances.shape), seen.scans.distances
    )
    return replace(changed, scans=Scans(distances, seen.scans.hit ^ others[:, None]))


@pytest.mark.parametrize("controller", EACH)
def test_the_information_test_can_fail(controller: Controller) -> None:
    """What a robot does know changes its decision: the property above is not empty."""
    positions = np.array([[4.0, 4.0], [5.0, 4.5], [8.0, 6.0]])
    team = Team.homogeneous(3)
    seen = observations(positions, np.inf, 1)
    # who flees at full speed goes by the direction alone, who plans by what is nearest on a lattice
    steps = {
        "dispersion": [0.5, 0.7],
        "geodesic-lloyd": [1.2, 0.6],
        "atlas": [-2.5, -3.0],
        "atlas-shared": [-2.5, -3.0],
        **{name: [-0.85, -0.45] for name in SHARING},
    }
    step = steps.get(controller.name, [0.6, 0.3])
    moved = observations(positions + [[0, 0], step, [0, 0]], np.inf, 1)
    one = controller.decide(seen, controller.begin(REGION, team)).forces[0]
    other = controller.decide(moved, controller.begin(REGION, team)).forces[0]
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("kind", [Rapf, Lloyd])
def test_cells_by_time_are_those_by_distance_for_equal_speeds(kind: type[Rapf] | type[Lloyd]) -> None:
    positions = np.random.default_rng(3).uniform(3, 7, size=(9, 2))
    team, seen = Team.homogeneous(9), observations(positions, 4.0, 3)
    for speeds in (None, np.full(9, 0.7)):
        told = replace(seen, max_speeds=speeds)
        pair = [law.decide(told, law.begin(REGION, team)).forces for law in (kind(), kind(cells="time"))]
        assert pair[0].tobytes() == pair[1].tobytes()
    by_time = kind(cells="time").decide(seen, kind().begin(REGION, team))
    assert not np.array_equal(by_time.forces, kind().decide(seen, kind().begin(REGION, team)).forces)


@pytest.mark.parametrize("kind", [Rapf, Rpf], ids=["rapf", "rpf"])
def test_forces_are_the_sum_of_their_terms(kind: type[Rapf] | type[Rpf]) -> None:
    seen = observations(np.random.default_rng(0).uniform(3, 7, size=(9, 2)), np.inf, 0)
    decision = kind().decide(seen, None)
    np.testing.assert_allclose(decision.forces, sum(decision.terms.values()), rtol=1e-12)


def test_rapf_without_attraction_is_rpf() -> None:
    seen = observations(np.random.default_rng(0).uniform(3, 7, size=(9, 2)), np.inf, 0)
    rapf = Rapf(k_rep=0.7, rho_0=3.0, k_att=0.0).decide(seen, None).forces
    np.testing.assert_array_equal(rapf, Rpf(k_rep=0.7, rho_0=3.0).decide(seen, None).forces)


def test_repulsion_equals_a_plain_double_loop() -> None:
    positions = np.random.default_rng(5).uniform(2, 8, size=(25, 2))
    seen = observations(positions, np.inf, 5)
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


@pytest.mark.parametrize("controller", EACH)
@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_coincident_robots_get_finite_forces(controller: Controller, n: int) -> None:
    positions = np.tile([5.0, 4.0], (n, 1))
    seen = Observations(
        positions,
        np.zeros((n, 2)),
        Neighbours.from_ranges(positions, np.full(n, np.inf)),
        positions.copy(),
        REGION,
    )
    decision = controller.decide(seen, controller.begin(REGION, Team.homogeneous(n)))
    assert np.isfinite(decision.forces).all()


def test_two_robots_in_one_place_are_pushed_apart() -> None:
    positions = np.tile([5.0, 4.0], (2, 1))
    seen = Observations(positions, np.zeros((2, 2)), Neighbours(2), np.full((2, 2), np.nan), REGION)
    forces = Rpf().decide(seen, None).forces
    np.testing.assert_allclose(forces[0], -forces[1])
    assert np.hypot(*forces[0]) > 1.0


def test_lloyd_drives_within_its_limits() -> None:
    """At the wanted velocity, far from the goal, the force only makes up for viscosity."""
    positions = np.array([[2.0, 2.0]])
    goal = REGION.centroid
    heading = (goal - positions[0]) / np.hypot(*(goal - positions[0]))
    seen = Observations(positions, heading[None] * 1.0, Neighbours(1), np.full((1, 2), np.nan), REGION)
    law = Lloyd()
    force = law.decide(seen, law.begin(REGION, Team.homogeneous(1))).forces
    np.testing.assert_allclose(force, 2.0 * heading[None], rtol=1e-9)


def test_gains_are_validated_by_name_and_range() -> None:
    assert make_controller("rapf", {"k_rep": 1, "attraction_limit": None}) == Rapf(
        k_rep=1.0, attraction_limit=None
    )
    assert isinstance(make_controller("rapf", {"k_rep": 1}).k_rep, float)
    with pytest.raises(ParameterError, match=r"rapf.k_rep: expected a number from 0 to 1e\+06 N m³, got -1"):
        make_controller("rapf", {"k_rep": -1})
    with pytest.raises(ParameterError, match=r"rapf: unknown gain 'krep': did you mean 'k_rep'\?"):
        make_controller("rapf", {"krep": 1})
    with pytest.raises(ParameterError, match=r"unknown controller 'raff': did you mean 'rapf'\?"):
        make_controller("raff")
    with pytest.raises(ParameterError, match=r"rapf.rho_0: expected a number from .*, got 'wide'"):
        make_controller("rapf", {"rho_0": "wide"})
    with pytest.raises(ParameterError, match=r"rapf.k_att: expected a number .*, got nan"):
        Rapf(k_att=float("nan"))
    with pytest.raises(ParameterError, match=r"rapf.k_rep: expected a number .*, got True"):
        Rapf(k_rep=True)
    with pytest.raises(ParameterError, match=r"mine.k: expected a number from 0 to inf, got inf"):
        Gain("k", 1.0, "", 0.0, math.inf, "").validate(math.inf, "mine")


@pytest.mark.slow
@given(
    st.sampled_from(sorted(CONTROLLERS)),
    st.dictionaries(
        st.sampled_from(["k_rep", "rho_0", "k_att", "attraction_limit", "k_prop", "response_time", "x"]),
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.lists(st.integers())),
        max_size=3,
    ),
)
def test_any_gains_make_a_controller_or_one_clear_line(name: str, gains: dict[str, object]) -> None:
    try:
        controller = make_controller(name, gains)
    except ParameterError as error:
        assert "\n" not in str(error)
        assert str(error).startswith(name)
    else:
        values = get_gain_values(controller)
        assert set(gains) <= set(values) and not any(isinstance(value, int) for value in values.values())


def test_every_gain_has_a_unit_a_meaning_and_a_default_in_range() -> None:
    for kind in CONTROLLERS.values():
        assert kind.summary
        assert kind.label
        declared = {each.name: each.metadata["gain"].unit for each in fields(kind) if "gain" in each.metadata}
        for known in get_gains(kind).values():
            assert isinstance(known, Option) or declared[known.name]
            assert known.unit != "1"  # nobody reads it behind a number
            assert known.meaning
            known.validate(known.default, kind.name)
    assert RECOMMENDED_CONTROLLER in CONTROLLERS


def test_gains_may_be_words() -> None:
    assert make_controller("rapf", {"target": "median"}) == Rapf(target="median")
    assert get_gain_values(Rapf())["target"] == "centroid"
    for wrong in ("Median", "", 3, None, True, ["median"]):
        with pytest.raises(ParameterError, match=r"^rapf\.target: .*centroid, "):
            Rapf(target=wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="default: expected one of left, right, got 'up'"):
        choice("up", ("left", "right"), "which way")


def test_a_controller_in_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from dataclasses import dataclass\n"
        "import robocov as rc\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    stiffness: float = rc.gain(0.5, 'N/m', 'pull')\n"
        "    def force(self, own):\n"
        "        return self.stiffness * (own.centroid - own.position)\n"
        "class Plain:\n"
        "    pass\n"
    )
    controller = make_controller(f"{file}:Mine", {"stiffness": 2})
    assert isinstance(controller, Controller)
    assert controller.name == "Mine"
    seen = observations(np.array([[4.0, 4.0], [6.0, 5.0]]), np.inf, 0)
    decision = controller.decide(seen, None)
    assert decision.goals is not None
    np.testing.assert_allclose(decision.forces, 2 * (decision.goals - seen.positions))
    for name, message in [
        (f"{file}:Nine", "did you mean 'Mine'"),
        (f"{file}:Plain", "expected a class with a method decide"),
        (f"{tmp_path}/no.py:Mine", "file not found"),
        (f"{file}", "expected a file and a class"),
    ]:
        with pytest.raises(ParameterError, match=message):
            make_controller(name)
    file.write_text("1/0\n")
    with pytest.raises(ParameterError, match="ZeroDivisionError"):
        make_controller(f"{file}:Mine")
