"""Gains of a controller: numbers with a unit and a range, or words to choose from, as dataclass fields."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar, TypeAlias

from robocov.controllers.user_modules import explain_fault
from robocov.errors import ParameterError, RobocovError, describe_unknown_name, is_number, quote

Value: TypeAlias = float | str | None
"""Value of a gain: a number, None for no limit, or one of the words of an `Option`."""


def format_value(value: Value, *, digits: int = 6, none: str = "none") -> str:
    """Return a value as people write it: a number to so many digits, `none` for no limit.

    >>> format_value(0.30000001), format_value(None), format_value("median")
    ('0.3', 'none', 'median')
    """
    if value is None:
        return none
    return value if isinstance(value, str) else f"{value:.{digits}g}"


@dataclass(frozen=True)
class Gain:
    """A gain that is a number from `low` to `high`, or, where it is `optional`, None for no limit."""

    name: str
    default: float | None
    unit: str
    low: float
    high: float
    meaning: str
    optional: bool = False
    whole: bool = False

    def validate(self, value: object, where: str) -> float | None:
        """Return `value` as the gain takes it, or raise a ParameterError that names `where`."""
        if value is None and self.optional:
            return None
        inside = is_number(value) and self.low <= value <= min(self.high, sys.float_info.max)
        if is_number(value) and inside and (not self.whole or value == int(value)):
            return float(value)
        what = f"a {'whole ' if self.whole else ''}number from {self.low:g} to {self.high:g} {self.unit}"
        also = ", or null for no limit," if self.optional else ""
        raise ParameterError(f"{where}.{self.name}: {quote(value)}, but {what.rstrip()}{also} was wanted")


@dataclass(frozen=True)
class Option:
    """A gain that is one of several words."""

    name: str
    default: str
    words: tuple[str, ...]
    meaning: str
    unit: ClassVar[str] = ""
    optional: ClassVar[bool] = False

    def validate(self, value: object, where: str) -> str:
        """Return `value` when it is one of the words, or raise a ParameterError that names `where`."""
        if isinstance(value, str) and value in self.words:
            return value
        told = f"{quote(value)}, but one of {', '.join(self.words)} was wanted"
        if isinstance(value, str):
            told = describe_unknown_name("word", value, self.words)
        raise ParameterError(f"{where}.{self.name}: {told}")


def gain(
    default: float | None, unit: str, meaning: str, *,
    low: float = 0.0, high: float = 1e6, optional: bool = False, whole: bool = False,
) -> Any:  # fmt: skip
    """Declare a gain as a dataclass field.

    >>> @dataclass(frozen=True)
    ... class Mine:
    ...     k: float = gain(1.0, "N/m", "stiffness")
    >>> get_gains(Mine)["k"].unit
    'N/m'
    """
    known = Gain("", default, unit, low, high, meaning, optional, whole)
    return field(default=default, metadata={"gain": known})


def response_time_gain() -> Any:
    """Declare the gain that says how fast a law drives its robots to the velocities that it wants."""
    return gain(0.1, "s", "time constant with which the wanted velocity is reached", low=0.02, high=10.0)


def choice(default: str, words: Sequence[str], meaning: str) -> Any:
    """Declare a gain that is one of several words as a dataclass field."""
    if default not in words:
        raise ValueError(f"default {default!r}, but one of {', '.join(words)} was wanted")
    return field(default=default, metadata={"gain": Option("", default, tuple(words), meaning)})


def get_gains(controller: Any) -> dict[str, Gain | Option]:
    """Return the gains of a controller class or instance by name, in their order of declaration.

    One that is no dataclass has none; a plain number of a user's dataclass is a gain of any value.
    """
    found: dict[str, Gain | Option] = {}
    for each in fields(controller) if is_dataclass(controller) else ():
        known = each.metadata.get("gain")
        default = None if each.default is MISSING else each.default
        if known is not None:
            # 1 is a unit in formulas, and nothing behind a number
            unit = {"unit": ""} if known.unit == "1" else {}
            found[each.name] = replace(known, name=each.name, default=default, **unit)
        elif is_number(default):
            found[each.name] = Gain(each.name, default, "", -1e12, 1e12, "")
    return found


def get_gain_values(controller: Any) -> dict[str, Value]:
    """Return the values of the gains of a controller instance."""
    return {name: getattr(controller, name) for name in get_gains(controller)}


def validate_gains(controller: Any) -> None:
    """Check every gain of a controller instance, or raise a ParameterError, from ``__post_init__``."""
    where = getattr(controller, "name", type(controller).__name__)
    for name, known in get_gains(controller).items():
        object.__setattr__(controller, name, known.validate(getattr(controller, name), where))


def instantiate_controller(kind: type[Any], values: Mapping[str, object]) -> Any:
    """Return an instance of the controller class `kind` with the given gains.

    A ParameterError tells of an unknown gain (with the nearest name), a value out of range, or a fault in it.
    """
    known, where = get_gains(kind), getattr(kind, "name", kind.__name__)
    for name in values:
        if name not in known:
            nothing = f"{where}.{name}: controller {where!r} has no gains"
            raise ParameterError(
                f"{where}: {describe_unknown_name('gain', name, known)}" if known else nothing
            )
    given = {name: known[name].validate(value, where) for name, value in values.items()}
    try:
        return kind(**given)
    except RobocovError:
        raise
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise explain_fault(f"controller {where!r} cannot be made", error) from error
