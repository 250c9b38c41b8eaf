"""Controllers of one robot, and their adapter for a team."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from robocov.controllers import Controller, IndividualControllerAdapter, OwnView, Rapf, get_information
from robocov.controllers.gains import gain
from robocov.controllers.individual import require_controller, to_team_controller, unwrap_controller
from robocov.errors import ParameterError
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team

REGION = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]]))


@dataclass(frozen=True)
class Returning:
    """Returns an answer as its force."""

    answer: Any

    def force(self, own: OwnView) -> Any:
        return self.answer


def observe(positions: np.ndarray) -> Observations:
    """Return the observations of robots at rest; only robot 0 senses an obstacle."""
    obstacle_points = np.full(positions.shape, np.nan)
    obstacle_points[0] = [0.0, 1.0]
    return Observations(
        positions, np.zeros(positions.shape), Neighbors(len(positions)), obstacle_points, REGION, time=2.0
    )


def test_each_robot_gets_its_own_view() -> None:
    views = []

    class Recording:
        def force(self, own: OwnView) -> list[float]:
            views.append(own)
            return [float(own.number), 0.0]

    positions = np.array([[2.0, 4.0], [8.0, 4.0]])
    decision = IndividualControllerAdapter(Recording()).decide(observe(positions), None)
    np.testing.assert_array_equal(decision.forces, [[0.0, 0.0], [1.0, 0.0]])
    assert [view.number for view in views] == [0, 1]
    np.testing.assert_array_equal(views[1].position, positions[1])
    np.testing.assert_array_equal(views[1].neighbors, positions[:1])
    np.testing.assert_array_equal(views[0].obstacle_point, [0.0, 1.0])
    assert views[1].obstacle_point is None
    np.testing.assert_allclose(views[0].centroid, [2.5, 4.0])
    np.testing.assert_allclose(views[0].cell.mean(axis=0), [2.5, 4.0])
    assert views[0].heading is None
    assert views[0].time == 2.0


def test_memory_is_what_begin_returned_and_then_what_was_assigned() -> None:
    class Counting:
        def begin(self, number: int, team: Team) -> int:
            return 10 * number

        def force(self, own: OwnView) -> list[float]:
            own.memory += 1
            return [own.memory, 0.0]

    adapter = IndividualControllerAdapter(Counting())
    seen = observe(np.array([[2.0, 4.0], [8.0, 4.0]]))
    memory = adapter.begin(REGION, Team.homogeneous(2))
    first = adapter.decide(seen, memory)
    second = adapter.decide(seen, first.memory)
    assert second.forces[:, 0].tolist() == [2.0, 12.0]
    assert adapter.decide(seen, memory).forces[:, 0].tolist() == [1.0, 11.0]


def test_a_view_may_be_changed_without_changing_the_observations() -> None:
    class Vandal:
        def force(self, own: OwnView) -> list[float]:
            own.position += 1.0
            own.velocity += 1.0
            own.neighbors += 1.0
            return [0.0, 0.0]

    reported_positions = np.array([[8.0, 4.0], [2.0, 4.0]])
    seen = replace(
        observe(np.array([[2.0, 4.0], [8.0, 4.0]])),
        neighbors=Neighbors.from_pairs(2, np.array([0, 1]), np.array([1, 0])),
        reported_positions=reported_positions.copy(),
    )
    IndividualControllerAdapter(Vandal()).decide(seen, None)
    np.testing.assert_array_equal(seen.positions, [[2.0, 4.0], [8.0, 4.0]])
    np.testing.assert_array_equal(seen.velocities, 0.0)
    np.testing.assert_array_equal(seen.reported_positions, reported_positions)


@pytest.mark.parametrize("answer", [None, 1.0, [1.0], [1.0, np.nan], [1.0, 2.0, 3.0], "up", [[1.0, 2.0]]])
def test_anything_but_two_finite_numbers_is_rejected(answer: Any) -> None:
    message = r"force\(own\) returned .* for robot 1 at 2.000 s .* expected two finite numbers in newtons"
    with pytest.raises(ParameterError, match=message):
        IndividualControllerAdapter(Returning(answer)).decide(observe(np.array([[2.0, 4.0]])), None)


def test_errors_are_noted_with_the_number_of_the_robot() -> None:
    class Failing:
        def force(self, own: OwnView) -> list[float]:
            return [1.0 / (1 - own.number), 0.0]

    with pytest.raises(ZeroDivisionError) as caught:
        IndividualControllerAdapter(Failing()).decide(observe(np.array([[2.0, 4.0], [8.0, 4.0]])), None)
    assert caught.value.__notes__ == ["robot 2"]


def test_the_names_are_those_of_the_individual_controller() -> None:
    class Named(Returning):
        name = "named"
        label = "Named"
        summary = "with names"

    adapter = IndividualControllerAdapter(Returning([0.0, 0.0]))
    assert (adapter.name, adapter.label, adapter.summary) == (
        "Returning",
        "Returning",
        "Returns an answer as its force.",
    )
    named = IndividualControllerAdapter(Named([0.0, 0.0]))
    assert (named.name, named.label, named.summary) == ("named", "Named", "with names")


def test_the_information_is_that_of_the_individual_controller() -> None:
    class Sharing(Returning):
        information = "shared map"

    assert get_information(IndividualControllerAdapter(Sharing([0.0, 0.0]))) == "shared map"


def test_only_individual_controllers_are_adapted() -> None:
    individual = Returning([0.0, 0.0])
    adapter = to_team_controller(individual)
    assert isinstance(adapter, Controller)
    assert unwrap_controller(adapter) is individual
    rapf = Rapf()
    assert to_team_controller(rapf) is rapf
    assert unwrap_controller(rapf) is rapf
    assert to_team_controller(Returning) is Returning


def test_missing_members_of_a_controller_of_a_team_are_named() -> None:
    class Resting:
        name = label = "resting"

        def decide(self, seen: Observations, memory: Any) -> None: ...

        def __repr__(self) -> str:
            return "Resting()"

    expected = "the attributes name, label, summary, begin, decide, got Resting() without summary, begin"
    with pytest.raises(ParameterError, match=re.escape(expected)):
        require_controller(Resting())
    with pytest.raises(ParameterError, match=r"as in Rapf\(\), with a method decide or force, got <class"):
        require_controller(Rapf)


@pytest.mark.parametrize("shy", [-3.0, "a", np.nan])
def test_gains_of_user_defined_controllers_must_be_in_range(shy: Any) -> None:
    @dataclass(frozen=True)
    class Homing:
        shy: float = gain(0.0, "m", "how far it stays away from walls")

        def force(self, own: OwnView) -> Any:
            return own.centroid - own.position

    assert require_controller(Homing(shy=1)).controller.shy == 1  # type: ignore[attr-defined]
    with pytest.raises(ParameterError, match=r"Homing\.shy: expected a number from 0 to 1000000 m, got"):
        require_controller(Homing(shy=shy))


def test_plain_fields_of_user_defined_controllers_have_no_range() -> None:
    @dataclass(frozen=True)
    class Homing:
        limit: float = np.inf

        def force(self, own: OwnView) -> Any:
            return own.centroid - own.position

    require_controller(Homing())
