"""Errors: their classes, and the wording of messages."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from itertools import count

import numpy as np
import pytest

import robocov as rc
from robocov import errors
from robocov.controllers import list_controller_classes
from robocov.errors import InputError, Issue, MapError, ParameterError, format_path, to_floats


def test_errors_of_input_and_output_are_errors_of_robocov() -> None:
    assert issubclass(errors.MapError, errors.InputError)
    assert issubclass(errors.StartError, errors.InputError)
    assert issubclass(errors.ParameterError, errors.InputError)
    for kind in (errors.InputError, errors.OutputError):
        assert issubclass(kind, errors.RobocovError)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("rappf", "unknown controller 'rappf': did you mean 'rapf'? (known: lloyd, rapf, rpf)"),
        ("RAPF", "unknown controller 'RAPF': did you mean 'rapf'? (known: lloyd, rapf, rpf)"),
        ("rpaf", "unknown controller 'rpaf': did you mean 'rapf' or 'rpf'? (known: lloyd, rapf, rpf)"),
        ("zzzz", "unknown controller 'zzzz' (known: lloyd, rapf, rpf)"),
    ],
)
def test_unknown_names_get_a_suggestion(name: str, message: str) -> None:
    assert errors.describe_unknown_name("controller", name, ["rapf", "rpf", "lloyd"]) == message


@pytest.mark.parametrize(
    ("name", "similar_names"),
    [
        ("rafp", ["rapf"]),
        ("llyod", ["lloyd"]),
        ("loyd", ["lloyd"]),
        ("x", []),
        ("", []),
    ],
)
def test_transposed_letters_are_one_edit(name: str, similar_names: list[str]) -> None:
    assert errors.find_similar_names(name, ["rapf", "rpf", "lloyd"]) == similar_names


@pytest.mark.parametrize(
    ("bound", "text"),
    [
        (1e6, "1000000"),
        (2e7, "20000000"),
        (1e-6, "0.000001"),
        (0.25, "0.25"),
        (123456.7, "123456.7"),
        (1.5e-9, "0.0000000015"),
        (1e12, "1e+12"),
    ],
)
def test_only_tiny_and_huge_bounds_have_exponents(bound: float, text: str) -> None:
    assert errors.format_bound(bound) == text


def test_long_values_are_cut_in_messages() -> None:
    assert errors.quote([1.0] * 1000).endswith("...")
    assert len(errors.quote("x" * 1000)) == 60


def test_json_in_messages_keeps_its_letters_and_escapes_control_characters() -> None:
    assert errors.quote_json({"größe": "Φ"}) == '{"größe": "Φ"}'
    assert format_path(("starts", "große Halle")) == 'starts["große Halle"]'
    assert errors.quote_json("a\nb\u202ec\ud800") == r'"a\nb\u202ec\ud800"'
    assert format_path(("extra", "a b\u202e")) == r'extra["a b\u202e"]'


def test_values_that_are_not_json_are_described_in_messages() -> None:
    class Unprintable:
        def __repr__(self) -> str:
            raise RuntimeError

    cyclic: list[object] = [1]
    cyclic.append(cyclic)
    assert errors.quote_json(cyclic) == "[1, [...]]"
    assert errors.quote_json({(1, 2): 3}) == "{(1, 2): 3}"
    assert errors.quote_json(10**5000) == "<int>"
    assert errors.quote_json([Unprintable()]) == '["<Unprintable>"]'


def test_messages_about_strange_names_are_readable() -> None:
    message = errors.describe_unknown_name("controller", "x" * 1000, ["x" * 2000, "rapf"])
    assert len(message) < 250
    assert message.endswith("(known: rapf, " + "x" * 57 + "...)")
    assert errors.describe_unknown_name("start", "b", ["a\nb"]).endswith("(known: a\\nb)")


def test_the_first_issue_is_reported_and_the_others_are_counted() -> None:
    issues = [Issue.at_path(("boundary", k), "expected a point, got 3") for k in range(3)]
    assert str(MapError.from_issues("m.json", issues[:1])) == "m.json: boundary[0]: expected a point, got 3"
    error = MapError.from_issues("m.json", issues, 4)
    assert isinstance(error, MapError)
    assert str(error) == "m.json: boundary[0]: expected a point, got 3 (and 6 more issues)"
    assert error.issues == tuple(issues)
    assert (error.line, error.column) == (None, None)


def test_an_error_with_a_line_starts_like_those_of_compilers() -> None:
    error = MapError.from_issues("m.json", [Issue((), "empty", line=14, column=9)])
    assert str(error) == "m.json:14:9: empty"
    assert (error.line, error.column) == (14, 9)


def test_an_error_without_a_location_has_no_line() -> None:
    assert MapError("m.json: no such file").line is None
    assert MapError("m.json: no such file").issues == ()


def test_an_issue_of_the_whole_document_has_no_path() -> None:
    assert Issue.at_path((), "expected an object, got []").text == "expected an object, got []"


def test_keys_that_are_not_identifiers_are_quoted() -> None:
    assert format_path(("a b", "$schema", "x-y", 3, "")) == '["a b"].$schema.x-y[3][""]'


def test_long_keys_are_cut_in_messages() -> None:
    assert format_path(("a", "x" * 60, 1)) == f"a.{'x' * 60}[1]"
    assert format_path(("a", "x" * 61, 1)) == f'a["{"x" * 57}..."][1]'


ROOMS = rc.load_map("rooms")
ONE = [[1.0, 1.0]]
STILL = rc.Simulation(ROOMS, rc.Rapf(), ONE).run(0.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rc.CoverageCost("rooms"), "environment: expected a map, as in"),
        (lambda: rc.Simulation("rooms", rc.Rapf(), ONE), "environment: expected a map"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf(), "here"), "starts: expected [x, y] of each robot"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf(), ONE, 3), "team: expected a Team, got 3"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf(), ONE, conditions=3), "conditions: expected Conditions"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf(), ONE, dt="a"), "dt: expected a number from 0.0001 to 1 s"),
        (lambda: rc.TeamState(ONE, velocities="a"), "velocities: expected [x, y]"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf(), ONE).run("a"), "duration: expected a finite number"),
        (lambda: rc.CoverageCost(ROOMS, 4)([["a", 1]]), "positions: expected [x, y] of each robot"),
        (lambda: rc.Rapf(krep=1), "rapf: unknown gain 'krep': did you mean 'k_rep'?"),
        (lambda: rc.Team.homogeneous("a"), "robots: expected a whole number from 1 to 10000, got 'a'"),
        (lambda: rc.Team.homogeneous(20000), "robots: expected a whole number from 1 to 10000, got 20000"),
        (lambda: rc.Team.homogeneous(2, mass="a"), "team.mass: expected a number, got 'a'"),
        (lambda: rc.load_map(3), "map: expected a path, or the name of a bundled map, got 3"),
        (lambda: rc.Simulation(ROOMS, rc.Rapf, ONE), "controller: expected a controller"),
        (lambda: rc.make_controller(3), "controller: expected a name, as in 'rapf' or "),
        (lambda: rc.compute_cost_history("run", rc.CoverageCost(ROOMS, 4)), "record: expected a Record, "),
        (lambda: rc.compute_cost_history(STILL, ROOMS), "cost: expected a CoverageCost, got "),
        (
            lambda: ROOMS.start().sample(0),
            "start 'corridor': robots: expected a whole number of at least 1, got 0",
        ),
    ],
    ids=count(),
)  # fmt: skip
def test_issues_in_python_name_the_argument_and_what_was_expected(
    call: Callable[[], object], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        call()
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("values", [[[1j, 2]], np.array([[1j, 2]]), [np.array([1j, 2])]])
def test_complex_numbers_are_not_converted_to_real_ones(values: object) -> None:
    with pytest.raises(ParameterError, match=r"starts: expected \[x, y\] of each robot, got"):
        to_floats("starts", values, "[x, y] of each robot")


def test_a_package_whose_controller_cannot_be_loaded_causes_a_warning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    broken = EntryPoint("theirs", "no_such_module:Theirs", "robocov.controllers")
    monkeypatch.setattr("robocov.controllers.registry.entry_points", lambda group: [broken])
    with pytest.warns(UserWarning, match="controller 'theirs' of entry point"):
        assert "theirs" not in list_controller_classes()


def test_a_package_with_the_name_of_a_built_in_controller_causes_a_warning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    theirs = EntryPoint("rapf", "robocov.controllers.lloyd:Lloyd", "robocov.controllers")
    monkeypatch.setattr("robocov.controllers.registry.entry_points", lambda group: [theirs])
    with pytest.warns(
        UserWarning, match="'rapf' of entry point .* expected a name other than that of a built-in"
    ):
        assert list_controller_classes()["rapf"] is rc.Rapf


def test_the_nearest_name_of_the_package_is_known_to_python() -> None:
    with pytest.raises(AttributeError) as caught:
        rc.Rpaf  # type: ignore[attr-defined]
    assert caught.value.name == "Rpaf" and "Rapf" in dir(caught.value.obj)


def test_controllers_of_packages_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    theirs = EntryPoint("theirs", "robocov.controllers.lloyd:Lloyd", "robocov.controllers")
    monkeypatch.setattr("robocov.controllers.registry.entry_points", lambda group: [theirs])
    assert rc.list_controller_classes()["theirs"] is rc.Lloyd
