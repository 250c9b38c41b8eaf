"""Which map an episode is on: one, one of several, or a new one each time."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError, shown
from robocov.mapfile import load_map

MapSource: TypeAlias = "str | Path | Environment | Callable[[int], Environment]"
"""A map, its name or path, or what makes one of a seed."""

_SEEDS = 2**31
"""A maker of maps is given a seed below this."""

_KEPT = 64
"""Maps with their costs that are kept at most."""


@dataclass(frozen=True)
class GeneratedMaps:
    """Makes a map of a seed by `robocov.generated_map`, to learn on many.

    The `seeds` are the maps that there are, as in ``range(1000)``; others can then be kept for the test.
    None: any. The `parameters` are further ones of `robocov.generated_map`: ``obstacles``, ``area``, ``gap``,
    ...

    Examples
    --------
    >>> GeneratedMaps("rooms", seeds=range(100))(742).name
    'rooms 42'
    """

    kind: str = "polygons"
    seeds: Sequence[int] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.seeds is not None and not len(self.seeds):
            raise ParameterError("maps: seeds: none, but at least one was wanted")

    def __call__(self, seed: int) -> Environment:
        """Return the map of a seed, or where `seeds` are given that of ``seeds[seed % len(seeds)]``.

        Raises ParameterError as `robocov.generated_map`.
        """
        from robocov.generator import generated_map

        number = seed if self.seeds is None else self.seeds[seed % len(self.seeds)]
        return generated_map(number, kind=self.kind, **self.parameters)


class Scenarios:
    """Draws maps, and keeps the coverage costs of some, on lattices of so many cells a side.

    Raises InputError when a map cannot be read, or something is no map at all.
    """

    def __init__(self, maps: MapSource | Sequence[MapSource], lattice: int) -> None:
        several = isinstance(maps, Sequence) and not isinstance(maps, str)
        given: Sequence[Any] = maps if several else (maps,)  # type: ignore[assignment]
        if not given:
            raise ParameterError("maps: none, but at least one was wanted")
        self._sources = [_source(each, f"maps[{k}]" if several else "maps") for k, each in enumerate(given)]
        self._lattice = lattice
        self._costs: OrderedDict[Environment, CoverageCost] = OrderedDict()

    @property
    def only(self) -> Environment | None:
        """The map, where there is but one."""
        source = self._sources[0]
        return source if len(self._sources) == 1 and isinstance(source, Environment) else None

    def draw(self, rng: np.random.Generator) -> Environment:
        """Return one of the maps, each as likely, or a new one of its maker."""
        source = self._sources[int(rng.integers(len(self._sources)))]
        return map_of(source, int(rng.integers(_SEEDS)))

    def cost(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of a map."""
        cost = self._costs.get(environment)
        if cost is None:
            cost = CoverageCost(environment, self._lattice)
            self._costs[environment] = cost
            if len(self._costs) > _KEPT:
                self._costs.popitem(last=False)
        self._costs.move_to_end(environment)
        return cost


def map_of(given: object, seed: int) -> Environment:
    """Return a map: itself, that of a name or path, or what somebody's function makes of the seed.

    Raises InputError when there is none, or a function gives something else.
    """
    source = _source(given, "map")
    if isinstance(source, Environment):
        return source
    environment = source(seed)
    if not isinstance(environment, Environment):
        raise ParameterError(f"maps: for seed {seed} {shown(environment)}, but an Environment was wanted")
    return environment


def _source(given: object, where: str) -> Environment | Callable[[int], Environment]:
    if isinstance(given, (str, Path)):
        return load_map(given)
    if isinstance(given, Environment) or callable(given):
        return given
    raise ParameterError(
        f"{where}: {shown(given)}, but a map, its name or path, or a function from a seed to one was wanted"
    )
