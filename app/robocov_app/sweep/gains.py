"""The gains that a study tries: every combination of lists, and samples of ranges."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any, Literal, TypeAlias, TypeVar, get_args

import numpy as np

from robocov.arrays import Array
from robocov.controllers import gain_values, gains_of
from robocov.controllers.gains import Gain, Option, Value, with_gains
from robocov.errors import ParameterError, checked, place, shown, unknown_name

T = TypeVar("T")

Scale: TypeAlias = Literal["linear", "log"]
Method: TypeAlias = Literal["sobol", "latin-hypercube", "halton"]

NO_LIMIT = "null"  # what stands for None where a file has no word for it
MOST_SAMPLES = 100_000
_DIGITS = 6
"""Digits of a sampled gain: more say nothing, and the last ones differ from one processor to the next."""

Place: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True)
class Range:
    """Range of a gain, both ends included, sampled evenly by value or by its logarithm."""

    low: float
    high: float
    scale: Scale = "linear"

    def values(self, parts: Array) -> list[float]:
        """Return the values at (m,) parts of the range, from 0 to 1, rounded to six digits."""
        log = self.scale == "log"
        low, high = (math.log(self.low), math.log(self.high)) if log else (self.low, self.high)
        exact = low + (high - low) * parts
        exact = np.exp(exact) if log else exact
        return [min(max(float(f"{x:.{_DIGITS}g}"), self.low), self.high) for x in exact.tolist()]


@dataclass(frozen=True)
class Sampling:
    """Joint sampling of a controller's ranges by `scipy.stats.qmc`, scrambled."""

    method: Method = "sobol"
    samples: int = 16
    seed: int = 0

    def __post_init__(self) -> None:
        if self.method not in get_args(Method):
            raise ParameterError(f"sampling.method: {unknown_name('method', self.method, get_args(Method))}")
        checked("sampling.samples", self.samples, 1, MOST_SAMPLES, whole=True)
        checked("sampling.seed", self.seed, 0, 2**63 - 1, whole=True)

    def points(self, dimensions: int) -> Array:
        """Return as many points of the unit cube as there are samples, (samples, dimensions)."""
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        if self.method == "sobol":  # the beginning of a longer, balanced sequence
            points = qmc.Sobol(dimensions, seed=rng).random_base2((self.samples - 1).bit_length())
            return np.asarray(points[: self.samples])
        kind = qmc.Halton if self.method == "halton" else qmc.LatinHypercube
        return np.asarray(kind(dimensions, seed=rng).random(self.samples))


Choice: TypeAlias = Mapping[str, Value]
"""A value for every gain of a controller."""

Wanted: TypeAlias = "Gains | Mapping[str, Any] | Sequence[Mapping[str, Any]]"
"""Accepted forms of a controller's gains in a study; see `Gains.of`."""


@dataclass(frozen=True)
class Gains:
    """The gains of one controller in a study: choices of all gains, and what was sampled."""

    choices: tuple[Choice, ...]
    ranges: Mapping[str, Range] = field(default_factory=dict)

    @classmethod
    def of(cls, kind: type[Any], wanted: Wanted, sampling: Sampling | None, path: Place = ()) -> Gains:
        """Return what is tried of a controller of a class; other gains have their defaults.

        `wanted`: sets of gains, as dicts; or one dict of name to a value, a list of which every combination
        is tried, or a `Range`. Raises ParameterError, which begins with the place.
        """
        if isinstance(wanted, Gains):
            return cls(cls.of(kind, wanted.choices, None, path).choices, wanted.ranges)
        if isinstance(wanted, Mapping):
            return _of_axes(kind, wanted, sampling, path)
        if not wanted:
            raise ParameterError(f"{place(path)}: none, but at least one set of gains was wanted")
        known = gains_of(kind)
        choices = []
        for k, given in enumerate(wanted):
            values = {name: _value(known, name, value, (*path, k, name)) for name, value in given.items()}
            choices.append(gain_values(with_gains(kind, values)))
        once(choices, path)
        return cls(tuple(choices))


def _of_axes(kind: type[Any], axes: Mapping[str, Any], sampling: Sampling | None, path: Place) -> Gains:
    """Return every combination of the lists with every sample of the ranges, the samples innermost."""
    known = gains_of(kind)
    lists: dict[str, list[Value]] = {}
    ranges: dict[str, Range] = {}
    for name, given in axes.items():
        at = (*path, name)
        if isinstance(given, Range):
            ranges[name] = _checked_range(known, name, given, at)
        else:
            lists[name] = axis(given, at, partial(_value, known, name))
    samples: list[tuple[float, ...]] = [()]
    if ranges:
        if sampling is None:
            at = (*path, next(iter(ranges)))
            raise ParameterError(f"{place(at)}: a range, but sampling says neither a method nor how many")
        points = sampling.points(len(ranges))
        columns = [each.values(points[:, k]) for k, each in enumerate(ranges.values())]
        samples = list(zip(*columns, strict=True))
    choices: list[Choice] = [
        gain_values(with_gains(kind, dict(zip([*lists, *ranges], (*row, *sample), strict=True))))
        for row, sample in product(product(*lists.values()), samples)
    ]
    once(choices, (*path, "samples"))  # as of a range that is narrower than the digits of a sample
    return Gains(tuple(choices), ranges)


def _value(known: Mapping[str, Gain | Option], name: str, value: object, path: Place) -> Value:
    """Return a value of a gain; both ``inf`` and ``"null"`` stand for no limit where there may be none."""
    gain = _known(known, name, path)
    if gain.optional and value in (NO_LIMIT, math.inf):
        return None
    return placed(path, lambda: gain.validated(value, ""))


def _known(known: Mapping[str, Gain | Option], name: str, path: Place) -> Gain | Option:
    if name not in known:
        above = place(path[: len(path) - 1 - isinstance(path[-1], int)])
        if not known:
            raise ParameterError(f"{above}: {shown(name)}, but the controller has no gains")
        raise ParameterError(f"{above}: {unknown_name('gain', name, known)}")
    return known[name]


def _checked_range(known: Mapping[str, Gain | Option], name: str, given: Range, path: Place) -> Range:
    gain = _known(known, name, path)
    if isinstance(gain, Option):
        wanted = f"one of {', '.join(gain.words)}, or a list of them,"
        raise ParameterError(f"{place(path)}: a range, but {wanted} was wanted")
    ends = []
    for end, value in (("low", given.low), ("high", given.high)):
        if value is None:
            raise ParameterError(f"{place((*path, end))}: {shown(None)}, but a number was wanted")
        ends.append(placed((*path, end), partial(gain.validated, value, "")) or 0.0)
    low, high = ends
    if given.scale not in get_args(Scale):
        unknown = unknown_name("scale", given.scale, get_args(Scale))
        raise ParameterError(f"{place((*path, 'scale'))}: {unknown}")
    if not low < high:
        raise ParameterError(f"{place((*path, 'high'))}: {high:g}, but a number above {low:g} was wanted")
    if given.scale == "log" and low <= 0.0:
        wanted = "a number above 0, as the scale is that of logarithms,"
        raise ParameterError(f"{place((*path, 'low'))}: {low:g}, but {wanted} was wanted")
    return Range(low, high, given.scale)


def placed(path: Place, check: Callable[[], T]) -> T:
    """Return what `check` returns; its complaint is told of `path`, in place of what it names."""
    try:
        return check()
    except ParameterError as error:
        raise ParameterError(f"{place(path)}: {str(error).partition(': ')[2]}") from None


def axis(given: Any, path: Place, check: Callable[[Any, Place], T]) -> list[T]:
    """Return what `check` makes of a value, or of each of a list of values, which differ."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        return [check(given, path)]
    values = [check(value, (*path, k)) for k, value in enumerate(given)]
    if not values:
        raise ParameterError(f"{place(path)}: none, but at least one value was wanted")
    once(values, path)
    return values


def once(values: Sequence[object], path: Place) -> None:
    seen: dict[object, int] = {}
    for k, value in enumerate(values):
        first = seen.setdefault(tuple(value.items()) if isinstance(value, Mapping) else value, k)
        if first < k:
            raise ParameterError(
                f"{place((*path, k))}: {shown(value)} is given already at {place((*path, first))}; "
                f"each once was wanted"
            )
