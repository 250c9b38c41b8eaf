"""Gains in a study: all combinations that are tried for a controller."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any, TypeAlias, get_args

from robocov.controllers import get_gain_values, get_gains
from robocov.controllers.gains import Gain, Option, Value, instantiate_controller, update_name
from robocov.errors import JsonPath, ParameterError, describe_unknown_name, format_path, quote
from robocov_app.sweep.study.sampling import Range, Sampling, Scale
from robocov_app.sweep.study.value_paths import parse_values, require_distinct, validate_at

NO_LIMIT = "null"
"""Represents None in study files, because TOML has no null."""


@dataclass(frozen=True)
class Gains:
    """The gains of one controller in a study.

    Attributes
    ----------
    choices : tuple of dict of str to float, str or None
        The sets of gains that are tried, each with a value for every gain.
    ranges : mapping of str to Range
        The ranges from which gains were sampled.
    """

    choices: tuple[Mapping[str, Value], ...]
    ranges: Mapping[str, Range] = field(default_factory=dict)


GainsSpecification: TypeAlias = Gains | Mapping[str, Any] | Sequence[Mapping[str, Any]]
"""Gains of a controller as given in a study; see `build_gains`."""


def build_gains(
    controller_class: type[Any],
    specification: GainsSpecification,
    sampling: Sampling | None,
    path: JsonPath = (),
) -> Gains:
    """Build the sets of gains that a study tries for a controller.

    Parameters
    ----------
    controller_class : type
        Class of the controller.
    specification : mapping, sequence of mapping, or Gains
        Either a mapping from gains to a value, a list of values or a `Range`, or a list of sets of gains. All
        combinations of the values in a mapping are tried. Gains that are not mentioned have their defaults.
    sampling : Sampling or None
        Method and number of samples; required if there are ranges.
    path : tuple of str and int
        Path of the gains in the study, for messages.

    Returns
    -------
    Gains

    Raises
    ------
    ParameterError
        If a gain is unknown or out of range, or a combination occurs twice.
    """
    if isinstance(specification, Gains):
        checked = build_gains(controller_class, specification.choices, None, path)
        return Gains(checked.choices, specification.ranges)
    if isinstance(specification, Mapping):
        return _combine_gains(controller_class, specification, sampling, path)
    if not specification:
        raise ParameterError(f"{format_path(path)}: expected at least one set of gains, got none")
    known = get_gains(controller_class)
    choices = []
    for index, gains in enumerate(specification):
        values = {
            name: _parse_value(known, name, value, (*path, index, name)) for name, value in gains.items()
        }
        choices.append(_complete_gains(controller_class, values))
    require_distinct(choices, path)
    return Gains(tuple(choices))


def _combine_gains(
    controller_class: type[Any], axes: Mapping[str, Any], sampling: Sampling | None, path: JsonPath
) -> Gains:
    """Combine all values of the lists with all samples of the ranges; samples vary fastest."""
    known = get_gains(controller_class)
    lists: dict[str, list[Value]] = {}
    ranges: dict[str, Range] = {}
    for name, axis in axes.items():
        axis_path = (*path, name)
        if isinstance(axis, Range):
            ranges[name] = _parse_range(known, name, axis, axis_path)
        else:
            lists[name] = parse_values(axis, axis_path, partial(_parse_value, known, name))
    samples = _draw_samples(ranges, sampling, path)
    names = [*lists, *ranges]
    choices = []
    for listed_values, sampled_values in product(product(*lists.values()), samples):
        values = dict(zip(names, (*listed_values, *sampled_values), strict=True))
        choices.append(_complete_gains(controller_class, values))
    # Samples are rounded, so those from a very narrow range may be equal.
    require_distinct(choices, (*path, "samples"))
    return Gains(tuple(choices), ranges)


def _draw_samples(
    ranges: Mapping[str, Range], sampling: Sampling | None, path: JsonPath
) -> list[tuple[float, ...]]:
    """Draw samples that contain a value for each range. Without ranges, there is a single empty sample."""
    if not ranges:
        return [()]
    if sampling is None:
        range_path = format_path((*path, next(iter(ranges))))
        expected = "expected a table [sampling] with method and samples for a range, got none"
        raise ParameterError(f"{range_path}: {expected}")
    points = sampling.draw_points(len(ranges))
    columns = [gain_range.interpolate(points[:, k]) for k, gain_range in enumerate(ranges.values())]
    return list(zip(*columns, strict=True))


def _complete_gains(controller_class: type[Any], values: Mapping[str, Value]) -> Mapping[str, Value]:
    """Return the values of all gains: the given ones, checked by the controller, and the other defaults."""
    return get_gain_values(instantiate_controller(controller_class, values))


def _parse_value(known: Mapping[str, Gain | Option], name: str, value: object, path: JsonPath) -> Value:
    """Parse one value of a gain; both ``inf`` and ``"null"`` mean no limit."""
    gain = _find_gain(known, name, path)
    if gain.optional and value in (NO_LIMIT, math.inf):
        return None
    return validate_at(path, partial(gain.validate, value, ""))


def _find_gain(known: Mapping[str, Gain | Option], name: str, path: JsonPath) -> Gain | Option:
    """Look up a gain by its name; raise ParameterError if the controller has no such gain."""
    name = update_name(name, known)
    if name in known:
        return known[name]
    # The path leads to the value of the gain, or to an item in a list of values.
    is_list_item = isinstance(path[-1], int)
    controller_path = path[:-2] if is_list_item else path[:-1]
    location = format_path(controller_path)
    if not known:
        raise ParameterError(f"{location}: expected no gains, as the controller has none, got {quote(name)}")
    raise ParameterError(f"{location}: {describe_unknown_name('gain', name, known)}")


def _parse_range(known: Mapping[str, Gain | Option], name: str, given: Range, path: JsonPath) -> Range:
    """Check a range against the limits of its gain, and return it with parsed ends."""
    gain = _find_gain(known, name, path)
    if isinstance(gain, Option):
        choices = ", ".join(gain.choices)
        raise ParameterError(
            f"{format_path(path)}: expected one of {choices}, or a list of them, got a range"
        )
    low = _parse_range_end(gain, given.low, (*path, "low"))
    high = _parse_range_end(gain, given.high, (*path, "high"))
    scales = get_args(Scale)
    if given.scale not in scales:
        unknown = describe_unknown_name("scale", given.scale, scales)
        raise ParameterError(f"{format_path((*path, 'scale'))}: {unknown}")
    if not low < high:
        raise ParameterError(f"{format_path((*path, 'high'))}: expected a number above {low:g}, got {high:g}")
    if given.scale == "log" and low <= 0.0:
        low_path = format_path((*path, "low"))
        raise ParameterError(f"{low_path}: expected a number above 0 for a logarithmic scale, got {low:g}")
    return Range(low, high, given.scale)


def _parse_range_end(gain: Gain, value: float | None, path: JsonPath) -> float:
    """Check one end of a range, which must be finite even if the gain may be unlimited."""
    if value is None:
        raise ParameterError(f"{format_path(path)}: expected a number, got {quote(None)}")
    return validate_at(path, partial(gain.validate, value, "")) or 0.0
