"""A map with an obstacle, a start and a key of every kind, and changes of it."""

from __future__ import annotations

import copy
from typing import Any

import jsonschema

from robocov.mapfile import build_map_schema

DELETED = object()

DOCUMENT: dict[str, Any] = {
    "$schema": "https://example.org/map.json",
    "format": "robocov-map",
    "version": 1,
    "name": "Two rooms – süd",
    "description": "A wall with a door.\nAnd a second line.",
    "boundary": [[0, 0], [10, 0], [10, 6], [0, 6]],
    "obstacles": [
        {
            "kind": "polygon",
            "name": "desk",
            "vertices": [[2, 2], [4, 2], [4, 4], [2, 4]],
            "holes": [[[2.5, 2.5], [3, 2.5], [3, 3]]],
        },
        {"kind": "circle", "center": [7, 2], "radius": 0.5},
        {"kind": "wall", "points": [[5, 0], [5, 2.4]], "width": 0.1},
    ],
    "starts": {
        "west side": {"kind": "disc", "center": [1, 1], "radius": 0.8},
        "all": {"kind": "uniform"},
        "given": {"kind": "points", "positions": [[1, 1], [1.5, 1.25]]},
    },
    "density": {
        "kind": "gaussians",
        "floor": 0.25,
        "peaks": [
            {"center": [7, 4], "sigma": 1.5, "weight": 4},
            {"center": [2, 1], "covariance": [[2, 0.5], [0.5, 1]], "weight": 0.5},
        ],
    },
    "extra": {"author": {"name": "Ada"}, "tags": [1, 2.5, None, True, "é"]},
}

SCHEMA = jsonschema.Draft202012Validator(build_map_schema())


def edit(*path_and_value: Any, document: dict[str, Any] = DOCUMENT) -> dict[str, Any]:
    """Return a copy of the document in which the value at a path is replaced or deleted.

    The last argument is the new value, or DELETED, and the arguments before it are the path.
    """
    *path, value = path_and_value
    result = copy.deepcopy(document)
    parent: Any = result
    for key in path[:-1]:
        parent = parent[key]
    if value is DELETED:
        del parent[path[-1]]
    else:
        parent[path[-1]] = value
    return result
