"""`robocov maps`."""

from dataclasses import dataclass
from typing import Any

from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.commands.options import JsonOption
from robocov_app.render.density_text import get_density_kind
from robocov_app.terminal.output import BOLD, print_answer, print_table


@dataclass
class Arguments(JsonOption):
    """List the bundled maps with their sizes, starts and descriptions.

    Example: robocov maps
    """


def command(options: Arguments) -> None:
    """Run `robocov maps`."""
    rows = [_build_row(name) for name in list_bundled_maps()]
    if options.json:
        print_answer(options, {"maps": rows}, indent=1)
        return
    columns = [
        ("map", BOLD),
        ("size in m", {"no_wrap": True}),
        ("starts, the default first", {}),
        ("description", {}),
    ]
    print_table(columns, [_format_cells(row) for row in rows])


def _build_row(name: str) -> dict[str, Any]:
    """Build the JSON entry of a map."""
    environment = load_map(name)
    low_x, low_y, high_x, high_y = environment.region.bounds
    return {
        "name": name,
        "title": environment.name,
        "description": environment.description,
        "width_m": high_x - low_x,
        "height_m": high_y - low_y,
        "free_area_m2": environment.free_area,
        "starts": list(environment.starts),
        "density": get_density_kind(environment),
    }


def _format_cells(row: dict[str, Any]) -> tuple[str, ...]:
    """Return the table cells for a map."""
    description = row["description"]
    if row["density"]:
        description = f"{description} Density: {row['density']}."
    size = f"{row['width_m']:.3g} x {row['height_m']:.3g}"
    return row["name"], size, ", ".join(row["starts"]), description
