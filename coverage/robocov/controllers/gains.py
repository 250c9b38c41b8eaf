"""Gains of a controller: numbers with a unit and a range, or words to choose from, as dataclass fields."""

from __future__ import annotations

import sys
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from robocov.controllers.faults import fault_of
from robocov.errors import ParameterError, RobocovError, shown, unknown_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Value: TypeAlias = float | str | None
"""What a gain may be: a number, None for no limit, or one of the words of an `Option`."""


def value_text(value: Value, *, digits: int = 6, none: str = "none") -> str:
    """Return a value as people write it: a number to so many digits, `none` for no limit.

    >>> value_text(0.30000001), value_text(None), value_text("median")
    ('0.3', 'none', 'median')
    """
    if value is None:
        return none
    return value if isinstance(value, str) else f"{value:.{digits}g}"


@dataclass(frozen=True)
class Gain:
    """What is known of one gain that is a number.

    Attributes
    ----------
    name, unit, meaning : str
    default : float or None
    low, high : float
        The range, both ends included.
    optional : bool
        Whether None ("no limit") is a value.
    """

    name: str
    default: float | None
    unit: str
    low: float
    high: float
    meaning: str
    optional: bool = False

    def validated(self, value: object, where: str) -> float | None:
        """Return `value` as the gain takes it.

        Raises
        ------
        ParameterError
            When it is not a number in range; the message names `where`, value and range.
        """
        if value is None and self.optional:
            return None
        also = ", or null for no limit," if self.optional else ""
        unit = f" {self.unit}" if self.unit else ""
        wanted = f"but a number from {self.low:g} to {self.high:g}{unit}{also} was wanted"
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ParameterError(f"{where}.{self.name}: {shown(value)}, {wanted}")
        if not self.low <= value <= min(self.high, sys.float_info.max):
            raise ParameterError(f"{where}.{self.name}: {shown(value)}, {wanted}")
        return float(value)


@dataclass(frozen=True)
class Option:
    """What is known of one gain that is a word.

    Attributes
    ----------
    name, default, meaning : str
    words : tuple of str
        Those to choose from.
    """

    name: str
    default: str
    words: tuple[str, ...]
    meaning: str
    unit: ClassVar[str] = ""
    optional: ClassVar[bool] = False

    def validated(self, value: object, where: str) -> str:
        """Return `value` when it is one of the words.

        Raises
        ------
        ParameterError
            When it is not; the message names `where`, the value and the words, and the nearest of them.
        """
        wanted = f"one of {', '.join(self.words)} was wanted"
        if not isinstance(value, str):
            raise ParameterError(f"{where}.{self.name}: {shown(value)}, but {wanted}")
        if value not in self.words:
            raise ParameterError(f"{where}.{self.name}: {unknown_name('word', value, self.words)}")
        return value


def gain(
    default: float | None,
    unit: str,
    meaning: str,
    *,
    low: float = 0.0,
    high: float = 1e6,
    optional: bool = False,
) -> Any:
    """Declare a gain as a dataclass field.

    >>> @dataclass(frozen=True)
    ... class Mine:
    ...     k: float = gain(1.0, "N/m", "stiffness")
    >>> gains_of(Mine)["k"].unit
    'N/m'
    """
    return field(default=default, metadata={"gain": (unit, low, high, meaning, optional)})


def choice(default: str, words: Sequence[str], meaning: str) -> Any:
    """Declare a gain that is one of several words as a dataclass field.

    >>> @dataclass(frozen=True)
    ... class Mine:
    ...     side: str = choice("left", ("left", "right"), "where to pass each other")
    >>> gains_of(Mine)["side"].words
    ('left', 'right')

    Raises
    ------
    ValueError
        When the default is none of the words.
    """
    if default not in words:
        raise ValueError(f"default {default!r}, but one of {', '.join(words)} was wanted")
    return field(default=default, metadata={"option": (tuple(words), meaning)})


def gains_of(controller: Any) -> dict[str, Gain | Option]:
    """Return the gains of a controller class or instance by name, in their order of declaration.

    One that is no dataclass has none.
    """
    found: dict[str, Gain | Option] = {}
    for each in fields(controller) if is_dataclass(controller) else ():
        if "option" in each.metadata:
            found[each.name] = Option(each.name, str(each.default), *each.metadata["option"])
            continue
        default = None if each.default is MISSING else each.default
        if "gain" in each.metadata:
            unit, low, high, meaning, optional = each.metadata["gain"]
            unit = "" if unit == "1" else unit  # a unit in formulas, and nothing behind a number
        elif isinstance(default, int | float) and not isinstance(default, bool):
            # a user's plain dataclass field is a gain of any value
            unit, low, high, meaning, optional = "", -1e12, 1e12, "", False
        else:
            continue
        found[each.name] = Gain(each.name, default, unit, low, high, meaning, optional)
    return found


def gain_values(controller: Any) -> dict[str, Value]:
    """Return the values of the gains of a controller instance."""
    return {name: getattr(controller, name) for name in gains_of(controller)}


def validate_gains(controller: Any) -> None:
    """Check every gain of a controller instance; call it from ``__post_init__``.

    Raises
    ------
    ParameterError
        On the first gain out of range.
    """
    where = getattr(controller, "name", type(controller).__name__)
    for name, known in gains_of(controller).items():
        object.__setattr__(controller, name, known.validated(getattr(controller, name), where))


def with_gains(kind: type[Any], values: Mapping[str, object]) -> Any:
    """Return an instance of the controller class `kind` with the given gains.

    Raises
    ------
    ParameterError
        On an unknown gain (with the nearest name) a value out of range, or a class that raises something.
    """
    known = gains_of(kind)
    where = getattr(kind, "name", kind.__name__)
    for name in values:
        if name not in known:
            if not known:
                raise ParameterError(f"{where}.{name}: controller {where!r} has no gains")
            raise ParameterError(f"{where}: {unknown_name('gain', name, known)}")
    given = {name: known[name].validated(value, where) for name, value in values.items()}
    try:
        return kind(**given)
    except RobocovError:
        raise
    except (Exception, SystemExit) as error:
        raise fault_of(f"controller {where!r} cannot be made", error) from error
