"""How the library reaches pictures without knowing how to draw: backends that installed packages offer.

A backend is an object, most simply a module, with the functions of `DrawingBackend`, and has a name in
the entry-point group ``robocov.drawing``; in the same way pandas finds who plots for it. The application
offers ``matplotlib``.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, Protocol

from robocov.errors import ParameterError, RobocovError, unknown_name

if TYPE_CHECKING:
    from robocov.cost import CoverageResult
    from robocov.environment import Environment
    from robocov.metrics import CostHistory
    from robocov.record import Record

GROUP = "robocov.drawing"
"""The entry-point group."""

DEFAULT = "matplotlib"
"""The backend that draws where none is named; where it is not there, the first by name."""


class DrawingBackend(Protocol):
    """Who draws.

    What `axes` are is the backend's affair. Where they are given, the functions draw there and return
    them; where they are None, on a page of their own, and they return that page's. The options are the
    backend's as well.
    """

    def plot_environment(self, environment: Environment, axes: Any = None, **options: Any) -> Any:
        """Plot a map, and return the axes."""

    def plot_record(self, record: Record, axes: Any = None, **options: Any) -> Any:
        """Plot a run: the map, where the robots began, went and ended; and return the axes."""

    def plot_history(self, history: CostHistory, axes: Any = None, **options: Any) -> Any:
        """Plot the mean distance against time, and return the axes."""

    def plot_result(self, result: CoverageResult, axes: Any = None, **options: Any) -> Any:
        """Plot the distance of every place to its nearest robot, and return the axes."""

    def environment_html(self, environment: Environment) -> str:
        """Return what a notebook shows of a map."""

    def environment_png(self, environment: Environment) -> bytes:
        """Return a picture of a map for where there is no HTML."""

    def record_html(self, record: Record) -> str:
        """Return what a notebook shows of a run."""

    def record_png(self, record: Record) -> bytes:
        """Return a picture of a run for where there is no HTML."""


def drawing_backend(name: str | None = None) -> DrawingBackend:
    """Return the backend called `name`, by default ``matplotlib``.

    Raises
    ------
    ParameterError
        When there is none of that name; the message gives the nearest.
    RobocovError
        When there is none at all, or it cannot be loaded.
    """
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not entries:
        raise RobocovError(
            f"no drawing backend is installed (entry-point group {GROUP!r}): pip install robocov"
        )
    if name is None:
        name = DEFAULT if DEFAULT in entries else min(entries)
    if name not in entries:
        raise ParameterError(unknown_name("drawing backend", name, entries))
    entry = entries[name]
    try:
        backend: DrawingBackend = entry.load()
    except Exception as error:
        raise RobocovError(
            f"drawing backend {name!r} of entry point {entry.value!r} cannot be loaded: "
            f"{type(error).__name__}: {error}"
        ) from error
    return backend


def displaying_backend() -> DrawingBackend | None:
    """Return who draws for notebooks, None where nobody can: they show the text then."""
    try:
        return drawing_backend()
    except RobocovError:
        return None
