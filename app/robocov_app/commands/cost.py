"""`robocov cost`."""

from __future__ import annotations

import json as jsonlib
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from robocov.arrays import Array
from robocov.atomic import written
from robocov.cost import CoverageCost
from robocov.errors import InputError, ParameterError, shown
from robocov.mapfile import load_map


def command(
    map: tyro.conf.Positional[str],  # noqa: A002 - the name of the argument as users see it
    positions: Path,
    lattice: int = 64,
    sites: Annotated[Path | None, tyro.conf.arg(metavar="FILE.npz")] = None,
    json: bool = False,
) -> None:
    """Evaluate the exact coverage cost (22) of given positions.

    Example: robocov cost rooms --positions robots.json --lattice 128

    Args:
        map: Path to a map JSON, or the name of a bundled map.
        positions: JSON file with a list of [x, y] in metres, one for each robot.
        lattice: Evaluate on N x N sites over the map.
        sites: Save per-site points (m,2), distances (m,) and owner (m,) there.
        json: Print one JSON object.
    """
    if not 2 <= lattice <= 2048:
        raise ParameterError(f"--lattice: {lattice}, but a whole number from 2 to 2048 was wanted")
    environment = load_map(map)
    robots = read_positions(positions)
    cost = CoverageCost(environment, lattice=lattice)
    result = cost(robots)
    if sites is not None:
        target = sites if sites.suffix == ".npz" else sites.with_name(sites.name + ".npz")
        with written(target) as part, part.open("wb") as file:
            np.savez(file, points=cost.points, distances=result.distances, owner=result.owner)
    answer = {
        "mean_distance_m": result.mean_distance,
        "cost_m3": result.value,
        "uncovered_area_m2": result.uncovered_area,
        "robots": len(robots),
        "sites": len(cost.points),
    }
    if json:
        print(jsonlib.dumps(answer))
        return
    print(f"mean distance   {result.mean_distance:.4f} m")
    print(f"coverage cost   {result.value:.3f} m³")
    print(f"uncovered area  {result.uncovered_area:.3f} m²")
    print(f"on {len(cost.points)} sites, {len(robots)} robots")


def read_positions(path: Path) -> Array:
    """Return the positions in a JSON file, (n, 2) m.

    Raises
    ------
    InputError
        When it is not a list of [x, y]; the message names file, place and value.
    """
    try:
        content = jsonlib.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}") from error
    if not isinstance(content, list) or not content:
        raise InputError(f"{path}: {shown(content)}, but a list of [x, y] in metres was wanted")
    for k, pair in enumerate(content):
        if not (isinstance(pair, list) and len(pair) == 2 and all(map(_is_finite, pair))):
            raise InputError(
                f"{path}: [{k}]: {shown(pair)}, but [x, y], two finite numbers in metres, was wanted"
            )
    return np.array(content, dtype=float)


def _is_finite(value: object) -> bool:
    """Return whether a JSON value is a number that a float can hold."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
