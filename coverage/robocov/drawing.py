"""How the library reaches pictures without knowing how to draw: backends that installed packages offer.

A backend is an object, most simply a module, with the functions of `DrawingBackend`, and has a name in
the entry-point group ``robocov.drawing``; in the same way pandas finds who plots for it. The application
offers ``matplotlib``.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, ClassVar, Protocol

from robocov.errors import ParameterError, RobocovError, unknown_name

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

    def plot_environment(self, environment: Any, axes: Any = None, **options: Any) -> Any:
        """Plot an `Environment`, and return the axes."""

    def plot_record(self, record: Any, axes: Any = None, **options: Any) -> Any:
        """Plot a `Record`: the map, where the robots began, went and ended; and return the axes."""

    def plot_history(self, history: Any, axes: Any = None, **options: Any) -> Any:
        """Plot the mean distance of a `CostHistory` against time, and return the axes."""

    def plot_result(self, result: Any, axes: Any = None, **options: Any) -> Any:
        """Plot the distances of a `CoverageResult` from each place to its robot, and return the axes."""

    def environment_html(self, environment: Any) -> str:
        """Return what a notebook shows of a map."""

    def environment_png(self, environment: Any) -> bytes:
        """Return a picture of a map for where there is no HTML."""

    def record_html(self, record: Any) -> str:
        """Return what a notebook shows of a run: it can be played."""

    def record_png(self, record: Any) -> bytes:
        """Return a picture of a run for where there is no HTML."""


class Drawable:
    """A thing that backends draw; notebooks show it where the backend has an HTML page or a PNG of it."""

    _drawn_as: ClassVar[str]
    """In the names of the backend's functions."""

    def plot(self, axes: Any = None, *, backend: str | None = None, **options: Any) -> Any:
        """Plot it.

        Parameters
        ----------
        axes : matplotlib Axes or None
            Where to draw. None makes a page with what belongs to it, as a title, a scale bar or a legend.
        backend : str or None
            Who draws; see `robocov.drawing`. matplotlib by default, and with its axes and options:
        theme : {"light", "dark"}
        size : (width, height), px
            Of the page.
        colours : {"paper", "robots"}
            Of a record: green starts, red trajectories, blue final positions, or a hue for each robot.
        mean_distance, mean_time : float, m, s
            Of a record's final positions, for the page's title.
        label, controller, title : str
            Of a cost history: the curve's name, whose it is (the paper's controllers have colours of their
            own), and the page's title.
        radius : float or (n,), m
            Of the robots of a coverage result.

        Returns
        -------
        matplotlib Axes
            The given ones, or those on the page, which is their ``figure``; notebooks show the page.

        Raises
        ------
        ParameterError
            On axes or options that cannot be used.
        """
        return getattr(drawing_backend(backend), f"plot_{self._drawn_as}")(self, axes, **options)

    def _repr_html_(self) -> Any:
        return self._displayed("html")

    def _repr_png_(self) -> Any:
        return self._displayed("png")

    def _displayed(self, form: str) -> Any:
        """Return what a notebook shows; None, for the text, where nobody draws it."""
        try:
            draw = getattr(drawing_backend(), f"{self._drawn_as}_{form}", None)
        except RobocovError:
            return None
        return None if draw is None else draw(self)


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
