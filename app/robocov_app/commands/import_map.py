"""`robocov import`."""

from __future__ import annotations

import json as jsonlib
from pathlib import Path
from typing import Annotated, Literal

import tyro

from robocov.errors import InputError
from robocov.mapfile import save_map
from robocov_app.importers import detect, import_houseexpo


def command(
    file: tyro.conf.Positional[Path],
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")],
    tolerance: float = 0.02,
    default_start: Literal["room", "uniform"] = "room",
    overwrite: bool = False,
    json: bool = False,
) -> None:
    """Turn a foreign map file into a map JSON, and say what was dropped or repaired.

    Known formats: HouseExpo floor plans (JSON with "verts" in metres).

    Example: robocov import plan.json -o flat.json

    Args:
        file: The foreign map.
        out: The map JSON to write.
        tolerance: Walls may move by so many metres where that saves vertices; 0 keeps all.
        default_start: The map's default start: a disc at the roomiest place, or anywhere.
        overwrite: Replace an existing file.
        json: Print one JSON object.
    """
    if out.exists() and not overwrite:
        raise InputError(f"{out}: exists already; another -o, or --overwrite, was wanted")
    detect(file)
    environment, report = import_houseexpo(file, tolerance=tolerance, default_start=default_start)
    save_map(environment, out)
    if json:
        print(jsonlib.dumps({"out": str(out), **report.to_dict()}))
        return
    for line in report.lines():
        print(line)
    print(f"saved in {out}")
