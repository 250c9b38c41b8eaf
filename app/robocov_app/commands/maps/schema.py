"""`robocov schema`."""

import json
from dataclasses import dataclass
from typing import Literal

import tyro

from robocov_app.commands.options import JsonOption
from robocov_app.terminal.output import echo


@dataclass
class Arguments(JsonOption):
    """Print the JSON Schema of map files or session files, for completion and validation in text editors.

    Example: robocov schema > robocov-map.schema.json
    """

    of: tyro.conf.Positional[Literal["map", "session"]] = "map"
    """Kind of files."""


def command(options: Arguments) -> None:
    """Run `robocov schema`."""
    if options.of == "map":
        from robocov.mapfile import build_map_schema as build_schema
    else:
        from robocov_app.viewer.session.files.models import build_session_schema as build_schema
    echo(json.dumps(build_schema(), indent=1))
