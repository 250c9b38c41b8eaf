"""Map files: round trips, one-line errors at the right place, writing whole or not at all."""

from __future__ import annotations

import copy
import errno
import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from example_map import DOCUMENT, SCHEMA, edit
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.density import Gaussian, Gaussians
from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Environment,
    ObstaclePath,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError, OutputError
from robocov.mapfile import (
    dump_map,
    from_json,
    load_map,
    parse_map,
    save_map,
    to_json,
)

# What is read


def test_a_map_built_from_arrays_is_saved_and_equals_the_one_that_is_loaded(tmp_path: Path) -> None:
    corners = np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]])
    boundary: Any = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    obstacles: Any = [
        PolygonObstacle(5.0 * corners - 1.0, [corners + [5.5, 4.0]]),  # type: ignore[arg-type]
        CircleObstacle(np.array([8.0, 2.0]), 0.3, path=ObstaclePath(corners[:2], 0.5)),  # type: ignore[arg-type]
        WallObstacle(corners, 0.1),  # type: ignore[arg-type]
    ]
    starts: Any = {
        "disc": DiscStart(np.array([2.0, 8.0]), 0.5),  # type: ignore[arg-type]
        "points": PointsStart(np.array([[2.0, 7.0]])),  # type: ignore[arg-type]
    }
    covariance: Any = np.array([[2.0, 0.5], [0.5, 1.0]])
    peak = Gaussian(np.array([5.0, 5.0]), 4.0, covariance=covariance)  # type: ignore[arg-type]
    environment = Environment("arrays", boundary, obstacles, starts, density=Gaussians((peak,), 1.0))
    path = tmp_path / "arrays.json"
    save_map(environment, path)
    loaded = load_map(path)
    assert environment == loaded
    assert hash(environment) == hash(loaded)


def test_every_key_of_a_document_is_read() -> None:
    environment = from_json(DOCUMENT)
    assert environment.name == "Two rooms – süd"
    assert environment.description == DOCUMENT["description"]
    assert environment.boundary == ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
    assert environment.obstacles == (
        PolygonObstacle(
            ((2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)), (((2.5, 2.5), (3.0, 2.5), (3.0, 3.0)),), "desk"
        ),
        CircleObstacle((7.0, 2.0), 0.5),
        WallObstacle(((5.0, 0.0), (5.0, 2.4)), 0.1),
    )
    assert list(environment.starts.items()) == [
        ("west side", DiscStart((1.0, 1.0), 0.8)),
        ("all", UniformStart()),
        ("given", PointsStart(((1.0, 1.0), (1.5, 1.25)))),
    ]
    assert environment.extra == DOCUMENT["extra"]
    assert environment.schema == DOCUMENT["$schema"]
    assert all(type(value) is float for point in environment.boundary for value in point)


def test_only_the_header_name_and_boundary_are_required() -> None:
    small = {key: DOCUMENT[key] for key in ("format", "version", "name", "boundary")}
    environment = from_json(small)
    assert environment.obstacles == ()
    assert environment.starts == {}


def test_a_byte_order_mark_is_ignored() -> None:
    text = b"\xef\xbb\xbf" + json.dumps(DOCUMENT).encode()
    assert parse_map(text, "m.json") == from_json(DOCUMENT)


@pytest.mark.parametrize("order", [1, -1])
def test_the_boundary_may_have_either_orientation_and_be_closed(order: int) -> None:
    ring = DOCUMENT["boundary"][::order]
    closed_ring = [*ring, ring[0]]
    for boundary in (ring, closed_ring):
        environment = from_json(edit("boundary", boundary))
        assert environment.area == 60.0
        assert from_json(to_json(environment)) == environment


def test_obstacles_may_overlap_touch_and_cross_the_boundary() -> None:
    obstacles = [
        {"kind": "circle", "center": [0, 3], "radius": 1},
        {"kind": "circle", "center": [1, 3], "radius": 1},
        {"kind": "polygon", "vertices": [[5, 0], [6, 0], [6, 1], [5, 1]]},
        {"kind": "circle", "center": [50, 50], "radius": 1},
    ]
    assert from_json({**DOCUMENT, "obstacles": obstacles, "starts": {}}).free_area < 60.0


def test_the_document_is_not_shared_with_the_environment() -> None:
    document = copy.deepcopy(DOCUMENT)
    environment = from_json(document)
    document["extra"]["author"]["name"] = "Bob"
    assert environment.extra["author"]["name"] == "Ada"


# Round trips


def is_close(first: Any, second: Any) -> bool:
    """Return whether two documents are equal up to rounding errors of numbers."""
    if isinstance(first, dict) and isinstance(second, dict):
        return list(first) == list(second) and all(is_close(first[key], second[key]) for key in first)
    if isinstance(first, list) and isinstance(second, list):
        return len(first) == len(second) and all(map(is_close, first, second))
    if isinstance(first, float) or isinstance(second, float):
        return math.isclose(first, second, rel_tol=1e-14, abs_tol=1e-14)
    return bool(first == second)


coordinates = st.floats(-12.0, 12.0).map(lambda value: round(value, 9)) | st.integers(-12, 12)
labels = st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1, max_size=12)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def rings(draw: st.DrawFn, center: tuple[float, float], low: float, high: float) -> list[list[float]]:
    """Draw a star-shaped ring with one vertex in each sector, so that it does not cross itself."""
    count = draw(st.integers(4, 8))
    ring = []
    for k in range(count):
        angle = (k + draw(st.floats(0.05, 0.6))) * 2 * math.pi / count
        size = draw(st.floats(low, high))
        ring.append([center[0] + size * math.cos(angle), center[1] + size * math.sin(angle)])
    return ring


@st.composite
def obstacle_documents(draw: st.DrawFn) -> dict[str, Any]:
    kind = draw(st.sampled_from(["polygon", "circle", "wall"]))
    x = draw(coordinates)
    y = draw(coordinates)
    document: dict[str, Any] = {"kind": kind}
    if kind == "polygon":
        ring = draw(rings((x, y), 0.2, 2.0))
        document["vertices"] = ring
        if draw(st.booleans()):
            document["holes"] = [[[x + (a - x) / 2, y + (b - y) / 2] for a, b in ring]]
    elif kind == "circle":
        document |= {"center": [x, y], "radius": draw(st.floats(1e-3, 2.0))}
    else:
        end = [draw(coordinates), draw(coordinates)]
        document |= {"points": [[x, y], end], "width": draw(st.floats(1e-3, 0.5))}
    if draw(st.booleans()):
        document["name"] = draw(labels)
    return document


@st.composite
def environments(draw: st.DrawFn) -> Environment:
    starts: dict[str, Any] = {}
    for name in draw(st.lists(labels, max_size=4, unique=True)):
        starts[name] = draw(
            st.just({"kind": "uniform"})
            | st.fixed_dictionaries(
                {"kind": st.just("disc"), "center": st.tuples(coordinates, coordinates), "radius": st.just(2)}
            )
            | st.fixed_dictionaries(
                {
                    "kind": st.just("points"),
                    "positions": st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=1),
                }
            )
        )
    document = {
        "format": "robocov-map",
        "version": 1,
        "name": draw(labels),
        "description": draw(st.text(st.characters(exclude_categories=("Cs",)))),
        "boundary": draw(rings((draw(coordinates), draw(coordinates)), 6.0, 15.0)),
        "obstacles": draw(st.lists(obstacle_documents(), max_size=4)),
        "starts": starts,
        "extra": draw(st.dictionaries(st.text(), json_values, max_size=3)),
    }
    try:
        return from_json(document)
    except MapError as error:
        # Starts may be blocked and walls may have no length by chance.
        reason = str(error)
    by_chance = reason.startswith("map: starts") or "at least 1 mm" in reason
    assume(not by_chance)
    raise AssertionError(reason)


@settings(
    deadline=None, max_examples=count_examples(150), suppress_health_check=[HealthCheck.filter_too_much]
)
@given(environments())
def test_written_maps_are_read_unchanged(environment: Environment) -> None:
    text = dump_map(environment)
    loaded = parse_map(text.encode(), "loaded")
    assert is_close(to_json(loaded), to_json(environment))
    assert parse_map(dump_map(loaded), "reloaded") == loaded
    assert list(loaded.starts) == list(environment.starts)
    assert list(loaded.extra) == list(environment.extra)
    assert dump_map(loaded) == text
    assert from_json(to_json(environment)) == environment
    SCHEMA.validate(json.loads(text))


def test_a_document_is_written_back_unchanged() -> None:
    assert to_json(from_json(DOCUMENT)) == DOCUMENT


def test_written_maps_have_one_line_for_each_object() -> None:
    lines = dump_map(from_json(DOCUMENT)).splitlines()
    assert '  "boundary": [[0, 0], [10, 0], [10, 6], [0, 6]],' in lines
    assert '    {"kind": "circle", "center": [7, 2], "radius": 0.5},' in lines
    assert '    "all": {"kind": "uniform"},' in lines
    assert '  "name": "Two rooms – süd",' in lines


RING = [
    [round(2 * math.cos(k * math.tau / 60), 3), round(2 * math.sin(k * math.tau / 60), 3)] for k in range(60)
]
ROUND: dict[str, Any] = {
    "format": "robocov-map",
    "version": 1,
    "name": "round",
    "boundary": [[5 * x, 5 * y] for x, y in RING],
    "obstacles": [
        {"kind": "polygon", "vertices": RING, "holes": [[[x / 2, y / 2] for x, y in RING]]},
        {"kind": "wall", "points": [[x + 5, y] for x, y in RING], "width": 0.1},
        {"kind": "circle", "center": [-5, 0], "radius": 0.1},
    ],
    "starts": {"given": {"kind": "points", "positions": [[x - 5, y - 1] for x, y in RING]}},
}


@pytest.mark.parametrize(
    "path",
    [
        ("boundary", 41),
        ("obstacles", 0, "vertices", 41),
        ("obstacles", 0, "holes", 0, 41),
        ("obstacles", 1, "points", 59),
        ("obstacles", 2, "center"),
        ("starts", "given", "positions", 0),
    ],
)
@pytest.mark.parametrize("shift", [0.001, 1e-9, 0.0123456789])
def test_a_moved_vertex_changes_one_line(path: tuple[Any, ...], shift: float) -> None:
    value: Any = ROUND
    for key in path:
        value = value[key]
    moved = edit(*path, [value[0] + shift, value[1] - shift], document=ROUND)
    before = dump_map(from_json(ROUND)).splitlines()
    after = dump_map(from_json(moved)).splitlines()
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1


# Numbers


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1 + 0.2, "0.3"),
        (sum([0.1] * 10), "1"),
        (7.0, "7"),
        (-0.0, "0"),
        (3 * math.cos(math.pi / 2), "0"),
        (1e6 + 0.1 + 0.2, "1000000.3"),
        (0.1 * 3 - 1e-9, "0.299999999"),
        (1 / 3, "0.3333333333333333"),
        (0.333333333333, "0.333333333333"),
        (1e-7, "1e-07"),
        (math.pi, "3.141592653589793"),
        (8765432.12345679, "8765432.12345679"),
    ],
)
def test_numbers_are_as_short_as_possible(value: float, text: str) -> None:
    ring = [[value, value], [value + 9, value], [value, value + 9]]
    document = {**ROUND, "boundary": ring, "obstacles": [], "starts": {}}
    dumped = dump_map(from_json(document))
    assert f'"boundary": [[{text}, {text}], [' in dumped
    assert dump_map(parse_map(dumped, "again")) == dumped


@given(st.decimals(-100, 100, places=12, allow_nan=False) | st.decimals(-1, 1, places=13, allow_nan=False))
def test_numbers_written_by_hand_are_kept(number: Any) -> None:
    ring = f"[[{number}, 0], [1000, 0], [1000, 1000], [0, 1000]]"
    text = f'{{"format": "robocov-map", "version": 1, "name": "x", "boundary": {ring}}}'
    environment = parse_map(text, "handwritten")
    assert environment.boundary[0][0] == float(number)
    assert parse_map(dump_map(environment), "again").boundary == environment.boundary


@pytest.mark.parametrize("tiny", [1e-320, 5e-324, -1e-310, 1e-160])
def test_tiny_numbers_are_written_as_zero(tiny: float) -> None:
    def build_map(zero: float) -> Environment:
        return from_json(
            {
                **ROUND,
                "boundary": [[zero, 0], [0, 6], [5, 6], [zero, zero], [zero, 0]],
                "obstacles": [
                    {"kind": "polygon", "vertices": [[1, 4], [1.5, 5], [zero, 5]]},
                    {"kind": "circle", "center": [zero, 3], "radius": 0.5},
                ],
                "starts": {"all": {"kind": "disc", "center": [2, 4 + zero], "radius": 0.5}},
            }
        )

    assert build_map(tiny) == build_map(0.0)


def test_unknown_content_of_extra_is_kept() -> None:
    environment = from_json(edit("extra", {"mine": [0.1 + 0.2]}))
    assert parse_map(dump_map(environment), "again").extra == {"mine": [0.1 + 0.2]}


def test_documents_keep_every_bit_so_that_runs_can_be_repeated() -> None:
    environment = from_json(edit("obstacles", 1, "radius", 0.1 + 0.2))
    assert to_json(environment)["obstacles"][1]["radius"] == 0.1 + 0.2
    assert from_json(to_json(environment)) == environment


# Writing


def test_a_saved_map_loads_again(tmp_path: Path) -> None:
    environment = from_json(DOCUMENT)
    path = tmp_path / "m.json"
    save_map(environment, path)
    assert load_map(path) == environment
    assert [file.name for file in tmp_path.iterdir()] == ["m.json"]


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.json"
    path.write_text("old")

    def raise_disk_full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", raise_disk_full)
    with pytest.raises(OutputError, match=r"m\.json: cannot be written: No space left on device"):
        save_map(from_json(DOCUMENT), path)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["m.json"]


def test_a_missing_folder_is_reported(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written: No such file or directory"):
        save_map(from_json(DOCUMENT), tmp_path / "none" / "m.json")


def test_a_broken_link_is_rejected(tmp_path: Path) -> None:
    link = tmp_path / "m.json"
    link.symlink_to(tmp_path / "missing.json")
    with pytest.raises(OutputError, match="expected a file, got a broken link"):
        save_map(from_json(DOCUMENT), link)


def test_saving_to_a_link_writes_its_target(tmp_path: Path) -> None:
    target = tmp_path / "folder" / "target.json"
    target.parent.mkdir()
    target.touch()
    link = tmp_path / "m.json"
    link.symlink_to(target)
    save_map(from_json(DOCUMENT), link)
    assert link.is_symlink()
    assert load_map(target) == from_json(DOCUMENT)


def test_an_invalid_map_is_not_written(tmp_path: Path) -> None:
    bow_tie = Environment("bow tie", ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)))
    with pytest.raises(MapError, match="expected a ring that neither crosses nor touches itself"):
        save_map(bow_tie, tmp_path / "m.json")
    assert not list(tmp_path.iterdir())
