"""Map files: the map JSON, version 1, to and from `Environment`, and the bundled maps.

- `reading`, `writing`: files, texts and JSON documents of maps
- `density_images`: image files of densities
- `models`: the keys of a map file, and its JSON Schema
- `structure`, `rules`: validation of documents, and of the geometry of maps
- `check`: a report on a valid map
"""

from robocov.mapfile.density_images import MAX_IMAGE_BYTES
from robocov.mapfile.models import build_map_schema
from robocov.mapfile.reading import (
    find_map_file,
    from_json,
    list_bundled_maps,
    load_map,
    parse_density,
    parse_map,
)
from robocov.mapfile.writing import dump_document, dump_map, save_map, to_json

__all__ = [
    "MAX_IMAGE_BYTES",
    "build_map_schema",
    "dump_document",
    "dump_map",
    "find_map_file",
    "from_json",
    "list_bundled_maps",
    "load_map",
    "parse_density",
    "parse_map",
    "save_map",
    "to_json",
]
