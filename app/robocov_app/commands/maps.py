"""`robocov maps`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from robocov.mapfile import bundled_maps, load_map
from robocov_app.render.density import density_kind
from robocov_app.terminal.tables import BOLD, print_table


@dataclass
class Arguments:
    """List the bundled maps: name, size, starts, and a sentence each.

    Example: robocov maps
    """

    json: bool = False
    """Print one JSON object and nothing else."""


def command(options: Arguments) -> None:
    """Print the list."""
    maps = {name: load_map(name) for name in bundled_maps()}
    rows: list[dict[str, Any]] = []
    for name, environment in maps.items():
        low_x, low_y, high_x, high_y = environment.region.bounds
        rows.append(
            {
                "name": name,
                "title": environment.name,
                "description": environment.description,
                "width_m": high_x - low_x,
                "height_m": high_y - low_y,
                "free_area_m2": environment.free_area,
                "starts": list(environment.starts),
                "density": density_kind(environment),
            }
        )
    if options.json:
        print(json.dumps({"maps": rows}, indent=1))
        return
    columns = [("map", BOLD), ("size in m", {"no_wrap": True}), ("starts, the default first", {})]
    print_table(
        [*columns, ("what it is", {})],
        (
            (
                row["name"],
                f"{row['width_m']:.3g} x {row['height_m']:.3g}",
                ", ".join(row["starts"]),
                row["description"] + (f" Density: {row['density']}." if row["density"] else ""),
            )
            for row in rows
        ),
    )
