"""Parameters of the panel: gains of a controller and limits of the team, as sliders or choices."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

from robocov.controllers.gains import Gain, Option, Value
from robocov.errors import ParameterError, quote
from robocov.team import DEFAULT_TRACK_PER_RADIUS, KINEMATICS, POINT, UNICYCLE, UNITS
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

SLIDER_SPAN = 30.0  # a slider ranges from 1 / 30 of the default to 30 times the default
MAX_LINEAR_STEPS = 100  # the slider of a whole number with at most this many steps is linear
NO_LIMIT_POSITION = 0.985  # beyond this position the slider of an optional parameter means "no limit"
NO_LIMIT_TEXTS = ("unlimited", "none", "null", "no limit", "inf", "∞", "")
MAX_BASIC_GAINS = 4
"""Number of numeric gains of a controller that are always visible; the others are advanced."""
GAIN_LABELS: Mapping[str, str] = MappingProxyType(
    {
        "k_rep": "Repulsion strength",
        "rho_0": "Repulsion range",
        "k_att": "Attraction strength",
        "attraction_limit": "Attraction limit",
        "cells": "Cells by",
        "target": "Goal",
        "height": "Sensor height",
        "k_prop": "Approach speed",
        "response_time": "Response time",
        "period": "Planning interval",
        "threshold": "Minimum saving",
        "nearby": "Minimum saving nearby",
        "rest": "Minimum saving of a goal",
        "stake": "Viewpoint stake",
        "patience": "Patience",
        "settling": "Settling path",
        "clearance": "Clearance",
        "k_robots": "Repulsion of robots",
        "k_obs": "Repulsion of obstacles",
        "friction": "Friction",
        "neighbors": "Neighbors kept",
        "link_range": "Link range",
        "k_cover": "Spreading strength",
        "eta": "Balance distance",
        "rho_obs": "Obstacle range",
        "reach": "Spreading distance",
        "k_disperse": "Spreading speed",
        "explore_speed": "Exploring speed",
        "k_avoid": "Avoidance speed",
        "interaction_range": "Interaction range",
        "jump": "Depth step",
        "detour": "Longest detour",
        "moved": "Retry distance",
        "safe_gap": "Safe gap",
        "gamma": "Barrier rate",
        "boosting.gamma": "Boost exponent",
        "braking": "Braking fraction",
        "exponent": "Distance exponent",
        "lattice": "Lattice cells",
        "k_area": "Area gain",
        "decay": "Detection decay",
        "boost": "Boosting by",
        "kappa": "Boost factor",
        "boosts": "Maximum boosts",
        "boosting.patience": "Boost duration",
        "k_grad": "Gradient gain",
        "estimate": "Density model",
        "basis": "Basis functions",
        "prior": "Prior density",
        "min_density": "Minimum density",
        "learning": "Learning rate",
        "consensus": "Consensus rate",
        "coupling": "Coupling",
        "correlation": "Correlation length",
        "explore": "Exploration bonus",
        "squares": "Squares per side",
        "exploration": "Exploration limit",
        "shrink": "Obstacle stiffness",
        "nodes": "Maximum nodes",
        "beta": "Path cost",
        "shortest": "Minimum frontier",
    }
)
"""Name of each gain in everyday words, by its name or by those of a controller and a gain."""


class _LimitSlider(NamedTuple):
    label: str
    meaning: str
    low: float
    high: float
    is_advanced: bool


_KINEMATIC = "kinematic limit, the same for every controller"
_LIMITS = {
    "max_speed": _LimitSlider("Maximum speed", _KINEMATIC, 0.1, 10.0, is_advanced=False),
    "sensing_range": _LimitSlider(
        "Sensing range",
        "range of the obstacle sensor, from the robot's center",
        0.2,
        30.0,
        is_advanced=False,
    ),
    "communication_range": _LimitSlider(
        "Communication range",
        "distance within which robots receive each other's messages",
        0.5,
        50.0,
        is_advanced=False,
    ),
    "radius": _LimitSlider("Radius", "radius of a robot", 0.02, 1.0, is_advanced=False),
    "max_acceleration": _LimitSlider("Acceleration", _KINEMATIC, 0.1, 20.0, is_advanced=True),
    "viscosity": _LimitSlider("Viscosity", "ν of (28): slows robots down", 0.1, 20.0, is_advanced=True),
}
_KINEMATICS_MEANING = (
    "a point moves in any direction; a unicycle has two driven wheels, and has to turn first"
)


@dataclass(frozen=True)
class NumberParameter:
    """A parameter whose value is a number, with a slider.

    Attributes
    ----------
    name : str
        Name of a gain; for a limit, its name with the prefix ``team.``.
    label : str
        Name in the panel.
    symbol : str
        Short name as it is typed and as it is in files.
    unit : str
        Unit; empty for none.
    meaning : str
        Meaning of the parameter, for the tooltip.
    value, default : float or None
        Current and default value; None for no limit.
    low, high : float
        Values at the ends of the slider; typed values may lie outside.
    is_optional : bool
        Whether "no limit" is a possible value.
    is_advanced : bool
        Whether it is rarely used.
    is_whole : bool
        Whether only whole numbers are possible values.
    """

    name: str
    label: str
    symbol: str
    unit: str
    meaning: str
    value: float | None
    default: float | None
    low: float
    high: float
    is_optional: bool
    is_advanced: bool
    is_whole: bool = False

    @property
    def choices(self) -> tuple[str, ...]:
        """No values, because there are too many to list."""
        return ()

    @property
    def is_unlimited(self) -> bool:
        """Whether the current value is "no limit"."""
        return self.value is None or math.isinf(self.value)

    @property
    def slider_step(self) -> float:
        """Distance between the possible positions of the slider; 0 if any position is possible."""
        if self.is_whole and 0.0 < self.high - self.low <= MAX_LINEAR_STEPS:
            return 1.0 / (self.high - self.low)
        return 0.0

    @property
    def is_linear(self) -> bool:
        """Whether the scale of the slider is linear; otherwise it is logarithmic."""
        return self.low <= 0.0 or self.slider_step > 0.0

    def compute_position(self) -> float:
        """Return the position of the slider, 0 to 1."""
        if self.is_unlimited or self.value is None:
            return 1.0
        position = 0.0
        if self.high > self.low:
            if self.is_linear:
                position = (self.value - self.low) / (self.high - self.low)
            elif self.value > 0.0:
                position = math.log(self.value / self.low) / math.log(self.high / self.low)
        highest = NO_LIMIT_POSITION if self.is_optional else 1.0
        return min(max(position, 0.0), highest)

    def compute_value(self, position: float) -> float | None:
        """Return the value at a position of the slider; None for no limit.

        The value is rounded to three digits, and to a whole number if only these are possible.
        """
        if self.is_optional and position > NO_LIMIT_POSITION:
            return None
        if self.is_linear:
            value = self.low + position * (self.high - self.low)
        else:
            value = self.low * (self.high / self.low) ** position
        value = float(f"{value:.3g}")
        if self.is_whole:
            value = float(round(value))
        return min(max(value, self.low), self.high)

    def format(self) -> str:
        """Format the value, without its unit."""
        if self.is_unlimited:
            return "unlimited"
        if self.is_whole:
            return f"{self.value:.0f}"
        return f"{self.value:.4g}"

    def parse(self, text: str) -> float | None:
        """Convert typed text to a value; None for no limit.

        Raises
        ------
        ParameterError
            If it is not a number.
        """
        plain = text.strip().lower().replace(",", ".")
        if self.is_optional and plain in NO_LIMIT_TEXTS:
            return None
        try:
            return float(plain)
        except ValueError:
            alternative = ", or unlimited" if self.is_optional else ""
            message = f"{self.label}: expected a number{alternative}, got {quote(text)}"
            raise ParameterError(message) from None


@dataclass(frozen=True)
class OptionParameter:
    """A parameter whose value is one of several choices.

    Attributes
    ----------
    name, label, symbol, meaning : str
        As in `NumberParameter`.
    value, default : str
        Current and default value.
    choices : tuple of str
        All possible values.
    is_advanced : bool
        Whether it is rarely used.
    """

    name: str
    label: str
    symbol: str
    meaning: str
    value: str
    default: str
    choices: tuple[str, ...]
    is_advanced: bool = True

    def format(self) -> str:
        """Return the value."""
        return self.value

    def parse(self, text: str) -> str:
        """Return the choice that equals the typed text, or the only one that starts with it.

        Raises
        ------
        ParameterError
            If no choice matches, or several do.
        """
        plain = text.strip().lower()
        matches = [choice for choice in self.choices if plain and choice.lower().startswith(plain)]
        exact = [choice for choice in matches if choice.lower() == plain]
        if exact:
            return exact[0]
        if len(matches) == 1:
            return matches[0]
        raise ParameterError(f"{self.label}: expected one of {', '.join(self.choices)}, got {quote(text)}")


Parameter = NumberParameter | OptionParameter


def list_gain_parameters(controller: ControllerChoice) -> Iterator[Parameter]:
    """Yield a parameter for each gain; numeric ones after the first `MAX_BASIC_GAINS` are advanced."""
    number_count = 0
    for name, gain in controller.available_gains.items():
        value = controller.get_value(name)
        label = label_gain(name, controller.name)
        if isinstance(gain, Option):
            word = value if isinstance(value, str) else gain.default
            yield OptionParameter(
                name=name,
                label=label,
                symbol=name,
                meaning=gain.meaning,
                value=word,
                default=gain.default,
                choices=gain.choices,
            )
        else:
            number_count += 1
            is_advanced = number_count > MAX_BASIC_GAINS
            yield _build_gain_parameter(name, label, gain, value, is_advanced=is_advanced)


def label_gain(name: str, controller: str = "") -> str:
    """Return the name of a gain in everyday words.

    Parameters
    ----------
    name : str
        Name of the gain in code and files.
    controller : str
        Name of the controller.

    Returns
    -------
    str

    Examples
    --------
    >>> label_gain("k_rep"), label_gain("patience", "boosting"), label_gain("my_gain")
    ('Repulsion strength', 'Boost duration', 'My gain')
    """
    general_label = GAIN_LABELS.get(name, name.replace("_", " ").capitalize())
    return GAIN_LABELS.get(f"{controller}.{name}", general_label)


def _build_gain_parameter(
    name: str, label: str, gain: Gain, value: Value, *, is_advanced: bool
) -> NumberParameter:
    """Build the parameter for a numeric gain, with a slider range around its default value."""
    reference_value = min(max(gain.default or 1.0, gain.low), gain.high)
    if reference_value > 0 and gain.low >= 0:
        lowest = reference_value / SLIDER_SPAN
    else:
        lowest = -SLIDER_SPAN * abs(reference_value)
    low = max(gain.low, lowest)
    high = min(gain.high, SLIDER_SPAN * abs(reference_value))
    if gain.whole:
        # Rounded down, so that the slider reaches a minimum of 0.
        low = float(max(math.ceil(gain.low), math.floor(low)))
        high = float(math.floor(high))
    return NumberParameter(
        name=name,
        label=label,
        symbol=name,
        unit=gain.unit,
        meaning=gain.meaning,
        value=None if isinstance(value, str) else value,
        default=gain.default,
        low=low,
        high=high,
        is_optional=gain.optional,
        is_advanced=is_advanced,
        is_whole=gain.whole,
    )


def list_limit_parameters(limits: RobotProperties) -> Iterator[Parameter]:
    """Yield a parameter for each limit of a team, and one for its kinematics."""
    defaults = RobotProperties()
    for name, slider in _LIMITS.items():
        label = slider.label
        meaning = slider.meaning
        if name in limits.values_by_robot:
            label += " ≠"
            meaning += "; robots differ in it until it is set here"
        yield NumberParameter(
            name=f"team.{name}",
            label=label,
            symbol=name,
            unit=UNITS[name],
            meaning=meaning,
            value=_drop_infinity(getattr(limits, name)),
            default=_drop_infinity(getattr(defaults, name)),
            low=slider.low,
            high=slider.high,
            is_optional=name.endswith("_range"),
            is_advanced=slider.is_advanced,
        )
    # Only unicycles have a track width.
    kinematics = UNICYCLE if limits.track_width > 0.0 else POINT
    yield OptionParameter(
        name="team.kinematics",
        label="Kinematics",
        symbol="kinematics",
        meaning=_KINEMATICS_MEANING,
        value=kinematics,
        default=POINT,
        choices=KINEMATICS,
    )


def _drop_infinity(value: float) -> float | None:
    if math.isinf(value):
        return None
    return value


def replace_limit(limits: RobotProperties, name: str, value: float | str | None) -> RobotProperties:
    """Replace the value of one limit for all robots.

    Parameters
    ----------
    limits : RobotProperties
        Current limits.
    name : str
        The limit, with or without ``team.``; ``kinematics`` for one of `KINEMATICS`.
    value : float, str or None
        The new value; None for no limit.

    Returns
    -------
    RobotProperties
    """
    name = name.removeprefix("team.")
    if name == "kinematics":
        is_unicycle = value == UNICYCLE
        name = "track_width"
        value = DEFAULT_TRACK_PER_RADIUS * limits.radius if is_unicycle else 0.0
    number = math.inf if value is None else float(value)
    # Values of single robots that differ from the others are dropped for this limit.
    values_by_robot = {key: values for key, values in limits.values_by_robot.items() if key != name}
    return replace(limits, **{name: number}, values_by_robot=values_by_robot)
