"""The control laws, one file each, and how they are found by name.

A controller is named in one of three ways: a built-in name (``rapf``), a name that an installed
package offers in the entry-point group ``robocov.controllers``, or a class in a file
(``mine.py:MyController``).

To find one of the latter two runs its code. So `controller_kind` and `make_controller` are for names that
somebody has typed: on a command line, in a study file, in a program. A name that stands in a file of
results is only looked up in `CONTROLLERS`, and shown by `short_name`.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.controllers.atlas import Atlas, AtlasShared
from robocov.controllers.barrier import Barrier
from robocov.controllers.base import Controller, Information, information_of, informed
from robocov.controllers.dispersion import Dispersion
from robocov.controllers.faults import MODULE, fault_of
from robocov.controllers.gains import gain_values, gains_of, with_gains
from robocov.controllers.geodesic_lloyd import GeodesicLloyd
from robocov.controllers.howard import Howard
from robocov.controllers.individual import IndividualController, Individually, OwnView
from robocov.controllers.lloyd import Lloyd
from robocov.controllers.poduri import Poduri
from robocov.controllers.range_limited import RangeLimited
from robocov.controllers.rapf import Rapf
from robocov.controllers.rpf import Rpf
from robocov.controllers.tangentbug import TangentBug
from robocov.controllers.user_modules import Source, TextLoader, provided
from robocov.errors import ParameterError, shown, unknown_name

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "CONTROLLERS",
    "FLAGSHIP",
    "Atlas",
    "AtlasShared",
    "Barrier",
    "Controller",
    "Dispersion",
    "GeodesicLloyd",
    "Howard",
    "IndividualController",
    "Individually",
    "Information",
    "Lloyd",
    "OwnView",
    "Poduri",
    "RangeLimited",
    "Rapf",
    "Rpf",
    "TangentBug",
    "controller_kind",
    "controller_kinds",
    "gain_values",
    "gains_of",
    "information_of",
    "informed",
    "make_controller",
    "remembers",
    "short_name",
]

CONTROLLERS: dict[str, type[Any]] = {
    kind.name: kind
    for kind in (
        # the default comparison first, in its order
        *(Rapf, Rpf, Lloyd, Atlas),
        *(Howard, Poduri, Dispersion, RangeLimited, TangentBug, Barrier, GeodesicLloyd),
        AtlasShared,
    )
}
"""The built-in controllers by name."""

FLAGSHIP = "rapf"
"""The controller that the project recommends."""

_FORGETFUL: tuple[type[Any], ...] = (Rapf, Rpf, Lloyd, RangeLimited, Individually)
"""Controllers that remember nothing but what makes the next decision quicker."""


def remembers(controller: object) -> bool:
    """Return whether what a controller remembers may change what it decides."""
    return type(controller) not in _FORGETFUL


def short_name(controller: str) -> str:
    """Return what a controller of any name is called, without loading it.

    >>> short_name("rapf"), short_name("somewhere/mine.py:Mine")
    ('RAPF', 'Mine')
    """
    return str(getattr(CONTROLLERS.get(controller), "label", controller.rpartition(":")[2]))


def controller_kinds() -> dict[str, type[Any]]:
    """Return all controller classes by name: built in, then those that installed packages offer.

    One that cannot be loaded is left out.
    """
    return {**_offered(), **CONTROLLERS}


def _offered(only: str | None = None) -> dict[str, type[Any]]:
    """Return the controllers that installed packages offer, or the one called `only`.

    One that cannot be loaded is an error where it is asked for by name, and left out otherwise: it
    must not stand in the way of the others.
    """
    kinds: dict[str, type[Any]] = {}
    for entry in entry_points(group="robocov.controllers"):
        if entry.name in CONTROLLERS or (only is not None and entry.name != only):
            continue
        try:
            kinds[entry.name] = _named(entry.load(), entry.name)
        except (Exception, SystemExit) as error:
            if only is not None:
                where = f"controller {entry.name!r} of entry point {entry.value!r} cannot be loaded"
                raise fault_of(where, error) from error
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

    Parameters
    ----------
    name : str
    source : Source or None
        The file and the modules that it imports, which then need not be there; by default they are read.

    Raises
    ------
    ParameterError
        When there is none; the message gives the nearest name, or what is wrong with the file.
    """
    if ".py:" in name or name.endswith(".py"):
        return _kind_in_file(name, source)
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    offered = _offered(name)
    if name not in offered:
        raise ParameterError(unknown_name("controller", name, controller_kinds()))
    return offered[name]


def make_controller(
    name: str, gains: Mapping[str, object] | None = None, *, source: Source | None = None
) -> Controller:
    """Return the controller called `name` with the given gains, all others at their defaults.

    `source` is as in `controller_kind`.

    >>> make_controller("rapf", {"k_rep": 0.3}).k_rep
    0.3

    Raises
    ------
    ParameterError
        On an unknown controller or gain (with the nearest name), or a gain out of range.
    """
    kind = controller_kind(name, source=source)
    controller = with_gains(kind, gains or {})
    if isinstance(controller, IndividualController) and not hasattr(controller, "decide"):
        return Individually(controller)
    return controller  # type: ignore[no-any-return]


def _kind_in_file(name: str, source: Source | None) -> type[Any]:
    file, _, class_name = name.rpartition(":")
    if not class_name or not file.endswith(".py"):
        raise ParameterError(
            f"controller {shown(name)}: a file and a class, as in mine.py:MyController, was wanted"
        )
    path = Path(os.path.realpath(file)) if source is None else Path(source.path)
    if source is None and not path.is_file():
        raise ParameterError(f"controller {shown(name)}: there is no file {file}")
    # a name of its own for each file, so that two files called mine.py do not replace each other
    module_name = f"{MODULE}{hashlib.sha256(str(path).encode()).hexdigest()[:12]}"
    loader = None if source is None else TextLoader(source.path, source.text)
    spec = importlib.util.spec_from_file_location(module_name, path, loader=loader)
    if spec is None or spec.loader is None:
        raise ParameterError(f"controller {shown(name)}: {file} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    try:
        with provided({} if source is None else source.modules):
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise fault_of(f"controller {shown(name)}: {file} cannot be run", error) from error
    kinds = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type) and (hasattr(value, "decide") or hasattr(value, "force"))
    }
    if class_name not in kinds:
        if class_name in vars(module):
            raise ParameterError(
                f"controller {shown(name)}: {class_name} has neither a method decide(seen, memory) "
                f"nor force(own)"
            )
        raise ParameterError(f"controller {file}: {unknown_name('class', class_name, kinds)}")
    kind = kinds[class_name]
    parameters = getattr(kind, "__dataclass_params__", None)
    if parameters is None or not parameters.frozen:
        raise ParameterError(
            f"controller {shown(name)}: {class_name} is not a frozen dataclass; "
            f"@dataclass(frozen=True) above it was wanted"
        )
    return _named(kind, class_name)
