"""`robocov import`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from robocov.errors import InputError
from robocov.mapfile import save_map
from robocov_app.importers import detect, import_houseexpo


@dataclass
class Arguments:
    """Turn a foreign map file into a map JSON, and say what was dropped or repaired.

    Known formats: HouseExpo floor plans (JSON with "verts" in metres).

    Example: robocov import plan.json -o flat.json
    """

    file: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE")]
    """The foreign map."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")]
    """The map JSON to write."""
    tolerance: float = 0.02
    """Walls may move by so many metres where that saves vertices; 0 keeps all."""
    default_start: Literal["room", "uniform"] = "room"
    """The map's default start: a disc at the roomiest place, or anywhere."""
    overwrite: bool = False
    """Replace an existing file."""
    json: bool = False
    """Print one JSON object and nothing else."""


def command(options: Arguments) -> None:
    """Import, save and report."""
    out = options.out
    if out.exists() and not options.overwrite:
        raise InputError(f"{out}: exists already; another -o, or --overwrite, was wanted")
    detect(options.file)
    environment, report = import_houseexpo(
        options.file, tolerance=options.tolerance, default_start=options.default_start
    )
    save_map(environment, out)
    if options.json:
        print(json.dumps({"out": str(out), **report.to_dict()}))
        return
    for line in report.lines():
        print(line)
    print(f"saved in {out}")
