"""The subcommands of `robocov`. They parse options, call other packages, and print the answers."""

from typing import NamedTuple


class Subcommand(NamedTuple):
    """A subcommand, which is a module with the options `Arguments` and a function `command`.

    Attributes
    ----------
    module : str
        Name of the module in this package.
    summary : str
        One line for the list of commands.
    uses_kernels : bool
        Whether the command calls compiled kernels; see `robocov.compiled`.
    """

    module: str
    summary: str
    uses_kernels: bool = False


COMMANDS = {
    "demo": Subcommand(
        "demo", "open the interactive window: watch, edit, compare, rewind", uses_kernels=True
    ),
    "run": Subcommand(
        "run", "simulate one run; save numbers, figures and a video in a folder", uses_kernels=True
    ),
    "compare": Subcommand(
        "compare", "run several controllers from the same starting positions", uses_kernels=True
    ),
    "sweep": Subcommand(
        "sweep", "run a parameter study in parallel; one table of all runs", uses_kernels=True
    ),
    "replay": Subcommand(
        "replay", "replay a saved run or comparison, in the window or as a video", uses_kernels=True
    ),
    "report": Subcommand(
        "report", "build one HTML page of runs, comparisons and sweeps, with replay", uses_kernels=True
    ),
    "metrics": Subcommand("metrics", "measure saved runs: visible area, energy, path length, clearance"),
    "paper": Subcommand(
        "paper", "draw counterparts of the paper's figures, and test its claims", uses_kernels=True
    ),
    "edit": Subcommand("edit", "draw, check and try maps in the editor"),
    "check": Subcommand("maps.check", "validate maps: free area, components, unreachable area, passages"),
    "maps": Subcommand("maps.bundled", "list the bundled maps"),
    "generate": Subcommand("maps.generate", "generate random maps: obstacles, towns, rooms, mazes, caves"),
    "controllers": Subcommand("controllers", "list the controllers and their gains"),
    "cost": Subcommand("cost", "compute the exact coverage cost (22) of given positions", uses_kernels=True),
    "optimum": Subcommand(
        "optimum", "search for the best positions on a known map, as a reference", uses_kernels=True
    ),
    "benchmark": Subcommand(
        "benchmark", "rate a controller on frozen maps and tracks; verify and compare", uses_kernels=True
    ),
    "bench": Subcommand("bench", "measure speed, as ratios to baselines in the same run"),
    "import": Subcommand("maps.import_map", "import a map from another program"),
    "export": Subcommand("maps.export_map", "export a map as SVG, GeoJSON, WKT, ROS, MovingAI or PNG"),
    "lesson": Subcommand("lesson", "check a lesson file, and that every chapter can be completed"),
    "schema": Subcommand("maps.schema", "print the JSON Schema of map files"),
    "completion": Subcommand("completion", "print a script for completion in the shell"),
    "handbook": Subcommand("handbook", "open tutorials, guides and the reference in a browser"),
}
"""The subcommands by name, in the order of the help."""
