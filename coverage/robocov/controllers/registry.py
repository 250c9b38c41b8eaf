"""Controllers by name.

A controller is named in one of three ways: a built-in name (``rapf``), a name that an installed package
offers in the entry-point group ``robocov.controllers``, or a class in a file (``mine.py:MyController``).

The latter two can only be loaded by running their code. Therefore `load_controller_class` and
`make_controller` are for names that a user has entered: on a command line, in a study file, in a program. A
name in a file of results is only looked up in `CONTROLLERS`, and shown by `get_controller_label`.
"""

import warnings
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from robocov.controllers.adaptive import Adaptive
from robocov.controllers.barrier import Barrier
from robocov.controllers.base import Controller, Information
from robocov.controllers.boosting import Boosting
from robocov.controllers.diffeomorphism import Diffeomorphism
from robocov.controllers.exploration.atlas import Atlas
from robocov.controllers.exploration.atlas_shared import AtlasShared
from robocov.controllers.exploration.exploring_lloyd import ExploringLloyd
from robocov.controllers.exploration.frontier_median import FrontierMedian
from robocov.controllers.exploration.greedy_submodular import GreedySubmodular
from robocov.controllers.exploration.voronoi_graph import VoronoiGraphCoverage
from robocov.controllers.gains import Option, Value, get_gains, instantiate_controller, update_name
from robocov.controllers.geodesic_lloyd import GeodesicLloyd
from robocov.controllers.gp_ucb import GpUcb
from robocov.controllers.individual import to_team_controller, unwrap_controller
from robocov.controllers.lloyd import Lloyd, RangeLimited
from robocov.controllers.placement.exemplar import Exemplar
from robocov.controllers.placement.local_search import LocalSearch
from robocov.controllers.repulsion import Dispersion, Howard, Poduri, Rapf, Rpf
from robocov.controllers.tangentbug import TangentBug
from robocov.controllers.user_modules import ControllerSource, explain_fault, load_class
from robocov.controllers.visibility import Visibility
from robocov.errors import ParameterError, describe_unknown_name, find_similar_names, quote, require_type

_MIN_CLASS_NAME_SIMILARITY = 0.75
"""Minimum similarity of a built-in name that is suggested for a name with capital letters."""

CONTROLLERS: dict[str, type[Any]] = {
    kind.name: kind
    for kind in (
        # Lists of controllers, for example in the window, have this order: first the controllers of the
        # default comparison, then Atlas, and then all others.
        Rapf,
        Rpf,
        Lloyd,
        Atlas,
        Howard,
        Poduri,
        Dispersion,
        RangeLimited,
        TangentBug,
        Barrier,
        GeodesicLloyd,
        Visibility,
        Boosting,
        Adaptive,
        GpUcb,
        ExploringLloyd,
        Diffeomorphism,
        FrontierMedian,
        GreedySubmodular,
        VoronoiGraphCoverage,
        AtlasShared,
        LocalSearch,
        Exemplar,
    )
}
"""The built-in controllers by name."""

RECOMMENDED_CONTROLLERS: dict[Information, str] = {"own": "atlas", "shared map": "atlas-shared"}
"""The best controller on the benchmark of those that use only this information."""

ENTRY_POINT_GROUP = "robocov.controllers"
"""Group of entry points in which installed packages offer controllers."""
_MEMORYLESS: tuple[type[Any], ...] = (Rapf, Rpf, Lloyd, RangeLimited)
"""Controllers whose memory only saves time at the next decision."""


def has_memory(controller: object) -> bool:
    """Return whether the memory of a controller may change its decisions.

    Parameters
    ----------
    controller : Controller

    Returns
    -------
    bool
        True for all individual controllers: they may assign ``own.memory`` in any step, with or without a
        method ``begin``.

    Examples
    --------
    >>> has_memory(Rapf()), has_memory(Atlas())
    (False, True)
    """
    return type(controller) not in _MEMORYLESS


def get_recorded_name(controller: Controller) -> str:
    """Return the name of a controller in records.

    Parameters
    ----------
    controller : Controller

    Returns
    -------
    str
        The attribute ``name``, or the name of the class if a built-in controller of another class has that
        name. A subclass of a built-in controller inherits its name, but its records must not be repeated with
        the built-in controller.
    """
    kind = type(unwrap_controller(controller))
    is_other_kind = controller.name in CONTROLLERS and CONTROLLERS[controller.name] is not kind
    return kind.__name__ if is_other_kind else controller.name


def get_controller_label(name: str) -> str:
    """Return the label of a controller without loading it.

    Parameters
    ----------
    name : str
        Name of a controller, or ``file.py:Class``.

    Returns
    -------
    str
        The label of a built-in controller; otherwise the name of the class, or the name itself.

    Examples
    --------
    >>> get_controller_label("rapf"), get_controller_label("somewhere/mine.py:Mine")
    ('RAPF', 'Mine')
    """
    if name in CONTROLLERS:
        return str(CONTROLLERS[name].label)
    return name.rpartition(":")[2]


def list_controller_classes() -> dict[str, type[Any]]:
    """List all controller classes by name: those of installed packages and the built-in ones.

    Returns
    -------
    dict of str to type
        A class of an installed package that cannot be loaded is left out, with a warning.

    See Also
    --------
    make_controller : Make a controller by name.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.list_controller_classes()["rapf"] is rc.Rapf
    True
    """
    classes: dict[str, type[Any]] = {}
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            classes[entry.name] = _load_entry(entry)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # Any package may raise anything on import, even SystemExit.
            warnings.warn(str(_explain_entry_fault(entry, error)), stacklevel=2)
    return {**classes, **CONTROLLERS}


def _load_entry(entry: EntryPoint) -> type[Any]:
    """Load the controller class of an installed package, which runs its code."""
    if entry.name in CONTROLLERS:
        raise ParameterError("expected a name other than that of a built-in controller")
    return _add_names(entry.load(), entry.name)


def _explain_entry_fault(entry: EntryPoint, error: BaseException) -> Exception:
    """Return the error that explains why a controller of an installed package cannot be loaded."""
    return explain_fault(f"controller {entry.name!r} of entry point {entry.value!r} cannot be loaded", error)


def _add_names(kind: type[Any], name: str) -> type[Any]:
    """Set the name, label and summary that a class does not define itself, and return the class."""
    summary = (kind.__doc__ or "").strip().split("\n")[0]
    defaults = {"name": name, "label": kind.__name__, "summary": summary}
    for attribute, default in defaults.items():
        if not hasattr(kind, attribute):
            setattr(kind, attribute, default)
    return kind


def load_controller_class(name: str, *, source: ControllerSource | None = None) -> type[Any]:
    """Load a controller class. This runs code outside robocov, unless the class is built in.

    Parameters
    ----------
    name : str
        A built-in name, a name that an installed package offers, or ``file.py:ClassName``.
    source : ControllerSource or None
        Text of the file, and of the modules that it imports, which then need not exist.

    Returns
    -------
    type

    Raises
    ------
    ParameterError
        If there is no such controller (the message suggests the most similar name), or if its code cannot be
        run.

    Examples
    --------
    >>> load_controller_class("rapf").label
    'RAPF'
    """
    require_type("controller", name, str, "a name, as in 'rapf' or 'mine.py:MyController'")
    if ".py:" in name or name.endswith(".py"):
        return _add_names(load_class(name, source), name.rpartition(":")[2])
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    # Only the package that offers the name is loaded. If several do, the last one counts.
    entries = [entry for entry in entry_points(group=ENTRY_POINT_GROUP) if entry.name == name]
    if not entries:
        raise ParameterError(_describe_unknown_controller(name))
    entry = entries[-1]
    try:
        return _load_entry(entry)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise _explain_entry_fault(entry, error) from error


def _describe_unknown_controller(name: str) -> str:
    """Return the message for an unknown name, with a hint if it looks like a class in a Python file."""
    file, _, class_name = name.partition(":")
    if file and class_name:
        return f"unknown controller {quote(name)}: for a class in a file, write {file}.py:{class_name}"
    known_names = list_controller_classes()
    class_name = name.rpartition(".")[2]
    # Only names of classes contain capital letters.
    is_class_name = class_name.isidentifier() and class_name != class_name.lower()
    if is_class_name and not find_similar_names(name.lower(), known_names, _MIN_CLASS_NAME_SIMILARITY):
        return (
            f"unknown controller {quote(name)}: for a class in a file, write FILE.py:{class_name}; "
            "`robocov controllers` lists the built-in controllers"
        )
    return describe_unknown_name("controller", name, known_names)


def update_gain_names(controller: str, gains: Mapping[str, Value]) -> dict[str, Value]:
    """Return the gains in a file with the current names of gains and choices.

    Parameters
    ----------
    controller : str
        Name of the controller. The gains of controllers outside robocov are returned unchanged.
    gains : mapping of str to float, str or None

    Returns
    -------
    dict

    Examples
    --------
    >>> update_gain_names("poduri", {"neighbours": 3.0})
    {'neighbors': 3.0}
    """
    known = get_gains(CONTROLLERS.get(controller))
    updated: dict[str, Value] = {}
    for given_name, value in gains.items():
        name = update_name(given_name, known)
        declared = known.get(name)
        if isinstance(declared, Option) and isinstance(value, str):
            value = update_name(value, declared.choices)
        updated[name] = value
    return updated


def make_controller(
    name: str, gains: Mapping[str, object] | None = None, *, source: ControllerSource | None = None
) -> Controller:
    """Make a controller by name. This runs code outside robocov, unless the controller is built in.

    Parameters
    ----------
    name : str
        As for `load_controller_class`.
    gains : mapping of str to object, or None
        Values of gains; all others have their defaults.
    source : ControllerSource or None
        As for `load_controller_class`.

    Returns
    -------
    Controller

    Raises
    ------
    ParameterError
        If there is no such controller or gain (the message suggests the most similar name), or if a value is
        out of range.

    See Also
    --------
    list_controller_classes : The names of all controllers.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.make_controller("rapf", {"k_rep": 0.3}).k_rep
    0.3
    """
    kind = load_controller_class(name, source=source)
    controller: Controller = to_team_controller(instantiate_controller(kind, gains or {}))
    return controller
