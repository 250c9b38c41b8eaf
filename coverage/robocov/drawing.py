"""Drawing backends of installed packages: how the library reaches pictures without knowing how to draw.

A backend is an object, most simply a module, with the functions of `DrawingBackend` and a name in the
entry-point group ``robocov.drawing``, as pandas has it. The application offers ``matplotlib``.
"""

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, ClassVar, Protocol

from robocov.errors import ParameterError, RobocovError, describe_unknown_name

GROUP = "robocov.drawing"
DEFAULT = "matplotlib"
"""The backend that draws where none is named; where it is not there, the first by name."""


class DrawingBackend(Protocol):
    """Interface of a drawing backend; axes and options are the backend's own types.

    ``plot_...(thing, axes=None, **options)`` draws on the axes and returns them; where they are None, on a
    page of its own, and returns that page's. Notebooks show what ``..._html(thing)`` returns, a str, and
    where there is no HTML ``..._png(thing)``, bytes; and what ``show(map, **options)`` returns, see `show`.
    """

    plot_environment: Callable[..., Any]
    plot_record: Callable[..., Any]
    plot_history: Callable[..., Any]
    plot_result: Callable[..., Any]
    environment_html: Callable[[Any], str]
    environment_png: Callable[[Any], bytes]
    record_html: Callable[[Any], str]
    record_png: Callable[[Any], bytes]
    show: Callable[..., Any]


class Drawable:
    """A thing that backends draw; notebooks show it where the backend has an HTML page or a PNG of it."""

    _drawn_as: ClassVar[str]  # in the names of the backend's functions

    def plot(self, axes: Any = None, *, backend: str | None = None, **options: Any) -> Any:
        """Plot it on axes, or on a page with a title, a scale bar or a legend; return the axes.

        Parameters
        ----------
        axes : matplotlib Axes or None
            None makes the page, which is the ``figure`` of the axes that are returned.
        backend : str or None
            See `robocov.drawing`; matplotlib by default, with these options:
        theme, size : {"light", "dark"}, (width, height) of the page, px
        colours : {"paper", "robots"}
            Of a record: green starts, red trajectories, blue final positions, or a hue for each robot.
        mean_distance, mean_time : float, m, s
            Of a record's final positions, for the page's title.
        label, controller, title : str
            Of a cost history: the curve's name, whose it is (the paper's controllers have colours of their
            own), and the page's title.
        radius : float or (n,), m
            Of the robots of a coverage result.

        Raises ParameterError on axes or options that cannot be used.
        """
        return getattr(load_drawing_backend(backend), f"plot_{self._drawn_as}")(self, axes, **options)

    def _repr_html_(self) -> Any:
        return self._displayed("html")

    def _repr_png_(self) -> Any:
        return self._displayed("png")

    def _displayed(self, form: str) -> Any:
        try:
            draw = getattr(load_drawing_backend(), f"{self._drawn_as}_{form}", None)
        except RobocovError:
            return None  # notebooks show the text instead
        return None if draw is None else draw(self)


def show(map: Any, **options: Any) -> Any:  # noqa: A002 - as everywhere else
    """Show the interactive window of a map live in a notebook's cell: what is returned, as its last line.

    Parameters
    ----------
    map : str, Path, Environment or Simulation
        A bundled map's name, a file, the map itself, or what is to go on, with all but `height` as there.
    robots, seed : int
        How many robots start, and the seed of where: 6 and 0 by default.
    controllers : sequence of str
        Up to four, side by side: names, or mine.py:MyController.
    height : int
        Of the cell, px.

    Needs ``robocov[web]``; without it, a replay of one minute is returned. Raises RobocovError for whatever
    the window cannot begin with.
    """
    return load_drawing_backend().show(map, **options)


def load_drawing_backend(name: str | None = None) -> DrawingBackend:
    """Return the backend called `name`.

    Raises ParameterError for an unknown name, RobocovError when there is none at all or it cannot be loaded.
    """
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not entries:
        what = f"no drawing backend is installed (entry-point group {GROUP!r})"
        raise RobocovError(f"{what}: pip install robocov")
    name = (DEFAULT if DEFAULT in entries else min(entries)) if name is None else name
    if name not in entries:
        raise ParameterError(describe_unknown_name("drawing backend", name, entries))
    entry = entries[name]
    try:
        backend: DrawingBackend = entry.load()
    except Exception as error:
        what = f"drawing backend {name!r} of entry point {entry.value!r} cannot be loaded"
        raise RobocovError(f"{what}: {type(error).__name__}: {error}") from error
    return backend
