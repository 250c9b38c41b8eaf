"""Drawing backends, which plot maps, runs and results for the library.

A backend is an object, most simply a module, with the functions of `DrawingBackend`. Its package registers it
in the entry-point group ``robocov.drawing``, as plotting backends of pandas are registered. The application
provides the backend ``matplotlib``.
"""

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, ClassVar, Protocol

from robocov.errors import ParameterError, RobocovError, describe_unknown_name

ENTRY_POINT_GROUP = "robocov.drawing"
DEFAULT_BACKEND = "matplotlib"
"""Backend to use if none is named; if it is not installed, the first one by name is used."""


class DrawingBackend(Protocol):
    """Interface of a drawing backend; axes and options are the backend's own types.

    Attributes
    ----------
    plot_environment, plot_record, plot_history, plot_result, plot_comparison : callable
        ``plot_...(item, axes=None, **options)`` draws an item on axes and returns the axes. If `axes` is
        None, the item is drawn on a new page.
    render_environment_html, render_record_html, render_comparison_html : callable
        Return the HTML, a str, that a notebook displays for an item.
    render_environment_png, render_record_png, render_comparison_png : callable
        Return the image, bytes, that a notebook displays if it displays no HTML.
    show : callable
        ``show(map, **options)`` returns the object that a notebook displays for `robocov.show`.
    """

    plot_environment: Callable[..., Any]
    plot_record: Callable[..., Any]
    plot_history: Callable[..., Any]
    plot_result: Callable[..., Any]
    plot_comparison: Callable[..., Any]
    render_environment_html: Callable[[Any], str]
    render_environment_png: Callable[[Any], bytes]
    render_record_html: Callable[[Any], str]
    render_record_png: Callable[[Any], bytes]
    render_comparison_html: Callable[[Any], str]
    render_comparison_png: Callable[[Any], bytes]
    show: Callable[..., Any]


class Drawable:
    """Base class of objects that a backend can draw, and that notebooks display as an image."""

    _drawing_name: ClassVar[str]
    """Name of the class in the names of a backend's functions, such as "record" in ``plot_record``."""

    def plot(self, axes: Any = None, *, backend: str | None = None, **options: Any) -> Any:
        """Plot the object on axes, or on a page with a title, a scale bar or a legend.

        Parameters
        ----------
        axes : matplotlib.axes.Axes or None
            Axes to draw on; by default those of a new page, which is ``axes.figure``. A comparison is always
            drawn on a new page, with one panel for each run.
        backend : str or None
            Name of a drawing backend, see `robocov.drawing`; ``matplotlib`` by default.
        **options
            Options of the backend. Those of ``matplotlib`` are:

            theme : {"light", "dark"}
            size : (width, height), px
                Size of the page.
            colors : {"paper", "robots"}
                Of a record or comparison: green starts, red trajectories and blue final positions, or a hue
                for each robot.
            mean_distance, mean_time : float, m, s
                Of a record's final positions, for the title of the page.
            label, controller, title : str
                Of a cost history: the label of the curve, the controller (those of the paper have their own
                colors), and the title of the page.
            radius : float or (n,) array, m
                Of a coverage result: the radii of the robots.

        Returns
        -------
        matplotlib.axes.Axes
            The axes with the drawing. Another backend may return something else.

        Raises
        ------
        ParameterError
            If the axes or an option cannot be used, or there is no such backend.
        RobocovError
            If no backend is installed, or it cannot be loaded.
        """
        plot = getattr(load_drawing_backend(backend), f"plot_{self._drawing_name}")
        return plot(self, axes, **options)

    def _repr_html_(self) -> Any:
        return self._draw_for_notebook("html")

    def _repr_png_(self) -> Any:
        return self._draw_for_notebook("png")

    def _draw_for_notebook(self, format_name: str) -> Any:
        """Return the drawing as "html" or "png". If it is None, the notebook displays the repr."""
        try:
            backend = load_drawing_backend()
        except RobocovError:
            return None
        draw = getattr(backend, f"render_{self._drawing_name}_{format_name}", None)
        return None if draw is None else draw(self)


def show(map: Any, **options: Any) -> Any:  # noqa: A002 - The parameter has this name in all functions.
    """Show the interactive window of a map in a cell of a notebook.

    Parameters
    ----------
    map : str, Path, Environment or Simulation
        Name of a bundled map, a file, the map itself, or a simulation, as in `Simulation.show`.
    **options
        Options of the window. For a simulation, all except `height` are ignored.

        robots : int
            Number of robots; 6 by default.
        seed : int
            Seed of their starts; 0 by default.
        controllers : str or sequence of str
            Up to four controllers side by side: names, or ``mine.py:MyController``.
        height : int, px
            Height of the cell.

    Returns
    -------
    object
        The window, which the notebook displays if it is the value of the last line of a cell.

    Raises
    ------
    RobocovError
        If an option cannot be used, or the window cannot start.

    See Also
    --------
    Simulation.show : Show a simulation.

    Notes
    -----
    A live window needs ``robocov[web]``. Without it, a replay of one minute is returned.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.show("rooms", robots=4, controllers=["rapf", "lloyd"])  # doctest: +SKIP
    """
    return load_drawing_backend().show(map, **options)


def load_drawing_backend(name: str | None = None) -> DrawingBackend:
    """Load a drawing backend.

    Parameters
    ----------
    name : str or None
        Name of the backend's entry point. By default `DEFAULT_BACKEND` or, if that is not installed, the
        first by name.

    Returns
    -------
    DrawingBackend

    Raises
    ------
    ParameterError
        If the name is unknown.
    RobocovError
        If no backend is installed, or it cannot be loaded.
    """
    entries = {entry.name: entry for entry in entry_points(group=ENTRY_POINT_GROUP)}
    if not entries:
        raise RobocovError(
            f"no drawing backend is installed (entry-point group {ENTRY_POINT_GROUP!r}): pip install robocov"
        )
    if name is None:
        name = DEFAULT_BACKEND if DEFAULT_BACKEND in entries else min(entries)
    if name not in entries:
        raise ParameterError(describe_unknown_name("drawing backend", name, entries))
    entry = entries[name]
    try:
        backend: DrawingBackend = entry.load()
    except Exception as error:
        raise RobocovError(
            f"drawing backend {name!r} of entry point {entry.value!r} cannot be loaded: "
            f"{type(error).__name__}: {error}"
        ) from error
    return backend
