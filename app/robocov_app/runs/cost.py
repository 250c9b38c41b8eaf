"""The coverage cost of a map, with progress; and its picture."""

from pathlib import Path

from robocov.arrays import Array
from robocov.cost import CoverageCost
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import format_count
from robocov.geodesic import Geodesics
from robocov.mapfile.check import MANY_VERTICES, count_vertices
from robocov.team import Team
from robocov_app.terminal.progress import late_progress

PICTURE_LATTICE = 256  # coarsest lattice for maps of distances: its cells are to be narrower than walls
FILM_LATTICE = 128  # the same for films, of which every frame takes its time


def built_cost(
    environment: Environment, lattice: int, *, quiet: bool = False, geodesics: Geodesics | None = None
) -> CoverageCost:
    """Return the coverage cost of a map; unless `quiet`, tell how far it is when it takes over a second."""
    with late_progress("map of ways", quiet=quiet) as tell:
        return CoverageCost(environment, lattice, progress=tell, geodesics=geodesics)


def cost_for_pictures(environment: Environment, cost: CoverageCost, least: int | None = None) -> CoverageCost:
    """Return `cost`, or where its lattice is too coarse to be drawn and the map is simple a finer one."""
    least = least or PICTURE_LATTICE
    if cost.lattice >= least or count_vertices(environment) > MANY_VERTICES:
        return cost
    return built_cost(environment, least, quiet=True, geodesics=cost.geodesics)


def draw_distances(
    path: Path,
    cost: CoverageCost,
    positions: Array,
    mean: str,
    *,
    title: str,
    theme: str,
    speeds: Array | None = None,
    radius: float = DEFAULT_RADIUS_M,
) -> None:
    """Draw a map of the distances to the nearest robot, under words on their mean."""
    from robocov_app.figures.coverage import Moment, plot_coverage
    from robocov_app.figures.files import save_figure
    from robocov_app.render.distance_field import Field, FieldLattice

    team = Team.homogeneous(len(positions), radius=radius)
    field, facts = Field(FieldLattice(cost.sites), cost(positions, speeds)), format_count(len(team), "robot")
    moment = Moment(cost.environment, team, field, cost.environment.name, f"{facts}, {mean}")
    save_figure(plot_coverage([], [moment], theme, title=title), path)
