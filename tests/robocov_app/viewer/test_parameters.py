from __future__ import annotations

import math
from dataclasses import dataclass, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import IndividualControllerAdapter
from robocov.controllers.gains import Gain, gain, get_gains
from robocov.errors import ParameterError
from robocov.team import UNITS
from robocov_app.viewer.parameters import (
    NumberParameter,
    OptionParameter,
    list_gain_parameters,
    list_limit_parameters,
    replace_limit,
)
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.robot_properties import RobotProperties

LAWS = [ControllerChoice("rapf"), ControllerChoice("rpf"), ControllerChoice("lloyd")]
GAINS = [each for law in LAWS for each in list_gain_parameters(law)]
ALL = [
    each for each in [*GAINS, *list_limit_parameters(RobotProperties())] if isinstance(each, NumberParameter)
]


class Odd:
    """A law with any gains."""

    def __init__(self, **gains: Gain) -> None:
        self.available_gains = gains

    def get_value(self, name: str) -> float | None:
        return self.available_gains[name].default


def odd(default, low, high, *, optional=False) -> NumberParameter:
    (parameter,) = list_gain_parameters(Odd(k=Gain("k", default, "m", low, high, "", optional)))
    return parameter


def test_every_gain_has_its_slider():
    for law in LAWS:
        assert [each.name for each in list_gain_parameters(law)] == list(law.available_gains)
    rapf = {each.name: each for each in list_gain_parameters(ControllerChoice("rapf", {"k_rep": 0.7}))}
    assert (rapf["k_rep"].value, rapf["k_rep"].default) == (
        0.7,
        ControllerChoice("rapf").available_gains["k_rep"].default,
    )
    assert rapf["k_rep"].meaning


def test_gains_that_are_words_have_all_of_them():
    (picked,) = [
        each
        for each in list_gain_parameters(ControllerChoice("rapf", {"target": "median"}))
        if each.name == "target"
    ]
    assert isinstance(picked, OptionParameter)
    assert (picked.value, picked.default, picked.format()) == ("median", "centroid", "median")
    assert picked.choices == ("centroid", "sensing", "median")
    assert [picked.parse(text) for text in ("sensing", " Median ", "c", "SENS")] == [
        *("sensing", "median", "centroid", "sensing")
    ]
    for wrong in ("", "mediane", "x", "0.3"):
        with pytest.raises(
            ParameterError, match=r"target: expected one of centroid, sensing, median, got .*"
        ):
            picked.parse(wrong)
    for word in picked.choices:
        law = ControllerChoice("rapf").with_gain("target", word)
        assert law.get_value("target") == word
        assert law.gains == ({} if word == "centroid" else {"target": word})
    near = OptionParameter("n", "n", "", "on", "on", ("on", "once"))
    assert near.parse("on") == "on" and near.parse("onc") == "once"


def test_kinematics_are_a_track_width():
    unicycle = replace_limit(RobotProperties(radius=0.2), "team.kinematics", "unicycle")
    assert unicycle.build_team(range(1, 3)).track_width.tolist() == [pytest.approx(0.32)] * 2
    assert [each.value for each in list_limit_parameters(unicycle) if isinstance(each, OptionParameter)] == [
        "unicycle"
    ]
    assert replace_limit(unicycle, "kinematics", "point") == RobotProperties(radius=0.2)


def test_every_limit_but_the_mass_has_its_slider():
    names = [each.name for each in list_limit_parameters(RobotProperties())]
    of_unicycles = {"track_width", "turning_rate"}  # as the kinematics have them
    assert {name.removeprefix("team.") for name in names} == set(UNITS) - {"mass"} - of_unicycles | {
        "kinematics"
    }
    for each in list_limit_parameters(RobotProperties(sensing_range=math.inf, radius=0.3)):
        if each.name == "team.sensing_range":
            assert (each.value, each.default, each.is_optional) == (None, 3.0, True)
        if each.name == "team.radius":
            assert (each.value, each.default, each.is_optional, each.unit) == (0.3, 0.1, False, "m")
        if each.name == "team.communication_range":
            assert (each.value, each.default) == (None, None)


@pytest.mark.parametrize("parameter", ALL, ids=lambda each: each.name)
def test_all_that_a_slider_gives_is_taken(parameter):
    assert parameter.low < parameter.high
    before = -math.inf
    for k in range(101):
        value = parameter.compute_value(k / 100)
        if value is None:
            assert parameter.is_optional
            value = math.inf
        else:
            assert parameter.low <= value <= parameter.high
        assert value >= before
        before = value
        if parameter.name.startswith("team."):
            replace_limit(RobotProperties(), parameter.name, parameter.compute_value(k / 100)).build_team(
                range(1, 3)
            )
    for law in LAWS:
        if parameter in list_gain_parameters(law):
            for k in range(11):
                law.with_gain(parameter.name, parameter.compute_value(k / 10))


@pytest.mark.parametrize("parameter", ALL, ids=lambda each: each.name)
@given(place=st.floats(0.0, 1.0))
def test_there_and_back(parameter, place):
    value = parameter.compute_value(place)
    again = replace(parameter, value=value).compute_position()
    if value is None:
        assert again == 1.0
    else:
        # three digits
        assert again == pytest.approx(place, abs=2e-3)
        assert replace(parameter, value=value).compute_position() == pytest.approx(again)


@pytest.mark.parametrize("parameter", ALL, ids=lambda each: each.name)
@given(value=st.none() | st.floats(0.0, 1e9) | st.just(math.inf))
def test_any_value_has_a_place(parameter, value):
    place = replace(parameter, value=value).compute_position()
    assert 0.0 <= place <= 1.0
    if value is not None and math.isfinite(value) and parameter.is_optional:
        # short of "no limit"
        assert parameter.compute_value(place) is not None


def test_a_slider_reaches_as_far_as_the_gain():
    assert (odd(1.0, 0.0, 1e6).low, odd(1.0, 0.0, 1e6).high) == pytest.approx((1 / 30, 30.0))
    assert (odd(1.0, 0.5, 2.0).low, odd(1.0, 0.5, 2.0).high) == (0.5, 2.0)
    # none by default, and 1 is none of its values
    assert (odd(None, 50.0, 100.0, optional=True).low, odd(None, 50.0, 100.0, optional=True).high) == (
        50,
        100,
    )
    assert (odd(None, 0.1, 0.5, optional=True).low, odd(None, 0.1, 0.5, optional=True).high) == pytest.approx(
        (0.1, 0.5)
    )
    assert odd(0.0, 0.0, 1e6).low == pytest.approx(1 / 30)
    assert (odd(2.0, -1e12, 1e12).low, odd(2.0, -1e12, 1e12).high) == (-60.0, 60.0)
    assert (odd(-2.0, -5.0, -1.0).low, odd(-2.0, -5.0, -1.0).high) == (-5.0, -1.0)


@given(
    st.floats(-1e3, 1e3),
    st.floats(0.0, 1e3),
    st.floats(0.0, 1.0) | st.none(),
    st.booleans(),
    st.floats(0.0, 1.0),
)
def test_a_slider_never_leaves_the_range_of_its_gain(low, span, where, optional, place):
    high = low + span
    default = None if where is None else min(low + where * span, high)
    parameter = odd(default, low, high, optional=optional or default is None)
    value = parameter.compute_value(place)
    assert 0.0 <= parameter.compute_position() <= 1.0
    if value is not None and not (default == 0.0 or parameter.high <= parameter.low):
        assert low - 1e-9 <= value <= high + 1e-9


def test_negative_ranges_are_even():
    parameter = odd(2.0, -1e12, 1e12)
    assert parameter.compute_value(0.5) == 0.0
    assert replace(parameter, value=0.0).compute_position() == 0.5
    assert replace(parameter, value=-1e5).compute_position() == 0.0


def test_what_is_shown_can_be_typed():
    parameter = odd(0.125, 0.0, 10.0, optional=True)
    assert parameter.format() == "0.125"
    assert parameter.parse(parameter.format()) == 0.125
    none = replace(parameter, value=None)
    assert none.format() == "none"
    assert none.parse(none.format()) is None


@pytest.mark.parametrize("text", ["none", " None ", "null", "no limit", "inf", "∞", ""])
def test_no_limit_is_typed_in_many_ways(text):
    assert odd(1.0, 0.0, 9.0, optional=True).parse(text) is None


@pytest.mark.parametrize(("text", "value"), [("1.5", 1.5), (" 2 ", 2.0), ("0,25", 0.25), ("1e-3", 1e-3)])
def test_numbers_are_typed(text, value):
    assert odd(1.0, 0.0, 9.0).parse(text) == value


@pytest.mark.parametrize("text", ["", "none", "many", "1.2.3", "0x10", "--1"])
def test_what_is_no_number_is_refused(text):
    with pytest.raises(ParameterError, match=r"^k: expected a number, got .*$"):
        odd(1.0, 0.0, 9.0).parse(text)


def test_with_no_limit_allowed_the_message_says_so():
    with pytest.raises(ParameterError, match="expected a number, or none"):
        odd(1.0, 0.0, 9.0, optional=True).parse("many")


def test_limits_one_by_one():
    limits = replace_limit(RobotProperties(), "team.sensing_range", None)
    assert limits == RobotProperties(sensing_range=math.inf)
    assert replace_limit(limits, "radius", 0.2) == RobotProperties(radius=0.2, sensing_range=math.inf)
    with pytest.raises(ParameterError, match=r"team\.radius: expected a number .* got inf m"):
        replace_limit(limits, "radius", None).build_team(range(1, 2))


def test_gains_of_a_law_of_ones_own():
    @dataclass(frozen=True)
    class Mine:
        k: float = gain(1.0, "N/m", "stiffness")
        bias: float = 0.0

        def force(self, own):
            return (self.k, self.bias)

    assert IndividualControllerAdapter(Mine()).name == "Mine"
    k, bias = list_gain_parameters(Odd(**get_gains(Mine)))
    assert (k.low, k.high) == pytest.approx((1 / 30, 30.0))
    assert (bias.low, bias.high) == (-30.0, 30.0)
