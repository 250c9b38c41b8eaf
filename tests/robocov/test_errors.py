from __future__ import annotations

import pytest

from robocov import errors


def test_the_tree_of_errors() -> None:
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
        ("zzzz", "unknown controller 'zzzz' (known: lloyd, rapf, rpf)"),
    ],
)
def test_unknown_names_get_the_nearest(name: str, message: str) -> None:
    assert errors.unknown_name("controller", name, ["rapf", "rpf", "lloyd"]) == message


def test_long_values_are_cut_in_messages() -> None:
    assert errors.shown([1.0] * 1000).endswith("...")
    assert len(errors.shown("x" * 1000)) == 60


def test_strange_names_leave_messages_readable() -> None:
    message = errors.unknown_name("controller", "x" * 1000, ["x" * 2000, "rapf"])
    assert len(message) < 250
    assert message.endswith("(known: rapf, " + "x" * 57 + "...)")
    assert errors.unknown_name("start", "b", ["a\nb"]).endswith("(known: a\\nb)")
