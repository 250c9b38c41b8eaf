"""Maps for training: given maps, or maps that are generated for each episode."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import ParameterError, quote
from robocov.mapfile import load_map

MapSource: TypeAlias = str | Path | Environment | Callable[[int], Environment]
"""A map, its name or path, or a function that builds a map from a seed."""
SEED_LIMIT = 2**31
"""Exclusive upper bound of random seeds."""
_MAX_STORED_COSTS = 64


@dataclass(frozen=True)
class GeneratedMaps:
    """Function that generates a map from a seed, for training on many maps.

    Parameters
    ----------
    kind : str
        Kind of the maps, as in `robocov.generate_map`.
    seeds : sequence of int, optional
        Allowed seeds, for example ``range(1000)``, so that maps with other seeds can be used for testing. By
        default, all seeds are allowed.
    parameters : Mapping
        Further parameters of `robocov.generate_map`: ``obstacles``, ``area``, ``gap``, ...

    Raises
    ------
    ParameterError
        If `seeds` is empty.

    See Also
    --------
    robocov.generate_map : Generate one map.
    CoverageTask : Accepts such a function as `maps`.

    Examples
    --------
    >>> from robocov_app.learning import GeneratedMaps
    >>> GeneratedMaps("rooms", seeds=range(100))(742).name
    'rooms 42'
    """

    kind: str = "polygons"
    seeds: Sequence[int] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.seeds is not None and not len(self.seeds):
            raise ParameterError("maps: seeds: expected at least one, got none")

    def __call__(self, seed: int) -> Environment:
        """Generate the map of a seed; if `seeds` is given, that of ``seeds[seed % len(seeds)]``.

        Raises
        ------
        ParameterError
            If `robocov.generate_map` raises it.
        """
        from robocov.generator import generate_map

        map_seed = seed if self.seeds is None else self.seeds[seed % len(self.seeds)]
        return generate_map(map_seed, kind=self.kind, **self.parameters)


class MapSampler:
    """Draws random maps, and caches the coverage costs of the most recent ones.

    Parameters
    ----------
    maps : MapSource or sequence of MapSource
        Sources of maps, all equally likely.
    lattice : int
        Number of sites along each side of the lattice of the costs.
    radius : float, m
        Radius of the smallest robot; see `CoverageCost`.

    Raises
    ------
    ParameterError
        If there is no source, or a source has an invalid type.
    InputError
        If a map cannot be read.
    """

    def __init__(
        self,
        maps: MapSource | Sequence[MapSource],
        lattice: int,
        radius: float = DEFAULT_RADIUS_M,
    ) -> None:
        if isinstance(maps, Sequence) and not isinstance(maps, str):
            self._sources = [_resolve_source(source, f"maps[{k}]") for k, source in enumerate(maps)]
        else:
            self._sources = [_resolve_source(maps, "maps")]
        if not self._sources:
            raise ParameterError("maps: expected at least one, got none")
        self._lattice = lattice
        self._radius = radius
        self._costs: dict[Environment, CoverageCost] = {}

    @property
    def only_map(self) -> Environment | None:
        """The map if all episodes are on the same one; otherwise None."""
        source = self._sources[0]
        if len(self._sources) == 1 and isinstance(source, Environment):
            return source
        return None

    def draw(self, rng: np.random.Generator) -> Environment:
        """Draw a source at random, and return or generate its map."""
        source = self._sources[int(rng.integers(len(self._sources)))]
        return build_map(source, int(rng.integers(SEED_LIMIT)))

    def get_cost(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of a map, from the cache if possible."""
        cost = self._costs.pop(environment, None)
        if cost is None:
            cost = CoverageCost(environment, self._lattice, radius=self._radius)
        # The dictionary is in order of use, so the first entry is the least recently used one.
        self._costs[environment] = cost
        if len(self._costs) > _MAX_STORED_COSTS:
            del self._costs[next(iter(self._costs))]
        return cost


def build_map(source: object, seed: int) -> Environment:
    """Return a map from its source: a map, its name or path, or a function that builds it from the seed.

    Raises
    ------
    ParameterError
        If the source has an invalid type, or the function does not return a map.
    InputError
        If the map cannot be read.
    """
    resolved = _resolve_source(source, "map")
    environment = resolved if isinstance(resolved, Environment) else resolved(seed)
    if not isinstance(environment, Environment):
        raise ParameterError(f"maps: expected an Environment for seed {seed}, got {quote(environment)}")
    return environment


def _resolve_source(source: object, name: str) -> Environment | Callable[[int], Environment]:
    """Return the source itself if it is a map or a function; load the map if it is a name or path."""
    if isinstance(source, (str, Path)):
        return load_map(source)
    if isinstance(source, Environment) or callable(source):
        return source
    raise ParameterError(
        f"{name}: expected a map, its name or path, or a function from a seed to one, got {quote(source)}"
    )
