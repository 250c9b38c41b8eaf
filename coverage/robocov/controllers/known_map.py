"""Common parts of the controllers that know the whole map from the start."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import shapely

from robocov.controllers.base import BaseController
from robocov.environment import Environment
from robocov.errors import ParameterError

_QUARTER_CIRCLE_EDGES = 2
"""Number of edges of a quarter circle around a corner of a wall. They reduce the clearance by at most 8%."""
_SIMPLIFICATION_M = 0.005
"""Tolerance of the simplified boundary: each corner takes computing time."""


@dataclass(frozen=True)
class WholeMapController(BaseController):
    """Base class of controllers with the information "whole map"."""

    information = "whole map"

    environment: Environment | None = field(default=None, repr=False, compare=False, kw_only=True)
    """The map; None before `inform`."""

    def inform(self, environment: Environment) -> Self:
        """Return the controller that knows a map, with the same gains."""
        return replace(self, environment=environment)

    def get_environment(self) -> Environment:
        """Return the map; raise ParameterError if `inform` was not called before."""
        if self.environment is None:
            raise ParameterError(f"controller {self.name!r}: expected a map, call inform(environment) first")
        return self.environment


def build_configuration_space(environment: Environment, clearance: float) -> shapely.Geometry:
    """Build the space in which the centers of robots can be.

    Parameters
    ----------
    environment : Environment
    clearance : float, m
        Distance that centers keep from walls.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon

    Raises
    ------
    ParameterError
        If the space is empty.
    """
    free_space = environment.free.buffer(-clearance, quad_segs=_QUARTER_CIRCLE_EDGES)
    configuration_space = free_space.simplify(_SIMPLIFICATION_M)
    if configuration_space.is_empty:
        raise ParameterError(
            f"map {environment.name!r}: no space for robots that keep {clearance:g} m from its walls"
        )
    return configuration_space
