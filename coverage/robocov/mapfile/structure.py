"""Validation of the structure of a map JSON: keys, types, ranges, and the weights of densities."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from robocov.density import MAX_RASTER_SIZE
from robocov.density.gaussians import CORRELATION_EXPECTED, is_nearly_singular
from robocov.errors import Issue, JsonPath, MapError, describe_unknown_name, find_similar_names, format_path
from robocov.files.documents import build_document_error, check_header, describe_mismatch
from robocov.mapfile.models import (
    COORDINATE_EXPECTED,
    FORMAT,
    KEYS,
    LABEL_EXPECTED,
    MAX_DESCRIPTION_CHARACTERS,
    MAX_SIZE_M,
    MIN_SIZE_M,
    MIN_WEIGHT,
    MODELS_BY_KIND,
    NESTED_MODELS,
    RING_EXPECTED,
    VERSION,
    WEIGHT_EXPECTED,
    DensityModel,
    MapModel,
    Model,
    RasterModel,
)

NO_WEIGHT = "expected at least one weight above 0, got none"
"""Message about a density that is 0 everywhere."""
_BASE_WEIGHTS = {"uniform": "weight", "gaussians": "floor", "polygons": "background"}
"""Keys of the weight that all points have, by the kind of the density."""
_EXPECTED = {name: key.expected for name, key in KEYS.items()} | {
    "boundary": RING_EXPECTED,
    "description": (f"a string of at most {MAX_DESCRIPTION_CHARACTERS} characters",),
    "extra": ("an object",),
    "$schema": ("a string",),
    "obstacles": ("a list of obstacles",),
    "starts": ("an object of named starts",),
    "extent": ("[x_min, y_min, x_max, y_max] in meters", COORDINATE_EXPECTED),
    "interpolation": ('"bilinear" or "cells"',),
    "rows": (
        f"a list of 1 to {MAX_RASTER_SIZE} rows",
        f"a list of 1 to {MAX_RASTER_SIZE} numbers",
        WEIGHT_EXPECTED,
    ),
    "image": ("the name of a file",),
    "black": (WEIGHT_EXPECTED,),
    "white": (WEIGHT_EXPECTED,),
}
"""Descriptions by key: of the value, of its items if it is a list, of the items of these, and so on."""


def validate_document(document: object, source_name: str) -> MapModel:
    """Validate the structure of a map JSON.

    Parameters
    ----------
    document : object
        Parsed content of a map file.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Returns
    -------
    MapModel
        Model of the document.

    Raises
    ------
    MapError
        If a key is missing or unknown, a value has the wrong type or is out of range, or the density has no
        weight or contradictory keys. The error lists the issues.
    """
    check_header(document, source_name, FORMAT, VERSION)
    try:
        model = MapModel.model_validate(document)
    except ValidationError as error:
        raise build_document_error(error, source_name, _build_issue) from None
    if model.density is None:
        return model
    if isinstance(model.density, RasterModel):
        issues = list(_find_raster_issues(model.density))
    else:
        issues = list(_find_weight_issues(model.density))
    if issues:
        raise MapError.from_issues(source_name, issues)
    return model


def _build_issue(detail: ErrorDetails) -> Issue:
    """Convert an error of pydantic to an issue."""
    path = list(detail["loc"])
    key = str(path[0])
    if key == "starts" and path[2:] == ["[key]"]:
        text = f"starts: name: {describe_mismatch(LABEL_EXPECTED, detail['input'])}"
        return Issue(tuple(path[:-1]), text, at_key=True)
    kinds = MODELS_BY_KIND.get(key, {})
    # Length of the path to an object with a kind: ("density",) or, for example, ("obstacles", 3).
    object_length = 1 if key == "density" else 2
    if not kinds or len(path) < object_length:
        return _build_member_issue(path, detail, MapModel)
    if len(path) == object_length:
        return _build_unknown_kind_issue(tuple(path), detail["input"], list(kinds))
    # In pydantic's path, the kind follows the object. It is not part of the path in the file.
    model = kinds[str(path[object_length])]
    path = path[:object_length] + path[object_length + 1 :]
    if len(path) > object_length + 1:
        # The issue may be in an object inside this one, such as a peak of a density.
        model = NESTED_MODELS.get(str(path[object_length]), model)
    return _build_member_issue(path, detail, model)


def _build_member_issue(path: list[int | str], detail: ErrorDetails, model: type[Model]) -> Issue:
    """Build the issue for a missing, unknown or wrong member of an object, at a path in the file."""
    if detail["type"] == "extra_forbidden":
        return _build_unknown_key_issue(path, model)
    # The last key is followed by indices of nested lists, such as 2 and 0 in vertices[2][0].
    last_key = max(k for k, step in enumerate(path) if isinstance(step, str))
    nesting_depth = len(path) - 1 - last_key
    expected = _EXPECTED[str(path[last_key])][nesting_depth]
    message = describe_mismatch(expected, detail["input"], is_missing=detail["type"] == "missing")
    return Issue.at_path(tuple(path), message)


def _build_unknown_key_issue(path: list[Any], model: type[Model]) -> Issue:
    """Build the issue for an unknown key of an object, with a suggestion."""
    *parent, key = path
    known = [field.alias or name for name, field in model.model_fields.items()]
    prefix = f"{format_path(parent)}: " if parent else ""
    return Issue(tuple(path), f"{prefix}{describe_unknown_name('key', str(key), known)}", at_key=True)


def _build_unknown_kind_issue(path: JsonPath, value: object, kinds: list[str]) -> Issue:
    """Build the issue for an obstacle, a start or a density whose kind is missing or unknown."""
    expected = f"one of {', '.join(kinds)}"
    if not isinstance(value, dict):
        return Issue.at_path(path, describe_mismatch(f"an object whose kind is {expected}", value))
    path = (*path, "kind")
    if "kind" not in value:
        return Issue.at_path(path, describe_mismatch(expected, None, is_missing=True))
    message = describe_mismatch(expected, value["kind"])
    name = str(value["kind"]).lower()
    similar_kinds = find_similar_names(name, kinds)
    if similar_kinds:
        message += f" (did you mean {' or '.join(map(repr, similar_kinds))}?)"
    return Issue.at_path(path, message)


def _find_weight_issues(model: DensityModel) -> Iterator[Issue]:
    """Yield the issues in the weights and peaks of a density other than a raster."""
    peaks = getattr(model, "peaks", [])
    areas = getattr(model, "areas", [])
    for k, peak in enumerate(peaks):
        path: JsonPath = ("density", "peaks", k)
        choice_message = _describe_choice(peak, "sigma", "covariance")
        if choice_message is not None:
            yield Issue.at_path(path, choice_message)
        elif peak.covariance is not None and not _is_covariance(peak.covariance):
            min_variance = f"({MIN_SIZE_M * 1000:g} mm)²"
            expected = (
                f"a symmetric, positive definite matrix of at least {min_variance} in all directions with "
                f"{CORRELATION_EXPECTED}"
            )
            yield Issue.at_path((*path, "covariance"), describe_mismatch(expected, peak.covariance))
    has_base_weight = getattr(model, _BASE_WEIGHTS[model.kind]) > 0.0
    if not has_base_weight and not any(feature.weight > 0.0 for feature in (*peaks, *areas)):
        weight_path: JsonPath = ("density", "weight") if model.kind == "uniform" else ("density",)
        yield Issue.at_path(weight_path, NO_WEIGHT)


def _is_covariance(matrix: list[list[float]]) -> bool:
    """Return whether a matrix is symmetric and positive definite, with large enough eigenvalues."""
    (a, b), (c, d) = matrix
    # The eigenvalues of [[a, b], [b, d]] are (a + d) / 2 plus or minus the length of ((a - d) / 2, b).
    smaller_eigenvalue = 0.5 * (a + d) - math.hypot(0.5 * (a - d), b)
    is_symmetric = b == c
    return is_symmetric and smaller_eigenvalue >= MIN_SIZE_M**2 and not is_nearly_singular(matrix)


def _describe_choice(model: Model, first: str, second: str) -> str | None:
    """Describe the issue of a model with both or neither of two keys; return None if it has exactly one."""
    has_first = getattr(model, first) is not None
    has_second = getattr(model, second) is not None
    if has_first != has_second:
        return None
    return f"expected one of {first} and {second}, got {'both' if has_first else 'neither'}"


def _find_raster_issues(model: RasterModel) -> Iterator[Issue]:
    """Yield the issues in the keys and rows of a raster density."""
    choice_message = _describe_choice(model, "rows", "image")
    if choice_message is not None:
        yield Issue.at_path(("density",), choice_message)
        return
    if model.extent is not None and not _is_extent(model.extent):
        expected = f"[x_min, y_min, x_max, y_max] with sides from {MIN_SIZE_M:g} to {MAX_SIZE_M:.0f} m"
        yield Issue.at_path(("density", "extent"), describe_mismatch(expected, model.extent))
    if model.rows is None:
        return
    for key in ("black", "white"):
        if getattr(model, key) is not None:
            yield Issue.at_path(("density", key), "expected only with an image, got it with rows")
    width = len(model.rows[0])
    for k, row in enumerate(model.rows):
        if len(row) != width:
            message = f"expected {width} numbers as in the first row, got {len(row)}"
            yield Issue.at_path(("density", "rows", k), message)
            return
    if not max(max(row) for row in model.rows) >= MIN_WEIGHT:
        yield Issue.at_path(("density", "rows"), NO_WEIGHT)


def _is_extent(extent: list[float]) -> bool:
    """Return whether an extent is a rectangle with sides of valid lengths."""
    x_min, y_min, x_max, y_max = extent
    width = x_max - x_min
    height = y_max - y_min
    return min(width, height) >= MIN_SIZE_M and max(width, height) <= MAX_SIZE_M
