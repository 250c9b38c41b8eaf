"""Gains and limits in the panel: sliders, typed values and menus."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import CONTROLLERS as CONTROLLER_CLASSES
from robocov.controllers import IndividualControllerAdapter
from robocov.controllers.gains import Gain, gain, get_gains
from robocov.errors import ParameterError
from robocov.team import UNITS
from robocov_app.viewer.panel.parameters import (
    NumberParameter,
    OptionParameter,
    list_gain_parameters,
    list_limit_parameters,
    replace_limit,
)
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

CONTROLLERS = [ControllerChoice("rapf"), ControllerChoice("rpf"), ControllerChoice("lloyd")]
GAINS = [parameter for controller in CONTROLLERS for parameter in list_gain_parameters(controller)]
LIMITS = list(list_limit_parameters(RobotProperties()))
NUMBERS = [parameter for parameter in (*GAINS, *LIMITS) if isinstance(parameter, NumberParameter)]


def build_choice(name: str, *choices: str) -> OptionParameter:
    """Build a parameter with choices, the first of which is the default."""
    return OptionParameter(
        name=name,
        label=name,
        symbol=name,
        meaning="",
        value=choices[0],
        default=choices[0],
        choices=choices,
    )


class StubController:
    """A controller with any gains, at their defaults."""

    name = "stub"

    def __init__(self, **gains: Gain) -> None:
        self.available_gains = gains

    def get_value(self, name: str) -> float | None:
        return self.available_gains[name].default


def build_parameter(
    default: float | None, low: float, high: float, *, optional: bool = False
) -> NumberParameter:
    """Build the parameter of a gain with a range."""
    gains = {"k": Gain("k", default, "m", low, high, "", optional)}
    (parameter,) = list_gain_parameters(StubController(**gains))
    return parameter


def get_range(parameter: NumberParameter) -> tuple[float, float]:
    return parameter.low, parameter.high


def test_every_gain_has_a_parameter():
    for controller in CONTROLLERS:
        names = [parameter.name for parameter in list_gain_parameters(controller)]
        assert names == list(controller.available_gains)
    parameters = list_gain_parameters(ControllerChoice("rapf", {"k_rep": 0.7}))
    (k_rep,) = [parameter for parameter in parameters if parameter.name == "k_rep"]
    assert k_rep.value == 0.7
    assert k_rep.default == ControllerChoice("rapf").available_gains["k_rep"].default
    assert k_rep.meaning


def test_gains_with_choices_are_options():
    parameters = list_gain_parameters(ControllerChoice("rapf", {"target": "median"}))
    (target,) = [parameter for parameter in parameters if parameter.name == "target"]
    assert isinstance(target, OptionParameter)
    assert target.value == "median"
    assert target.default == "centroid"
    assert target.format() == "median"
    assert target.choices == ("centroid", "sensing", "median")
    for choice in target.choices:
        controller = ControllerChoice("rapf").with_gain("target", choice)
        assert controller.get_value("target") == choice
        assert controller.gains == ({} if choice == "centroid" else {"target": choice})


@pytest.mark.parametrize(
    ("text", "choice"),
    [("sensing", "sensing"), (" Median ", "median"), ("c", "centroid"), ("SENS", "sensing")],
)
def test_the_start_of_a_choice_can_be_typed(text, choice):
    target = build_choice("target", "centroid", "sensing", "median")
    assert target.parse(text) == choice


@pytest.mark.parametrize("text", ["", "mediane", "x", "0.3"])
def test_unknown_choices_are_rejected(text):
    target = build_choice("target", "centroid", "sensing", "median")
    with pytest.raises(ParameterError, match=r"target: expected one of centroid, sensing, median, got .*"):
        target.parse(text)


def test_a_choice_may_be_the_start_of_another():
    parameter = build_choice("n", "on", "once")
    assert parameter.parse("on") == "on"
    assert parameter.parse("onc") == "once"


def test_the_kinematics_set_the_track_width():
    unicycle = replace_limit(RobotProperties(radius=0.2), "team.kinematics", "unicycle")
    assert unicycle.build_team(range(1, 3)).track_width.tolist() == [pytest.approx(0.32)] * 2
    options = [item for item in list_limit_parameters(unicycle) if isinstance(item, OptionParameter)]
    assert [option.value for option in options] == ["unicycle"]
    assert replace_limit(unicycle, "kinematics", "point") == RobotProperties(radius=0.2)


def test_every_limit_but_the_mass_has_a_parameter():
    names = {parameter.name.removeprefix("team.") for parameter in LIMITS}
    # The kinematics stand for the properties of unicycles.
    assert names == set(UNITS) - {"mass", "track_width", "turning_rate"} | {"kinematics"}


def test_limits_have_values_and_defaults():
    properties = RobotProperties(sensing_range=math.inf, radius=0.3)
    limits = {parameter.name: parameter for parameter in list_limit_parameters(properties)}
    sensing_range = limits["team.sensing_range"]
    assert sensing_range.value is None
    assert sensing_range.default == 3.0
    assert sensing_range.is_optional
    radius = limits["team.radius"]
    assert radius.value == 0.3
    assert radius.default == 0.1
    assert radius.unit == "m"
    assert not radius.is_optional
    communication_range = limits["team.communication_range"]
    assert communication_range.value is None
    assert communication_range.default is None


@pytest.mark.parametrize("parameter", NUMBERS, ids=lambda parameter: parameter.name)
def test_all_values_of_a_slider_are_valid(parameter):
    assert parameter.low < parameter.high
    previous = -math.inf
    for k in range(101):
        value = parameter.compute_value(k / 100)
        if parameter.name.startswith("team."):
            replace_limit(RobotProperties(), parameter.name, value).build_team(range(1, 3))
        if value is None:
            assert parameter.is_optional
            value = math.inf
        else:
            assert parameter.low <= value <= parameter.high
        assert value >= previous
        previous = value
    for controller in CONTROLLERS:
        if parameter in list_gain_parameters(controller):
            for k in range(11):
                controller.with_gain(parameter.name, parameter.compute_value(k / 10))


@pytest.mark.parametrize("parameter", NUMBERS, ids=lambda parameter: parameter.name)
@given(position=st.floats(0.0, 1.0))
def test_the_position_of_a_slider_is_recovered_from_its_value(parameter, position):
    value = parameter.compute_value(position)
    recovered = replace(parameter, value=value).compute_position()
    if value is None:
        assert recovered == 1.0
    else:
        # Values are rounded to three digits.
        assert recovered == pytest.approx(position, abs=2e-3)


@pytest.mark.parametrize("parameter", NUMBERS, ids=lambda parameter: parameter.name)
@given(value=st.none() | st.floats(0.0, 1e9) | st.just(math.inf))
def test_any_value_has_a_position(parameter, value):
    position = replace(parameter, value=value).compute_position()
    assert 0.0 <= position <= 1.0
    if value is not None and math.isfinite(value) and parameter.is_optional:
        # The right end of the slider is for no limit.
        assert parameter.compute_value(position) is not None


@pytest.mark.parametrize("name", sorted(CONTROLLER_CLASSES))
def test_sliders_of_whole_numbers_have_only_whole_numbers(name):
    controller = ControllerChoice(name)
    for parameter in list_gain_parameters(controller):
        if isinstance(parameter, NumberParameter) and parameter.is_whole:
            for k in range(11):
                controller.with_gain(parameter.name, parameter.compute_value(k / 10))
            if parameter.slider_step:
                # An arrow key leads from each value to the next one.
                first = replace(parameter, value=parameter.low)
                position = first.compute_position() + parameter.slider_step
                assert parameter.compute_value(position) == parameter.low + 1.0


def test_the_slider_of_a_whole_number_reaches_a_minimum_of_zero():
    parameters = list_gain_parameters(ControllerChoice("boosting"))
    boosts = next(parameter for parameter in parameters if parameter.name == "boosts")
    assert boosts.compute_value(0.0) == 0.0
    assert boosts.compute_value(boosts.slider_step) == 1.0


def test_large_whole_numbers_are_shown_in_full():
    parameters = list_gain_parameters(ControllerChoice("poduri", {"neighbors": 100.0}))
    neighbors = next(parameter for parameter in parameters if parameter.name == "neighbors")
    assert neighbors.format() == "100"
    assert replace(neighbors, value=48000.0).format() == "48000"


def test_the_range_of_a_slider_is_around_the_default():
    assert get_range(build_parameter(1.0, 0.0, 1e6)) == pytest.approx((1 / 30, 30.0))
    assert get_range(build_parameter(1.0, 0.5, 2.0)) == (0.5, 2.0)
    assert get_range(build_parameter(-2.0, -5.0, -1.0)) == (-5.0, -1.0)
    assert get_range(build_parameter(2.0, -1e12, 1e12)) == (-60.0, 60.0)
    assert build_parameter(0.0, 0.0, 1e6).low == pytest.approx(1 / 30)


def test_the_range_of_a_slider_without_default_is_that_of_the_gain():
    assert get_range(build_parameter(None, 50.0, 100.0, optional=True)) == (50.0, 100.0)
    assert get_range(build_parameter(None, 0.1, 0.5, optional=True)) == pytest.approx((0.1, 0.5))


@given(
    st.floats(-1e3, 1e3),
    st.floats(0.0, 1e3),
    st.floats(0.0, 1.0) | st.none(),
    st.booleans(),
    st.floats(0.0, 1.0),
)
def test_a_slider_stays_in_the_range_of_its_gain(low, span, fraction, optional, position):
    high = low + span
    default = None if fraction is None else min(low + fraction * span, high)
    parameter = build_parameter(default, low, high, optional=optional or default is None)
    value = parameter.compute_value(position)
    assert 0.0 <= parameter.compute_position() <= 1.0
    if value is not None and not (default == 0.0 or parameter.high <= parameter.low):
        assert low - 1e-9 <= value <= high + 1e-9


def test_sliders_with_negative_values_are_linear():
    parameter = build_parameter(2.0, -1e12, 1e12)
    assert parameter.compute_value(0.5) == 0.0
    assert replace(parameter, value=0.0).compute_position() == 0.5
    assert replace(parameter, value=-1e5).compute_position() == 0.0


def test_displayed_values_can_be_typed():
    parameter = build_parameter(0.125, 0.0, 10.0, optional=True)
    assert parameter.format() == "0.125"
    assert parameter.parse(parameter.format()) == 0.125
    unlimited = replace(parameter, value=None)
    assert unlimited.format() == "unlimited"
    assert unlimited.parse("unlimited") is None


@pytest.mark.parametrize("text", ["unlimited", "none", " None ", "null", "no limit", "inf", "∞", ""])
def test_no_limit_can_be_typed_in_several_ways(text):
    assert build_parameter(1.0, 0.0, 9.0, optional=True).parse(text) is None


@pytest.mark.parametrize(("text", "value"), [("1.5", 1.5), (" 2 ", 2.0), ("0,25", 0.25), ("1e-3", 1e-3)])
def test_numbers_are_typed(text, value):
    assert build_parameter(1.0, 0.0, 9.0).parse(text) == value


@pytest.mark.parametrize("text", ["", "none", "many", "1.2.3", "0x10", "--1"])
def test_invalid_numbers_are_rejected(text):
    with pytest.raises(ParameterError, match=r"^K: expected a number, got .*$"):
        build_parameter(1.0, 0.0, 9.0).parse(text)


def test_the_message_for_optional_gains_names_the_way_to_have_no_limit():
    with pytest.raises(ParameterError, match="expected a number, or unlimited"):
        build_parameter(1.0, 0.0, 9.0, optional=True).parse("many")


def test_single_limits_are_replaced():
    limits = replace_limit(RobotProperties(), "team.sensing_range", None)
    assert limits == RobotProperties(sensing_range=math.inf)
    assert replace_limit(limits, "radius", 0.2) == RobotProperties(radius=0.2, sensing_range=math.inf)
    with pytest.raises(ParameterError, match=r"team\.radius: expected a number .* got inf m"):
        replace_limit(limits, "radius", None).build_team(range(1, 2))


def test_user_controllers_have_parameters():
    @dataclass(frozen=True)
    class Mine:
        k: float = gain(1.0, "N/m", "stiffness")
        bias: float = 0.0

        def force(self, own):
            return (self.k, self.bias)

    assert IndividualControllerAdapter(Mine()).name == "Mine"
    k, bias = list_gain_parameters(StubController(**get_gains(Mine)))
    assert get_range(k) == pytest.approx((1 / 30, 30.0))
    assert get_range(bias) == (-30.0, 30.0)
