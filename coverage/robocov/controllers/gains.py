"""Gains of a controller, as dataclass fields: numbers with a unit and a range, or one of several choices."""

import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar, TypeAlias

import numpy as np

from robocov.controllers.user_modules import explain_fault
from robocov.errors import ParameterError, RobocovError, describe_unknown_name, format_bound, is_number, quote

Value: TypeAlias = float | str | None
"""Value of a gain: a number, None for no limit, or one of the choices of an `Option`."""

_METADATA_KEY = "gain"
_FORMER_NAMES = {"neighbours": "neighbors", "least": "min_density"}
"""Names of gains and choices in files of earlier versions, with those of today."""
_MAX_PLAIN_GAIN = 1e12
"""Limit of the absolute value of a number that a user's dataclass declares without `gain`."""
_DIMENSIONLESS = "1"
"""Unit of dimensionless gains, which is not written after a number."""


def update_name(name: str, known: Collection[str]) -> str:
    """Return the current name of a gain or choice from a file, which may be of an earlier version.

    Examples
    --------
    >>> update_name("neighbours", {"neighbors", "eta"}), update_name("eta", {"neighbors", "eta"})
    ('neighbors', 'eta')
    """
    current_name = _FORMER_NAMES.get(name, name)
    return current_name if name not in known and current_name in known else name


def format_value(value: Value, *, digits: int = 6, none: str = "none") -> str:
    """Format the value of a gain.

    Parameters
    ----------
    value : float, str or None
    digits : int
        Maximum number of significant digits.
    none : str
        Text for None, which means no limit.

    Examples
    --------
    >>> format_value(0.30000001), format_value(None), format_value("median")
    ('0.3', 'none', 'median')
    """
    if value is None:
        return none
    return value if isinstance(value, str) else f"{value:.{digits}g}"


@dataclass(frozen=True)
class Gain:
    """A gain that is a number."""

    name: str
    default: float | None
    unit: str
    low: float
    """Minimum."""
    high: float
    """Maximum."""
    meaning: str
    """Description on one line."""
    optional: bool = False
    """Whether None is allowed, which means no limit."""
    whole: bool = False
    """Whether only whole numbers are allowed."""

    def validate(self, value: object, controller_name: str) -> float | None:
        """Return a value as a float if the gain allows it.

        Parameters
        ----------
        value : object
        controller_name : str
            For the start of the error message.

        Raises
        ------
        ParameterError
            If the value is not in the range of the gain.
        """
        if value is None and self.optional:
            return None
        if is_number(value) and self._is_in_range(value):
            return float(value)
        kind = "whole number" if self.whole else "number"
        expected = f"a {kind} from {format_bound(self.low)} to {format_bound(self.high)} {self.unit}".rstrip()
        if self.optional:
            expected += ", or null for no limit"
        raise ParameterError(f"{controller_name}.{self.name}: expected {expected}, got {quote(value)}")

    def _is_in_range(self, number: Any) -> bool:
        if not self.low <= number <= min(self.high, sys.float_info.max):
            return False
        return not self.whole or bool(number == int(number))


@dataclass(frozen=True)
class Option:
    """A gain that is one of several choices."""

    name: str
    default: str
    choices: tuple[str, ...]
    meaning: str
    """Description on one line."""
    unit: ClassVar[str] = ""
    optional: ClassVar[bool] = False

    def validate(self, value: object, controller_name: str) -> str:
        """Return the current name of a choice if the value is one of the choices.

        Parameters
        ----------
        value : object
        controller_name : str
            For the start of the error message.

        Raises
        ------
        ParameterError
            If the value is none of the choices.
        """
        if not isinstance(value, str):
            expected = ", ".join(self.choices)
            raise ParameterError(
                f"{controller_name}.{self.name}: expected one of {expected}, got {quote(value)}"
            )
        value = update_name(value, self.choices)
        if value not in self.choices:
            raise ParameterError(
                f"{controller_name}.{self.name}: {describe_unknown_name('choice', value, self.choices)}"
            )
        return value


def gain(
    default: float | None,
    unit: str,
    meaning: str,
    *,
    low: float = 0.0,
    high: float = 1e6,
    optional: bool = False,
    whole: bool = False,
) -> Any:
    """Declare a gain that is a number, as a dataclass field.

    Parameters
    ----------
    default : float or None
        Default value, within the range.
    unit : str
        Such as "N/m"; "1" for a dimensionless gain.
    meaning : str
        Description on one line.
    low : float
        Minimum allowed value.
    high : float
        Maximum allowed value.
    optional : bool
        Whether None is allowed, which means no limit.
    whole : bool
        Whether only whole numbers are allowed.

    Returns
    -------
    field
        A dataclass field with this default.

    See Also
    --------
    choice : Declare a gain that is one of several choices.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import robocov as rc
    >>> from robocov.controllers import get_gains
    >>> @dataclass(frozen=True)
    ... class Homing:
    ...     stiffness: float = rc.gain(1.0, "N/m", "pull to the centroid")
    >>> get_gains(Homing)["stiffness"].unit
    'N/m'
    """
    # `get_gains` adds the name of the field.
    declared = Gain(
        name="",
        default=default,
        unit=unit,
        low=low,
        high=high,
        meaning=meaning,
        optional=optional,
        whole=whole,
    )
    return field(default=default, metadata={_METADATA_KEY: declared})


def response_time_gain() -> Any:
    """Declare the time constant with which robots reach their desired velocities, as a dataclass field."""
    return gain(0.1, "s", "time constant with which the desired velocity is reached", low=0.02, high=10.0)


def choice(default: str, choices: Sequence[str], meaning: str) -> Any:
    """Declare a gain that is one of several choices, as a dataclass field.

    Parameters
    ----------
    default : str
        One of the choices.
    choices : sequence of str
        The allowed values.
    meaning : str
        Description on one line.

    Returns
    -------
    field
        A dataclass field with this default.

    Raises
    ------
    ValueError
        If the default is not one of the choices.

    See Also
    --------
    gain : Declare a gain that is a number.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import robocov as rc
    >>> from robocov.controllers import get_gains
    >>> @dataclass(frozen=True)
    ... class Patrol:
    ...     direction: str = rc.choice("clockwise", ("clockwise", "counter-clockwise"), "direction of travel")
    >>> get_gains(Patrol)["direction"].choices
    ('clockwise', 'counter-clockwise')
    """
    if default not in choices:
        raise ValueError(f"default: expected one of {', '.join(choices)}, got {default!r}")
    # `get_gains` adds the name of the field.
    declared = Option(name="", default=default, choices=tuple(choices), meaning=meaning)
    return field(default=default, metadata={_METADATA_KEY: declared})


def get_gains(controller: Any) -> dict[str, Gain | Option]:
    """Return the gains of a controller, in the order of their declaration.

    Parameters
    ----------
    controller : object or type
        A controller, or a class of controllers. Only dataclasses have gains.

    Returns
    -------
    dict of str to Gain or Option
        Gains by name. A plain number in a user's dataclass is a gain with a very wide range.

    See Also
    --------
    gain : Declare a gain of a controller.
    make_controller : Build a controller from its name and gains.

    Examples
    --------
    >>> from robocov.controllers import Rapf, get_gains
    >>> get_gains(Rapf)["k_rep"].unit
    'N m³'
    """
    if not is_dataclass(controller):
        return {}
    gains: dict[str, Gain | Option] = {}
    for dataclass_field in fields(controller):
        declared = _to_gain(dataclass_field)
        if declared is not None:
            gains[declared.name] = declared
    return gains


def _to_gain(dataclass_field: Field[Any]) -> Gain | Option | None:
    """Return the gain that a dataclass field declares; None if it is not a gain.

    A field declares a gain by `gain` or `choice`, or by a plain number as its default. A plain number has no
    unit and no description. A field that cannot be set when the controller is created is not a gain.
    """
    if not dataclass_field.init:
        return None
    declared = dataclass_field.metadata.get(_METADATA_KEY)
    default = None if dataclass_field.default is MISSING else dataclass_field.default
    if declared is None:
        if is_number(default):
            return Gain(
                name=dataclass_field.name,
                default=default,
                unit="",
                low=-_MAX_PLAIN_GAIN,
                high=_MAX_PLAIN_GAIN,
                meaning="",
            )
        return None
    complete: Gain | Option = replace(declared, name=dataclass_field.name, default=default)
    if isinstance(complete, Gain) and complete.unit == _DIMENSIONLESS:
        complete = replace(complete, unit="")
    return complete


def get_gain_values(controller: Any) -> dict[str, Value]:
    """Return the values of the gains of a controller, in the order of their declaration.

    NumPy numbers, which a user's controller may contain, are converted to Python numbers.
    """
    return {name: to_plain_value(getattr(controller, name)) for name in get_gains(controller)}


def to_plain_value(value: Any) -> Any:
    """Convert a NumPy number to a Python number, which JSON can represent; return anything else unchanged."""
    return value.item() if isinstance(value, np.generic) else value


def validate_gains(controller: Any) -> None:
    """Validate all gains of a controller, and convert numbers to floats.

    A controller that is a frozen dataclass calls this function in its ``__post_init__`` method. Error
    messages begin with the controller's name.

    Raises
    ------
    ParameterError
        If a value is not allowed.
    """
    controller_name = getattr(controller, "name", type(controller).__name__)
    for name, declared in get_gains(controller).items():
        value = declared.validate(getattr(controller, name), controller_name)
        object.__setattr__(controller, name, value)  # A frozen dataclass does not allow assignment.


def check_gains(controller: Any) -> None:
    """Check the gains that a controller declares by `gain` or `choice`, without converting them.

    The classes of users do not call `validate_gains`. A plain number as a default declares no range to check.

    Raises
    ------
    ParameterError
        If a value is not allowed. The message begins with the controller's name.
    """
    controller_name = getattr(controller, "name", type(controller).__name__)
    plain_names = set()
    if is_dataclass(controller):
        plain_names = {item.name for item in fields(controller) if _METADATA_KEY not in item.metadata}
    for name, declared in get_gains(controller).items():
        if name not in plain_names:
            declared.validate(getattr(controller, name), controller_name)


def require_gain_mapping(values: object) -> None:
    """Raise a ParameterError unless values are a mapping whose keys are names.

    Parameters
    ----------
    values : object
        Values of gains by name. Neither the names nor the values are checked.

    Raises
    ------
    ParameterError
        If this is not a mapping, or one of its keys is not a str.
    """
    if not isinstance(values, Mapping):
        raise ParameterError(f"gains: expected a mapping of names to values, got {quote(values)}")
    for name in values:
        if not isinstance(name, str):
            raise ParameterError(f"gains: expected names as keys, got {quote(name)}")


def instantiate_controller(kind: type[Any], values: Mapping[str, object]) -> Any:
    """Create a controller of a class.

    Parameters
    ----------
    kind : type
    values : mapping of str to object
        Values of gains; all others have their defaults.

    Returns
    -------
    Controller or IndividualController

    Raises
    ------
    ParameterError
        If `values` is not a mapping, a gain is unknown (the message suggests the most similar name), a value
        is not allowed, or the constructor of a user's class raises an error.
    """
    require_gain_mapping(values)
    gains = get_gains(kind)
    controller_name = getattr(kind, "name", kind.__name__)
    checked_values = {}
    for given_name, value in values.items():
        if not gains:
            path = f"{controller_name}.{given_name}"
            raise ParameterError(f"{path}: controller {controller_name!r} has no gains")
        name = update_name(given_name, gains)
        if name not in gains:
            raise ParameterError(f"{controller_name}: {describe_unknown_name('gain', name, gains)}")
        checked_values[name] = gains[name].validate(value, controller_name)
    try:
        return kind(**checked_values)
    except (RobocovError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise explain_fault(f"controller {controller_name!r} cannot be created", error) from error
