"""The subcommands of `robocov`: parse, call, print; the work is done elsewhere."""

COMMANDS = {
    "demo": ("demo", "the interactive window: watch, touch, compare, go back in time"),
    "run": ("run", "one headless run, everything saved in a folder: record, cost, pictures, film"),
    "compare": ("compare", "several controllers from the same starts, side by side"),
    "sweep": ("sweep", "many runs in parallel, from a study file; resumable; one table of all"),
    "replay": ("replay", "a saved run or comparison again: in the window, or as frames and a film"),
    "report": ("report", "one HTML page of runs, comparisons and sweeps, with a replay; no network"),
    "metrics": ("metrics", "covered and visible area, energy, ways, connectivity, clearance of saved runs"),
    "paper": ("paper", "the paper's figures again, and its claims tested over many maps"),
    "edit": ("edit", "the map editor: draw, check, try; nothing is lost"),
    "check": ("maps.check", "validate maps; area, free area, components, narrowest gap"),
    "maps": ("maps.bundled", "list the bundled maps"),
    "generate": ("maps.generate", "random maps by a seed: scattered obstacles, towns, rooms, mazes, caves"),
    "controllers": ("controllers", "list the controllers and their gains"),
    "cost": ("cost", "the exact coverage cost (22) of given positions"),
    "optimum": ("optimum", "the best positions with the whole map known: a reference for the cost"),
    "benchmark": ("benchmark", "rate a controller on frozen maps and tracks; check and compare results"),
    "bench": ("bench", "speed, as ratios to yardsticks in the same run"),
    "import": ("maps.import_map", "turn a foreign map file into a map JSON"),
    "export": ("maps.export_map", "write a map in a foreign format: SVG, GeoJSON, WKT, ROS, MovingAI, PNG"),
    "lesson": ("lesson", "check a lesson for the window: its form, and that every chapter ends"),
    "schema": ("maps.schema", "print the JSON Schema of map files"),
    "completion": ("completion", "a script by which the shell completes commands, options and names"),
    "handbook": ("handbook", "tutorials, guides and the reference, in a browser; no network"),
}
"""The subcommands: module, and one line."""
