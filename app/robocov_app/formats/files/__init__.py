"""Reading foreign files safely: limits, text, JSON, YAML, XML and the other files that a file names."""

from robocov_app.formats.files.json_file import JsonFile, get_member, is_number
from robocov_app.formats.files.limits import (
    MAX_CELLS,
    MAX_DEPTH,
    MAX_FILE_BYTES,
    MAX_SHAPES,
    MAX_TEXT_BYTES,
    MAX_VERTICES,
    require_cells,
    require_coordinate,
    require_length,
    require_shapes,
    require_vertices,
)
from robocov_app.formats.files.named_files import IncludeBudget, find_named_file
from robocov_app.formats.files.numbers import parse_integers, parse_number
from robocov_app.formats.files.plain_yaml import MAX_YAML_BYTES, Value, parse_yaml
from robocov_app.formats.files.reading import (
    HEAD_BYTES,
    get_map_name,
    read_content,
    read_head,
    read_text,
    starts_with,
)

__all__ = [
    "HEAD_BYTES",
    "MAX_CELLS",
    "MAX_DEPTH",
    "MAX_FILE_BYTES",
    "MAX_SHAPES",
    "MAX_TEXT_BYTES",
    "MAX_VERTICES",
    "MAX_YAML_BYTES",
    "IncludeBudget",
    "JsonFile",
    "Value",
    "find_named_file",
    "get_map_name",
    "get_member",
    "is_number",
    "parse_integers",
    "parse_number",
    "parse_yaml",
    "read_content",
    "read_head",
    "read_text",
    "require_cells",
    "require_coordinate",
    "require_length",
    "require_shapes",
    "require_vertices",
    "starts_with",
]
