"""The coverage cost of a map, computed with a progress display, and figures of the distances to robots."""

from pathlib import Path

from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import format_count
from robocov.geodesic import Geodesics
from robocov.mapfile.check import MANY_VERTICES, count_vertices
from robocov.team import Team
from robocov.typing import FloatArray
from robocov_app.terminal.progress import show_late_progress

AREA_TOLERANCE_M2 = 1e-6
"""Maximum difference between the uncovered areas of two placements that is attributed to rounding."""
MIN_FIGURE_LATTICE = 256
"""Minimum lattice size of figures of distances, so that its cells are narrower than most walls."""
MIN_VIDEO_LATTICE = 128
"""Minimum lattice size of videos. It is smaller because distances are computed for every frame."""


def build_cost(
    environment: Environment,
    lattice: int,
    *,
    radius: float = DEFAULT_RADIUS_M,
    quiet: bool = False,
    geodesics: Geodesics | None = None,
) -> CoverageCost:
    """Build the coverage cost of a map, and show progress if it takes more than a second.

    Parameters
    ----------
    environment : Environment
        The map.
    lattice : int
        Number of sites along each side of the map.
    radius : float, m
        Radius of the smallest robot; see `CoverageCost`.
    quiet : bool
        Whether to hide progress.
    geodesics : Geodesics or None
        Shortest paths of the map for this radius, if they have been computed already.

    Returns
    -------
    CoverageCost
    """
    with show_late_progress("shortest paths", quiet=quiet) as update:
        return CoverageCost(environment, lattice, radius=radius, progress=update, geodesics=geodesics)


def refine_cost_for_figures(
    environment: Environment, cost: CoverageCost, lattice: int | None = None
) -> CoverageCost:
    """Return a cost on a lattice that is fine enough for a figure.

    Parameters
    ----------
    environment : Environment
        The map.
    cost : CoverageCost
        Cost of this map. It is returned unchanged if it is fine enough, or if a finer cost would take too
        long because the map has many vertices.
    lattice : int or None
        Minimum lattice size. None stands for `MIN_FIGURE_LATTICE`.

    Returns
    -------
    CoverageCost
    """
    if lattice is None:
        lattice = MIN_FIGURE_LATTICE
    if cost.lattice >= lattice or count_vertices(environment) > MANY_VERTICES:
        return cost
    return build_cost(environment, lattice, radius=cost.radius, quiet=True, geodesics=cost.geodesics)


def save_distance_figure(
    path: Path,
    cost: CoverageCost,
    positions: FloatArray,
    mean: str,
    *,
    title: str,
    theme: str,
    speeds: FloatArray | None = None,
    radius: float = DEFAULT_RADIUS_M,
) -> None:
    """Draw a map of the distances to the nearest robot, and save it.

    Parameters
    ----------
    path : Path
        PNG, SVG or PDF file.
    cost : CoverageCost
        Cost of the map.
    positions : (n, 2) array, m
        Positions of the robots.
    mean : str
        Text about the mean distance, for the caption.
    title : str
        Title of the figure.
    theme : str
        ``light`` or ``dark``.
    speeds : (n,) array or None, m/s
        Speeds of the robots. If given, the nearest robot is the one that arrives first.
    radius : float, m
        Radius of the robots.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from robocov_app.figures.coverage import DistanceSnapshot, plot_coverage
    from robocov_app.figures.files import save_figure
    from robocov_app.render.distance_map.pixel_distances import DistanceField
    from robocov_app.render.distance_map.site_lattice import FieldLattice

    team = Team.homogeneous(len(positions), radius=radius)
    field = DistanceField(FieldLattice(cost.sites), cost(positions, speeds))
    robots = format_count(len(team), "robot")
    snapshot = DistanceSnapshot(cost.environment, team, field, cost.environment.name, f"{robots}, {mean}")
    save_figure(plot_coverage([], [snapshot], theme=theme, title=title), path)
