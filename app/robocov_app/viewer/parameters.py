"""Parameters of the panel's sliders and words: gains of a controller, limits of the team. Knows no pygame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from robocov.controllers.gains import Option
from robocov.errors import ParameterError, quote
from robocov.team import DEFAULT_TRACK_PER_RADIUS, KINEMATICS, UNITS
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.robot_properties import RobotProperties

SPAN = 30.0  # a slider reaches from so many times less than the default to so many times more
_END = 0.985  # from here on a slider says "no limit" where there may be none
_KINEMATIC = "kinematic limit, the same for every controller"
_SENSES = "how far the range sensor sees obstacles, from the robot's centre"
_KINDS = "a point moves in any direction, a unicycle has two driven wheels and has to turn"
_LIMITS = {  # label, meaning and ends of the slider of each limit
    "max_speed": ("largest speed", _KINEMATIC, (0.1, 10.0)),
    "max_acceleration": ("acceleration", _KINEMATIC, (0.1, 20.0)),
    "viscosity": ("viscosity ν", "ν of (28): what slows robots down", (0.1, 20.0)),
    "sensing_range": ("sensing", _SENSES, (0.2, 30.0)),
    "communication_range": ("communication", "how far robots hear each other", (0.5, 50.0)),
    "radius": ("radius", "radius of a robot", (0.02, 1.0)),
}


@dataclass(frozen=True)
class Parameter:
    """One slider; where there may be no limit, None is none."""

    name: str  # a gain, or ``team.`` and a limit
    label: str
    unit: str
    meaning: str
    value: float | None
    default: float | None
    low: float  # here the slider ends; typed values may go further
    high: float
    optional: bool

    def place(self) -> float:
        """Return where the slider stands, 0 to 1: logarithmic, so that halves and doubles are as far."""
        if self.value is None or math.isinf(self.value):
            return 1.0
        part = 0.0
        if self.low <= 0.0 and self.high > self.low:
            part = (self.value - self.low) / (self.high - self.low)
        elif self.value > 0.0 and self.high > self.low:
            part = math.log(self.value / self.low) / math.log(self.high / self.low)
        return min(max(part, 0.0), _END if self.optional else 1.0)

    def at(self, place: float) -> float | None:
        if self.optional and place > _END:
            return None
        low, high = self.low, self.high
        value = low + place * (high - low) if low <= 0.0 else low * (high / low) ** place
        return min(max(float(f"{value:.3g}"), self.low), self.high)

    def words(self) -> str:
        return "none" if self.value is None or math.isinf(self.value) else f"{self.value:.4g}"

    def read(self, text: str) -> float | None:
        plain = text.strip().lower().replace(",", ".")
        if self.optional and plain in ("none", "null", "no limit", "inf", "∞", ""):
            return None
        try:
            return float(plain)
        except ValueError:
            also = ", or none" if self.optional else ""
            raise ParameterError(f"{self.label}: expected a number{also}, got {quote(text)}") from None


@dataclass(frozen=True)
class Pick:
    """One of several words, which stand side by side."""

    name: str
    label: str
    meaning: str
    value: str
    default: str
    offered: tuple[str, ...]

    def words(self) -> str:
        return self.value

    def read(self, text: str) -> str:
        plain = text.strip().lower()
        begun = [word for word in self.offered if plain and word.lower().startswith(plain)]
        found = [word for word in begun if word.lower() == plain] or begun
        if len(found) != 1:
            wanted = f"expected one of {', '.join(self.offered)}"
            raise ParameterError(f"{self.label}: {wanted}, got {quote(text)}")
        return found[0]


def gain_parameters(law: ControllerChoice) -> Iterator[Parameter | Pick]:
    for name, gain in law.available_gains.items():
        value = law.get_value(name)
        if isinstance(gain, Option):
            word = value if isinstance(value, str) else gain.default
            yield Pick(name, name, gain.meaning, word, gain.default, gain.choices)
            continue
        number = None if isinstance(value, str) else value
        usual = min(max(gain.default if gain.default else 1.0, gain.low), gain.high)
        lowest = usual / SPAN if usual > 0 and gain.low >= 0 else -SPAN * abs(usual)
        low, high = max(gain.low, lowest), min(gain.high, SPAN * abs(usual))
        yield Parameter(name, name, gain.unit, gain.meaning, number, gain.default, low, high, gain.optional)


def limit_parameters(limits: RobotProperties) -> Iterator[Parameter | Pick]:
    usual, kind = RobotProperties(), KINEMATICS[limits.track_width > 0.0]
    for name, (label, meaning, ends) in _LIMITS.items():
        if name in limits.different:
            label, meaning = f"{label} ≠", f"{meaning}; robots differ in it until it is set here"
        values = getattr(limits, name), getattr(usual, name)
        value, default = (None if math.isinf(each) else each for each in values)
        ranged = name.endswith("_range")
        yield Parameter(f"team.{name}", label, UNITS[name], meaning, value, default, *ends, optional=ranged)
    yield Pick("team.kinematics", "kinematics", _KINDS, kind, KINEMATICS[0], KINEMATICS)


def with_limit(limits: RobotProperties, name: str, value: float | str | None) -> RobotProperties:
    name = name.removeprefix("team.")
    if name == "kinematics":
        is_unicycle = value == KINEMATICS[1]
        name = "track_width"
        value = DEFAULT_TRACK_PER_RADIUS * limits.radius if is_unicycle else 0.0
    number = math.inf if value is None else float(value)
    # set for all: what robots had of their own is gone
    different = {each: values for each, values in limits.different.items() if each != name}
    return replace(limits, **{name: number}, different=different)
