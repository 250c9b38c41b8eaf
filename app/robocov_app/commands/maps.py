"""`robocov maps`."""

from __future__ import annotations

import json
from dataclasses import dataclass

from robocov.mapfile import bundled_maps, load_map
from robocov_app.render.density_summary import density_kind
from robocov_app.terminal.tables import console


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
    if options.json:
        rows = []
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
        print(json.dumps({"maps": rows}, indent=1))
        return
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("map", no_wrap=True, style="bold")
    table.add_column("size in m", no_wrap=True)
    table.add_column("starts, the default first")
    table.add_column("what it is")
    for name, environment in maps.items():
        low_x, low_y, high_x, high_y = environment.region.bounds
        size = f"{high_x - low_x:.3g} x {high_y - low_y:.3g}"
        what = environment.description
        if environment.density is not None:
            what += f" Density: {environment.density.kind}."
        table.add_row(name, size, ", ".join(environment.starts), what)
    console().print(table)
