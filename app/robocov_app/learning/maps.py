"""Training maps: given ones, and generated ones that are drawn for each episode."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import ParameterError, quote
from robocov.mapfile import load_map

MapSource: TypeAlias = str | Path | Environment | Callable[[int], Environment]
"""A map, its name or path, or a function that builds one from a seed."""
SEED_LIMIT = 2**31
"""Upper bound of the seeds that are drawn, exclusive."""
_MAX_STORED_COSTS = 64


@dataclass(frozen=True)
class GeneratedMaps:
    """Function that generates a map from a seed, to learn on many.

    Parameters
    ----------
    kind : str
        Kind of the maps, as in `robocov.generate_map`.
    seeds : sequence of int, optional
        Seeds of the maps, for example ``range(1000)``. Others can then be used for testing. Without them, any
        seed is used.
    parameters : Mapping
        Further parameters of `robocov.generate_map`: ``obstacles``, ``area``, ``gap``, ...

    Raises
    ------
    ParameterError
        If `seeds` is empty.

    See Also
    --------
    robocov.generate_map : Generate one map.
    CoverageTask : Its `maps` may be such a function.

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
        """Generate the map of a seed, or of ``seeds[seed % len(seeds)]`` if there are any `seeds`.

        Raises
        ------
        ParameterError
            As `robocov.generate_map`.
        """
        from robocov.generator import generate_map

        map_seed = seed if self.seeds is None else self.seeds[seed % len(self.seeds)]
        return generate_map(map_seed, kind=self.kind, **self.parameters)


class MapSampler:
    """Draws maps, and stores the coverage costs of the latest ones.

    Parameters
    ----------
    maps : MapSource or sequence of MapSource
        Sources, which are equally likely.
    lattice : int
        Sites along a side of the lattice of the costs.

    Raises
    ------
    ParameterError
        If there is no source, or one of an invalid type.
    InputError
        If a map cannot be read.
    """

    def __init__(self, maps: MapSource | Sequence[MapSource], lattice: int) -> None:
        if isinstance(maps, Sequence) and not isinstance(maps, str):
            self._sources = [_resolve_source(source, f"maps[{k}]") for k, source in enumerate(maps)]
        else:
            self._sources = [_resolve_source(maps, "maps")]
        if not self._sources:
            raise ParameterError("maps: expected at least one, got none")
        self._lattice = lattice
        self._costs: dict[Environment, CoverageCost] = {}

    @property
    def only_map(self) -> Environment | None:
        """The map, if there is a single one."""
        source = self._sources[0]
        if len(self._sources) == 1 and isinstance(source, Environment):
            return source
        return None

    def draw(self, rng: np.random.Generator) -> Environment:
        """Draw a map."""
        source = self._sources[int(rng.integers(len(self._sources)))]
        return build_map(source, int(rng.integers(SEED_LIMIT)))

    def get_cost(self, environment: Environment) -> CoverageCost:
        """Return the coverage cost of a map, a stored one if possible."""
        cost = self._costs.pop(environment, None) or CoverageCost(environment, self._lattice)
        # The dictionary is in the order of use, so that the first is the one that was used least recently.
        self._costs[environment] = cost
        if len(self._costs) > _MAX_STORED_COSTS:
            del self._costs[next(iter(self._costs))]
        return cost


def build_map(source: object, seed: int) -> Environment:
    """Return a map: itself, the one of a name or path, or the one that a function builds from the seed.

    Raises
    ------
    ParameterError
        If the source is of an invalid type, or the function returns something else.
    InputError
        If the map cannot be read.
    """
    resolved = _resolve_source(source, "map")
    environment = resolved if isinstance(resolved, Environment) else resolved(seed)
    if not isinstance(environment, Environment):
        raise ParameterError(f"maps: expected an Environment for seed {seed}, got {quote(environment)}")
    return environment


def _resolve_source(source: object, name: str) -> Environment | Callable[[int], Environment]:
    """Return a source after loading the map of a name or path."""
    if isinstance(source, (str, Path)):
        return load_map(source)
    if isinstance(source, Environment) or callable(source):
        return source
    raise ParameterError(
        f"{name}: expected a map, its name or path, or a function from a seed to one, got {quote(source)}"
    )
