"""`robocov schema`."""

from __future__ import annotations

import json

from robocov.mapfile import map_schema


def command() -> None:
    """Print the JSON Schema of map files, for completion and checks in editors.

    Example: robocov schema > robocov-map.schema.json
    """
    print(json.dumps(map_schema(), indent=1, ensure_ascii=False))
