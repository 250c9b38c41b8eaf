"""The control laws, and how they are found by name.

A controller is named in one of three ways: a built-in name (``rapf``), a name that an installed package
offers in the entry-point group ``robocov.controllers``, or a class in a file (``mine.py:MyController``).

To find one of the latter two runs its code. So `controller_kind` and `make_controller` are for names that
somebody has typed: on a command line, in a study file, in a program. A name that stands in a file of
results is only looked up in `CONTROLLERS`, and shown by `short_name`.
"""

import warnings
from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Any

from robocov.controllers.adaptive import Adaptive
from robocov.controllers.atlas import Atlas, AtlasShared
from robocov.controllers.barrier import Barrier
from robocov.controllers.base import (
    Controller,
    IndividualController,
    Individually,
    OwnView,
    for_team,
    information_of,
    informed,
)
from robocov.controllers.boosting import Boosting
from robocov.controllers.diffeomorphism import Diffeomorphism
from robocov.controllers.frontier_median import FrontierMedian
from robocov.controllers.gains import gain_values, gains_of, with_gains
from robocov.controllers.geodesic_lloyd import GeodesicLloyd
from robocov.controllers.greedy_submodular import GreedySubmodular
from robocov.controllers.lloyd import Lloyd, RangeLimited
from robocov.controllers.repulsion import Dispersion, Howard, Poduri, Rapf, Rpf
from robocov.controllers.tangentbug import TangentBug
from robocov.controllers.user_modules import Source, class_in_file, fault_of
from robocov.controllers.visibility import Visibility
from robocov.controllers.voronoi_graph import VoronoiGraphCoverage
from robocov.errors import ParameterError, describe_unknown_name, require_type

__all__ = [
    "CONTROLLERS", "FLAGSHIP", "Adaptive", "Atlas", "AtlasShared", "Barrier", "Boosting", "Controller",
    "Diffeomorphism", "Dispersion", "FrontierMedian", "GeodesicLloyd", "GreedySubmodular", "Howard",
    "IndividualController", "Individually", "Lloyd", "OwnView", "Poduri", "RangeLimited", "Rapf", "Rpf",
    "TangentBug", "Visibility", "VoronoiGraphCoverage",
    "controller_kind", "controller_kinds", "gain_values", "gains_of", "information_of", "informed",
    "make_controller", "remembers", "short_name",
]  # fmt: skip

CONTROLLERS: dict[str, type[Any]] = {
    kind.name: kind
    for kind in (
        *(Rapf, Rpf, Lloyd, Atlas),  # the default comparison, in its order
        *(Howard, Poduri, Dispersion, RangeLimited, TangentBug, Barrier, GeodesicLloyd),
        *(Visibility, Boosting, Adaptive, Diffeomorphism),
        *(FrontierMedian, GreedySubmodular, VoronoiGraphCoverage, AtlasShared),
    )
}
"""The built-in controllers by name."""

FLAGSHIP = "rapf"
"""The controller that the project recommends."""

_FORGETFUL: tuple[type[Any], ...] = (Rapf, Rpf, Lloyd, RangeLimited)
"""Controllers that remember nothing but what makes the next decision quicker."""


def remembers(controller: object) -> bool:
    """Return whether what a controller remembers may change what it decides."""
    if isinstance(controller, Individually):
        return hasattr(controller.law, "begin")
    return type(controller) not in _FORGETFUL


def short_name(controller: str) -> str:
    """Return what a controller of any name is called, without loading it.

    >>> short_name("rapf"), short_name("somewhere/mine.py:Mine")
    ('RAPF', 'Mine')
    """
    return str(getattr(CONTROLLERS.get(controller), "label", controller.rpartition(":")[2]))


def controller_kinds() -> dict[str, type[Any]]:
    """Return all controller classes by name: built in, and those of installed packages that can be loaded."""
    return {**_offered(), **CONTROLLERS}


def _offered(only: str | None = None) -> dict[str, type[Any]]:
    """Return the controllers that installed packages offer and that load, or the one called `only`."""
    kinds: dict[str, type[Any]] = {}
    for entry in entry_points(group="robocov.controllers"):
        if only is not None and entry.name != only:
            continue
        try:
            if entry.name in CONTROLLERS:
                raise ParameterError("the name is that of a built-in one")
            kinds[entry.name] = _named(entry.load(), entry.name)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            where = f"controller {entry.name!r} of entry point {entry.value!r} cannot be loaded"
            if only is not None:
                raise fault_of(where, error) from error
            warnings.warn(str(fault_of(where, error)), stacklevel=2)
    return kinds


def _named(kind: type[Any], name: str) -> type[Any]:
    """Give a class the names that it does not state itself."""
    summary = (kind.__doc__ or "").strip().split("\n")[0]
    for attribute, default in (("name", name), ("label", kind.__name__), ("summary", summary)):
        if not hasattr(kind, attribute):
            setattr(kind, attribute, default)
    return kind


def controller_kind(name: str, *, source: Source | None = None) -> type[Any]:
    """Return the controller class called `name`, or the class of ``file.py:ClassName``; this runs its code.

    `source` is the file with the modules that it imports, which then need not be there. A ParameterError
    gives the nearest name, or what is wrong with the file.
    """
    require_type("controller", name, str, "a name, as in 'rapf' or 'mine.py:MyController',")
    if ".py:" in name or name.endswith(".py"):
        return _named(class_in_file(name, source), name.rpartition(":")[2])
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    offered = _offered(name)
    if name not in offered:
        raise ParameterError(describe_unknown_name("controller", name, controller_kinds()))
    return offered[name]


def make_controller(
    name: str, gains: Mapping[str, object] | None = None, *, source: Source | None = None
) -> Controller:
    """Return the controller called `name` with the given gains, all others at their defaults.

    A ParameterError names an unknown controller or gain (with the nearest name), or a gain out of range.

    >>> make_controller("rapf", {"k_rep": 0.3}).k_rep
    0.3
    """
    controller: Controller = for_team(with_gains(controller_kind(name, source=source), gains or {}))
    return controller
