"""The interface of controllers: information, maps, and checks of gains."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from robocov.controllers import (
    CONTROLLERS,
    GeodesicLloyd,
    Rapf,
    get_information,
    inform_controller,
)
from robocov.environment import Environment
from robocov.errors import ParameterError

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def test_each_controller_states_its_information() -> None:
    information = {name: get_information(kind) for name, kind in CONTROLLERS.items()}
    whole_map = {name for name, stated in information.items() if stated == "whole map"}
    shared_map = {name for name, stated in information.items() if stated == "shared map"}
    assert whole_map == {"geodesic-lloyd", "diffeomorphism", "local-search", "exemplar"}
    assert shared_map == {
        "adaptive",
        "atlas-shared",
        "exploring-lloyd",
        "gp-ucb",
        "frontier-median",
        "greedy-submodular",
        "voronoi-graph",
    }
    for name, kind in CONTROLLERS.items():
        assert hasattr(kind, "inform") == (name in whole_map)


def test_only_controllers_that_state_it_get_the_map() -> None:
    class Cheat(Rapf):
        def inform(self, environment: Environment) -> Rapf:
            return self

    assert inform_controller(Rapf(), SQUARE) == Rapf()
    with pytest.raises(ParameterError, match=r"information: expected 'whole map', because .* got 'own'"):
        inform_controller(Cheat(), SQUARE)


def test_the_informed_controller_has_the_same_gains() -> None:
    informed_controller = inform_controller(GeodesicLloyd(exponent=1.5), SQUARE)
    assert isinstance(informed_controller, GeodesicLloyd)
    assert informed_controller.exponent == 1.5


def test_inform_must_return_a_controller() -> None:
    class Forgetful(Rapf):
        information = "whole map"

        def inform(self, environment: Environment) -> None:
            pass

    with pytest.raises(ParameterError, match=r"inform\(environment\) returned None .*expected a controller"):
        inform_controller(Forgetful(), SQUARE)


def test_unknown_information_is_rejected() -> None:
    class Vague(Rapf):
        information = "everything"

    with pytest.raises(ParameterError, match=r"information: expected one of own, .* got 'everything'"):
        inform_controller(Vague(), SQUARE)


def test_unknown_gains_are_rejected_with_the_most_similar_name() -> None:
    with pytest.raises(ParameterError, match=r"rapf: unknown gain 'krep': did you mean 'k_rep'\?"):
        Rapf(krep=1.0)  # type: ignore[call-arg]


def test_subclasses_check_their_own_gains() -> None:
    @dataclass(frozen=True)
    class Scaled(Rapf):
        scale: float = 1.0

    assert Scaled(scale=2).scale == 2.0
    with pytest.raises(ParameterError, match="unknown gain 'scales': did you mean 'scale'"):
        Scaled(scales=2.0)  # type: ignore[call-arg]
