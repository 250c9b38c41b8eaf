"""`robocov cost`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from robocov.arrays import Array
from robocov.errors import InputError, ParameterError, describe_error, is_number, quote, require_number
from robocov.files.writing import replace_file, resolve_target
from robocov.mapfile import load_map
from robocov_app.commands.options import FigureOptions
from robocov_app.render.density import density_kind, density_lines, mean_label
from robocov_app.runs.cost import build_cost, refine_cost_for_figures, save_distance_figure
from robocov_app.terminal.output import print_answer


@dataclass
class Arguments(FigureOptions):
    """Evaluate the exact coverage cost (22) of given positions; --plot draws a map of the distances.

    Example: robocov cost rooms --positions robots.json --lattice 256
    """

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MAP")]
    """Path to a map JSON, or the name of a bundled map."""
    positions: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """JSON file with a list of [x, y] in metres, one for each robot."""
    speeds: tuple[float, ...] = ()
    """Speed of each robot in m/s, or one for all: who is first at a place counts; cost also in seconds."""
    lattice: int = 128
    """Evaluate on N x N sites over the map."""
    sites: Annotated[Path | None, tyro.conf.arg(metavar="FILE.npz")] = None
    """Save per-site points (m,2), distances (m,) and owner (m,) there, with speeds also times (m,)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("--lattice", self.lattice, 2, 2048, whole=True)
        if self.sites is not None:
            resolve_target(self.sites)


def command(options: Arguments) -> None:
    environment = load_map(options.map)
    robots = read_positions(options.positions)
    speeds = speeds_of(options.speeds, len(robots))
    cost = build_cost(environment, options.lattice, quiet=options.json)
    try:
        result = cost(robots)
        timed = None if speeds is None else cost(robots, speeds)
    except InputError as error:
        raise InputError(f"{options.positions}: {error}") from error
    if options.sites is not None:
        chosen = timed or result
        arrays: dict[str, Any] = {"points": cost.points, "distances": chosen.distances, "owner": chosen.owner}
        with replace_file(options.sites) as part, part.open("wb") as file:
            np.savez(file, **arrays if timed is None else arrays | {"times": timed.times})
    if options.plot is not None:
        mean = f"{mean_label(environment)} {result.mean_distance:.3f} m"
        mean = mean if timed is None else f"mean time {timed.mean_time:.3f} s"
        fine = refine_cost_for_figures(environment, cost)
        title, theme = "Coverage cost", options.theme
        save_distance_figure(options.plot, fine, robots, mean, title=title, theme=theme, speeds=speeds)
    answer: dict[str, Any] = {"mean_distance_m": result.mean_distance}
    lines = [f"mean distance   {result.mean_distance:.4f} m"]
    if timed is not None:
        answer |= {"mean_time_s": timed.mean_time, "cost_m2_s": timed.value}
        lines += [f"mean time       {timed.mean_time:.4f} s"]
    answer |= {"cost_m3": result.value, "uncovered_area_m2": result.uncovered_area, "robots": len(robots)}
    answer |= {"sites": len(cost.points), "density": density_kind(environment)}
    lines += [f"coverage cost   {result.value:.3f} m³", f"uncovered area  {result.uncovered_area:.3f} m²"]
    lines += [*density_lines(environment), f"on {len(cost.points)} sites, {len(robots)} robots"]
    print_answer(options, answer, *lines)


def speeds_of(given: tuple[float, ...], robots: int) -> Array | None:
    """Return the speeds of so many robots, (n,) m/s, from one for all or one for each; None for none."""
    if not given:
        return None
    if len(given) not in (1, robots):
        wanted = f"expected one, or one for each of {robots} robots"
        raise ParameterError(f"--speeds: {wanted}, got {len(given)} numbers")
    for speed in given:
        if not 0.0 < speed < np.inf:
            raise ParameterError(f"--speeds: expected a number above 0, got {speed!r} m/s")
    return np.array(given if len(given) == robots else given * robots)


def read_positions(path: Path) -> Array:
    """Return the positions in a JSON file, (n, 2) m, or raise InputError: file, place and value."""
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {describe_error(error)}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}") from error
    if not isinstance(content, list) or not content:
        raise InputError(f"{path}: expected a list of [x, y] in metres, got {quote(content)}")
    for k, pair in enumerate(content):
        fits = isinstance(pair, list) and len(pair) == 2
        if not fits or not all(is_number(value) and abs(value) < 1e300 for value in pair):
            wanted = "expected [x, y], two finite numbers in metres"
            raise InputError(f"{path}: [{k}]: {wanted}, got {quote(pair)}")
    return np.array(content, dtype=float)
