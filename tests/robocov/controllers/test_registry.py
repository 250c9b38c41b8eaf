"""Controllers by name: built in, and in files of users."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocov.controllers import (
    CONTROLLERS,
    RECOMMENDED_CONTROLLERS,
    Controller,
    GeodesicLloyd,
    Lloyd,
    OwnView,
    Rapf,
    has_memory,
    make_controller,
)
from robocov.controllers.base import get_information
from robocov.controllers.individual import to_team_controller
from robocov.errors import ParameterError
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.scenario import Scenario

REGION = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]]))


def test_recommended_controllers_use_the_information_for_which_they_are_recommended() -> None:
    for information, name in RECOMMENDED_CONTROLLERS.items():
        assert get_information(CONTROLLERS[name]) == information


def test_an_unknown_name_is_rejected_with_the_most_similar_one() -> None:
    with pytest.raises(ParameterError, match=r"unknown controller 'raff': did you mean 'rapf'\?"):
        make_controller("raff")


def test_controllers_whose_memory_only_saves_time_have_none() -> None:
    assert not has_memory(Rapf())
    assert not has_memory(Lloyd())
    assert has_memory(GeodesicLloyd())
    assert has_memory(make_controller("howard"))


def test_individual_controllers_may_assign_memory_also_without_begin() -> None:
    class Homing:
        def force(self, own: OwnView) -> np.ndarray:
            return own.centroid - own.position

    assert has_memory(to_team_controller(Homing()))


@pytest.fixture
def controller_file(tmp_path: Path) -> Path:
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
        "class Thawed:\n"
        "    def force(self, own):\n"
        "        return [0.0, 0.0]\n"
    )
    return file


def test_a_controller_in_a_file_is_made_with_its_gains(controller_file: Path) -> None:
    controller = make_controller(f"{controller_file}:Mine", {"stiffness": 2})
    assert isinstance(controller, Controller)
    assert controller.name == "Mine"
    positions = np.array([[4.0, 4.0], [6.0, 5.0]])
    seen = Observations(positions, np.zeros((2, 2)), Neighbors(2), np.full((2, 2), np.nan), REGION)
    decision = controller.decide(seen, None)
    assert decision.goals is not None
    np.testing.assert_allclose(decision.forces, 2.0 * (decision.goals - positions))


def test_mistakes_in_the_name_of_a_file_or_class_are_explained(controller_file: Path) -> None:
    for name, message in [
        (f"{controller_file}:Nine", "did you mean 'Mine'"),
        (
            f"{controller_file}:Plain",
            r"mine\.py: Plain: expected a class with a method decide\(observations, memory\) or force",
        ),
        (f"{controller_file}:Thawed", r"mine\.py: Thawed: expected a frozen dataclass"),
        (f"{controller_file.parent}/no.py:Mine", r"no\.py: no such file"),
        (f"{1000 * 'a'}.py:Mine", r"a\.py: no such file"),
        (f"{controller_file}", "expected a file and a class"),
    ]:
        with pytest.raises(ParameterError, match=message):
            make_controller(name)


def test_errors_in_a_file_are_explained(controller_file: Path) -> None:
    controller_file.write_text("1/0\n")
    with pytest.raises(ParameterError, match=r"ZeroDivisionError: division by zero \(mine.py, line 1\)"):
        make_controller(f"{controller_file}:Mine")


def test_an_error_with_several_lines_is_explained_on_one_line(controller_file: Path) -> None:
    controller_file.write_text("raise ValueError('one\\ntwo\\x1b[31m')\n")
    with pytest.raises(ParameterError, match=r"ValueError: one\\ntwo\\x1b\[31m \(mine.py, line 1\)$"):
        make_controller(f"{controller_file}:Mine")


def test_an_error_in_a_generated_method_is_located_at_the_line_that_calls_it(controller_file: Path) -> None:
    text = controller_file.read_text()
    controller_file.write_text(
        text.replace(
            "        return self.stiffness", "        self.last = own.position\n        return self.stiffness"
        )
    )
    scenario = Scenario("square", f"{controller_file}:Mine", robots=2, duration=0.1)
    with pytest.raises(
        ParameterError,
        match=r"FrozenInstanceError: cannot assign to field 'last' \(mine.py, line 7\) for robot 1",
    ):
        scenario.run()


@pytest.mark.parametrize("name", ["Homing", "mine.Homing", "mine.py.Homing"])
def test_a_class_without_its_file_is_explained(name: str) -> None:
    with pytest.raises(ParameterError, match=r"for a class in a file, write FILE\.py:Homing;"):
        make_controller(name)


@pytest.mark.parametrize("name", ["RAPF", "Rapff", "AtlasShared"])
def test_a_built_in_controller_in_capital_letters_is_suggested(name: str) -> None:
    with pytest.raises(ParameterError, match=r"did you mean '(rapf|atlas-shared)'"):
        make_controller(name)
