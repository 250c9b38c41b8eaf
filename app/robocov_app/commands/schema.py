"""`robocov schema`."""

from __future__ import annotations

import json
from dataclasses import dataclass

from robocov.mapfile import map_schema


@dataclass
class Arguments:
    """Print the JSON Schema of map files, for completion and checks in editors.

    Example: robocov schema > robocov-map.schema.json
    """

    json: bool = False
    """Accepted for the sake of uniformity: the answer is JSON anyway."""


def command(options: Arguments) -> None:
    """Print the schema."""
    print(json.dumps(map_schema(), indent=1))
