"""`robocov maps`."""

from dataclasses import dataclass
from typing import Any

from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.commands.options import JsonOption
from robocov_app.render.density import density_kind
from robocov_app.terminal.output import BOLD, print_answer, print_table


@dataclass
class Arguments(JsonOption):
    """List the bundled maps: name, size, starts, and a sentence each.

    Example: robocov maps
    """


def command(options: Arguments) -> None:
    rows, cells = [], []
    for name in list_bundled_maps():
        environment = load_map(name)
        low_x, low_y, high_x, high_y = environment.region.bounds
        width, height, starts = high_x - low_x, high_y - low_y, list(environment.starts)
        description, density = environment.description, density_kind(environment)
        row: dict[str, Any] = {"name": name, "title": environment.name, "description": description}
        row |= {"width_m": width, "height_m": height, "free_area_m2": environment.free_area}
        rows.append(row | {"starts": starts, "density": density})
        told = f"{description} Density: {density}." if density else description
        cells.append((name, f"{width:.3g} x {height:.3g}", ", ".join(starts), told))
    print_answer(options, {"maps": rows}, indent=1)
    if not options.json:
        columns = [("map", BOLD), ("size in m", {"no_wrap": True}), ("starts, the default first", {})]
        print_table([*columns, ("what it is", {})], cells)
