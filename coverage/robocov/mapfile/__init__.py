"""Map files: the map JSON, its structure and its rules, to and from `Environment`; the bundled maps."""

from __future__ import annotations

from robocov.mapfile.conversion import (
    bundled_maps,
    density_of,
    dump_document,
    dump_map,
    from_json,
    load_map,
    map_file,
    map_schema,
    parse_map,
    save_map,
    to_json,
)

__all__ = [
    "bundled_maps",
    "density_of",
    "dump_document",
    "dump_map",
    "from_json",
    "load_map",
    "map_file",
    "map_schema",
    "parse_map",
    "save_map",
    "to_json",
]
