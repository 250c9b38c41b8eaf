"""`robocov maps`."""

import json
from dataclasses import dataclass

from robocov.mapfile import bundled_maps, load_map
from robocov_app.render.density import density_kind
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.output import BOLD, print_table


@dataclass
class Arguments(JsonOption):
    """List the bundled maps: name, size, starts, and a sentence each.

    Example: robocov maps
    """


def command(options: Arguments) -> None:
    """Print the list."""
    rows, cells = [], []
    for name in bundled_maps():
        environment = load_map(name)
        low_x, low_y, high_x, high_y = environment.region.bounds
        starts, description = list(environment.starts), environment.description
        density = density_kind(environment)
        rows.append(
            {
                "name": name,
                "title": environment.name,
                "description": description,
                "width_m": high_x - low_x,
                "height_m": high_y - low_y,
                "free_area_m2": environment.free_area,
                "starts": starts,
                "density": density,
            }
        )
        size = f"{high_x - low_x:.3g} x {high_y - low_y:.3g}"
        told = f"{description} Density: {density}." if density else description
        cells.append((name, size, ", ".join(starts), told))
    if options.json:
        print(json.dumps({"maps": rows}, indent=1))
        return
    columns = [("map", BOLD), ("size in m", {"no_wrap": True}), ("starts, the default first", {})]
    print_table([*columns, ("what it is", {})], cells)
