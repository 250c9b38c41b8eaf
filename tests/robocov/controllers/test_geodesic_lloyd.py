from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import (
    CONTROLLERS,
    GeodesicLloyd,
    IndividualControllerAdapter,
    Lloyd,
    Rapf,
    get_information,
    has_memory,
    inform_controller,
    make_controller,
)
from robocov.controllers.geodesic_lloyd import Plan
from robocov.cost import CoverageCost
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.generator import generate_map
from robocov.mapfile import load_map
from robocov.observation import Decision, Observations
from robocov.observation.neighbours import Neighbours
from robocov.optimum import find_nearest_inside
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
DOOR = Environment("door", SQUARE.boundary, (WallObstacle(((5, 0), (5, 8)), 0.2),))


@settings(max_examples=8)
@given(
    seed=st.integers(0, 2**20),
    kind=st.sampled_from(["rooms", "caves", "polygons"]),
    exponent=st.sampled_from([1.0, 1.5, 2.0]),
)
def test_a_step_to_the_goals_does_not_raise_the_cost(seed: int, kind: str, exponent: float) -> None:
    """The claim, for a step of robots without inertia: sum of d^s over the sites falls, or stays."""
    environment = generate_map(seed % 20, kind=kind)
    plan = Plan(environment, 0.13, 32)
    places = find_nearest_inside(plan.room, environment.start("uniform").sample(4, seed=seed))
    nothing = np.full((4, 2), np.nan)
    raised = []
    for _ in range(6):
        seen = Observations(places, np.zeros((4, 2)), Neighbours(4), nothing, environment.region)
        goals, way, beyond = plan.ways(seen, exponent)
        assert (beyond[(way == goals).all(axis=1)] == 0.0).all()
        before, after = (np.nanmean(plan.cost(where).distances ** exponent) for where in (places, goals))
        raised.append(after / before - 1.0)
        places = goals
    # where walls hold a goal back, the nearest free place to it is what counts; that may cost a little
    assert max(raised) < 0.01
    assert np.prod(1.0 + np.array(raised)) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "trap", "museum"])
def test_it_ends_below_its_start_and_below_lloyd(name: str) -> None:
    environment = load_map(name)
    cost = CoverageCost(environment, 48)
    starts = environment.start().sample(5, seed=1)
    ends = []
    for law in (GeodesicLloyd(), Lloyd()):
        simulation = Simulation(environment, law, starts, dt=0.05)
        for _ in range(20 * 25):
            simulation.step()
        ends.append(cost(simulation.positions).mean_distance)
    assert ends[0] < 0.7 * cost(starts).mean_distance
    assert ends[0] < ends[1]


def test_from_a_good_place_it_does_not_get_worse() -> None:
    rooms = load_map("rooms")
    cost = CoverageCost(rooms, 64)
    simulation = Simulation(rooms, GeodesicLloyd(), rooms.start().sample(6, seed=0), dt=0.05)
    values = []
    for k in range(20 * 45):
        if k % 100 == 0:
            values.append(cost(simulation.positions).mean_distance)
        simulation.step()
    assert (np.diff(values) < 0.01 * values[-1]).all()


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_where_nothing_is_in_the_way_it_ends_at_the_median_or_the_centroid(exponent: float) -> None:
    """Of a right triangle, where the two differ."""
    triangle = Environment("triangle", ((0, 0), (12, 0), (0, 6)))
    simulation = Simulation(triangle, GeodesicLloyd(exponent=exponent, lattice=96), [[2.0, 2.0]])
    for _ in range(60 * 20):
        simulation.step()
    x, y = (part.ravel() for part in np.meshgrid(np.arange(0.02, 12, 0.04), np.arange(0.02, 6, 0.04)))
    x, y = x[x + 2 * y < 12], y[x + 2 * y < 12]
    best = np.array([x.mean(), y.mean()])
    for _ in range(200 if exponent == 1.0 else 0):
        weight = 1.0 / np.maximum(np.hypot(x - best[0], y - best[1]), 1e-9)
        best = np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()
    np.testing.assert_allclose(simulation.positions[0], best, atol=0.05)


def test_the_way_leads_through_the_door() -> None:
    """Alone behind a wall: the cell is the whole map, the first way-point is at the end of the wall."""
    law = GeodesicLloyd(exponent=2.0).inform(DOOR)
    seen = Observations(
        np.array([[2.0, 1.0], [1.0, 2.0]]),
        np.zeros((2, 2)),
        Neighbours(2),
        np.full((2, 2), np.nan),
        DOOR.region,
    )
    goals, way, beyond = law._plan(Team.homogeneous(2)).ways(seen, 2.0)
    assert (goals[:, 0] < 4.9).all()
    assert (way == goals).all() and (beyond == 0.0).all()
    path = law._plan(Team.homogeneous(2)).paths.find_path(np.array([2.0, 1.0]), np.array([8.0, 1.0]))
    assert np.hypot(*(path[1] - [4.9, 8.0])) == pytest.approx(0.13, abs=0.02)


def test_it_must_be_told_the_map() -> None:
    with pytest.raises(ParameterError, match=r"geodesic-lloyd.*inform\(environment\) was wanted"):
        GeodesicLloyd().begin(SQUARE.region, Team.homogeneous(2))
    with pytest.raises(ParameterError, match="no room for robots that keep 6 m"):
        GeodesicLloyd(clearance=5.9).inform(SQUARE).begin(SQUARE.region, Team.homogeneous(2))
    with pytest.raises(ParameterError, match=r"lattice: expected a whole number from 4 to 512 cells"):
        make_controller("geodesic-lloyd", {"lattice": 12.5})


def test_a_simulation_tells_it_the_map_and_keeps_the_law_that_it_was_given() -> None:
    law = GeodesicLloyd()
    simulation = Simulation(DOOR, law, [[2.0, 2.0], [3.0, 3.0]])
    simulation.step()
    assert simulation.controller is law
    # changed under way, it goes by the new map
    opened = simulation.with_changes(environment=SQUARE)
    fresh = Simulation(SQUARE, law, TeamState(simulation.positions, simulation.velocities, steps=1))
    for _ in range(15):
        opened.step()
        fresh.step()
    goals = opened.observe_and_decide().decision.goals
    assert goals is not None
    np.testing.assert_allclose(goals, fresh.observe_and_decide().decision.goals, atol=0.05)


def test_what_each_law_goes_by() -> None:
    stated = {name: get_information(kind) for name, kind in CONTROLLERS.items()}
    assert stated["geodesic-lloyd"] == "whole map"
    own = {"rapf", "rpf", "lloyd", "howard", "poduri", "dispersion", "range-limited", "tangentbug", "barrier"}
    assert {stated[name] for name in (*own, "visibility", "boosting")} == {"own"}
    assert (stated["diffeomorphism"], stated["adaptive"]) == ("whole map", "shared map")
    for kind in CONTROLLERS.values():
        assert (get_information(kind) == "whole map") == hasattr(kind, "inform")


def test_what_is_not_told_who_does_not_say_so() -> None:
    assert inform_controller(Rapf(), SQUARE) == Rapf()

    class Cheat(Rapf):
        def inform(self, environment: Environment) -> Rapf:
            return self

    with pytest.raises(ParameterError, match=r"information: expected 'whole map', because .* got 'own'"):
        inform_controller(Cheat(), SQUARE)

    class Vague(Rapf):
        information = "everything"

    with pytest.raises(ParameterError, match=r"information: expected one of own, .* got 'everything'"):
        inform_controller(Vague(), SQUARE)

    @dataclass(frozen=True)
    class Own:
        information = "shared map"

        def force(self, own: object) -> list[float]:
            return [0.0, 0.0]

    assert get_information(IndividualControllerAdapter(Own())) == "shared map"


def test_who_remembers_what_it_decides_by() -> None:
    assert not has_memory(Rapf())
    assert has_memory(GeodesicLloyd())
    assert has_memory(make_controller("howard"))


def test_limited_communication_and_a_density() -> None:
    """Each robot plans with those it hears; a density of the map weighs the places."""
    from robocov.density import Gaussian, Gaussians

    bell = replace(SQUARE, density=Gaussians((Gaussian((7.0, 7.0), 1.0, 1.0),), floor=0.001))
    law = inform_controller(GeodesicLloyd(exponent=2.0), bell)
    positions = np.array([[6.0, 6.5], [1.0, 1.0]])
    team = Team.homogeneous(2, communication_range=2.0)
    seen = Observations(
        positions,
        np.zeros((2, 2)),
        Neighbours.from_ranges(positions, team.communication_range),
        np.full((2, 2), np.nan),
        SQUARE.region,
    )
    decision = law.decide(seen, law.begin(SQUARE.region, team))
    assert isinstance(decision, Decision)
    # neither hears the other: both head for the middle of the bell
    np.testing.assert_allclose(decision.goals, [[7, 7], [7, 7]], atol=0.15)


def test_the_same_run_twice() -> None:
    starts = DOOR.start().sample(4, seed=1)
    one, other = (Simulation(DOOR, GeodesicLloyd(), starts).run(3.0) for _ in range(2))
    assert one.positions.tobytes() == other.positions.tobytes()
