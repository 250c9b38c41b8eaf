"""Errors of map files: one line with the path, the expected value and the actual one."""

from __future__ import annotations

import copy
import json
import math
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from example_map import DELETED, DOCUMENT, SCHEMA, edit
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import MapError
from robocov.mapfile import build_map_schema, from_json, list_bundled_maps, load_map, parse_map, to_json
from robocov.mapfile.structure import validate_document

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


# Errors: one line with the path, the expected value and the actual one

STRUCTURAL = [
    (edit("boundary", 0, 0, True), "boundary[0][0]: expected a number"),
    (edit("boundary", 0, 1, "1"), "boundary[0][1]: expected a number"),
    (edit("boundary", 1, [1, 2, 3]), "boundary[1]: expected a point [x, y]"),
    (edit("boundary", [[0, 0], [1, 1]]), "boundary: expected a list of at least 3 points"),
    (edit("boundary", DELETED), "boundary: missing, expected a list of at least 3"),
    (edit("boundary", 0, 0, 1e8), "boundary[0][0]: expected a number from"),
    (edit("name", DELETED), "name: missing"),
    (edit("name", ""), "name: expected a string"),
    (edit("name", "two\nlines"), "name: expected a string"),
    (edit("description", 3), "description: expected a string"),
    (edit("obstacles", None), "obstacles: expected a list of obstacles"),
    (edit("obstacles", 0, 3), "obstacles[0]: expected an object whose kind is one of polygon"),
    (edit("obstacles", 0, "kind", "polygn"), "(did you mean 'polygon'?)"),
    (edit("obstacles", 0, "kind", DELETED), "obstacles[0].kind: missing, expected one of"),
    (
        edit("obstacles", 0, "vertices", 0, 0, None),
        "obstacles[0].vertices[0][0]: expected a number",
    ),
    (edit("obstacles", 0, "holes", 0, 2, []), "obstacles[0].holes[0][2]: expected a point"),
    (edit("obstacles", 0, "holes", 0, []), "obstacles[0].holes[0]: expected a list of at least 3"),
    (
        edit("obstacles", 0, "verts", []),
        "obstacles[0]: unknown key 'verts': did you mean 'vertices'?",
    ),
    (edit("obstacles", 0, "[key]", []), "obstacles[0]: unknown key '[key]'"),
    (
        edit("obstacles", 1, "radius", -1),
        "obstacles[1].radius: expected a number from 0.001 to 10000 (m)",
    ),
    (
        edit("obstacles", 1, "radius", 0.0009),
        "obstacles[1].radius: expected a number from 0.001 to 10000 (m), got 0.0009",
    ),
    (
        edit("obstacles", 1, "radius", 10001),
        "obstacles[1].radius: expected a number from 0.001 to 10000 (m), got 10001",
    ),
    (edit("obstacles", 1, "center", DELETED), "obstacles[1].center: missing, expected a point"),
    (
        edit("obstacles", 2, "points", [[1, 1]]),
        "obstacles[2].points: expected a list of at least 2",
    ),
    (edit("obstacles", 2, "width", 0), "obstacles[2].width: expected a number from 0.001"),
    (edit("starts", []), "starts: expected an object of named starts"),
    (edit("starts", "all", None), "starts.all: expected an object whose kind is one of disc"),
    (edit("starts", "all", "kind", "unifrm"), "starts.all.kind: expected one of disc, uni"),
    (edit("starts", "west side", "radius", "1"), 'starts["west side"].radius: expected a number'),
    (
        edit("starts", "given", "positions", []),
        "starts.given.positions: expected a list of at least 1",
    ),
    (
        edit("starts", "", {"kind": "uniform"}),
        'starts: name: expected a string of 1 to 100 characters on one line, got ""',
    ),
    (edit("extra", 3), "extra: expected an object"),
    (edit("$schema", 3), "$schema: expected a string"),
    (edit("boundry", 1), "unknown key 'boundry': did you mean 'boundary'?"),
    (edit("format", "geojson"), 'format: expected "robocov-map", got "geojson"'),
    (edit("format", DELETED), "format: missing"),
    (edit("version", 2), "version: expected 1, got 2; it was written by a newer robocov"),
    (edit("version", 0), "version: expected 1, got 0"),
    (edit("version", True), "version: expected 1, got true"),
    (edit("version", DELETED), "version: missing"),
]

GEOMETRIC = [
    (
        edit("boundary", [[0, 0], [10, 10], [10, 0], [0, 10]]),
        "boundary[0]: the edge from here meets the edge from boundary[2] near [5, 5]",
    ),
    (
        edit("obstacles", 0, {"kind": "polygon", "vertices": [[0, 0], [4, 4], [4, 0], [0, 4]]}),
        "obstacles[0].vertices[0]: the edge from here meets the edge from obstacles[0].vertices[2]",
    ),
    (
        edit("boundary", [[0, 4], [2, 0], [4, 4], [4, 0], [0, 0]]),  # a vertex on a later edge
        "boundary[0]: the edge from here meets the edge from boundary[3] near [2, 0]",
    ),
    (
        edit("boundary", [[2, 0], [2, 0], [4, 4], [4, 0], [0, 0], [0, 4]]),  # which is given twice
        "boundary[1]: the edge from here meets the edge from boundary[3] near [2, 0]",
    ),
    (
        edit("boundary", [[5, 0], [10, 6], [0, 6], [5, 0], [0, -6], [10, -6]]),  # an hourglass
        "boundary[0]: the edge from here meets the edge from boundary[2] near [5, 0]",
    ),
    (
        edit("boundary", [[1e6, 0], [1e6 + 6, 3], [1e6 + 3, 1.5]]),
        "boundary: expected points that are not on one line",
    ),
    (
        edit("boundary", [[0, 0], [10, 10], [5, 5]]),
        "boundary: expected points that are not on one line, got an area of 0 m²",
    ),
    (
        edit("boundary", [[0, 0], [10, 10], [0, 0]]),
        "boundary: expected at least 3 different points, got 2",
    ),
    (
        edit("boundary", [[0, 0], [10001, 0], [0, 10]]),
        "boundary: expected at most 10 km, got 10001 x 10 m",
    ),
    (
        edit("boundary", [[0, 0], [9, 0], [0, 0.0009]]),
        "boundary: expected at least 1 mm in both directions, got 9 x 0.0009 m",
    ),
    (
        edit("obstacles", 0, "holes", 0, [[5, 5], [6, 5], [6, 6]]),
        "obstacles[0].holes[0]: sticks out of obstacles[0].vertices",
    ),
    (
        edit("obstacles", 0, "holes", [[[2.5, 2.5], [3, 2.5], [3, 3]], [[2.6, 2.4], [3, 2.5], [3, 3]]]),
        "obstacles[0].holes[1]: meets the outline or another hole",
    ),
    (
        edit("obstacles", 0, "holes", [[[2.2, 2.2], [3.8, 2.2], [3, 4]], [[3, 2.5], [3.1, 2.5], [3, 3]]]),
        "obstacles[0].holes[1]: meets the outline or another hole",
    ),
    (
        edit("obstacles", 2, "points", [[1, 1], [1, 1]]),
        "obstacles[2].points: expected a wall of at least 1 mm, got 0 m",
    ),
    (
        edit("obstacles", 2, "points", [[1, 1], [20000, 1]]),
        "obstacles[2].points: expected at most 10 km, got 19999 x 0 m",
    ),
    (
        edit("obstacles", 0, {"kind": "circle", "center": [5, 3], "radius": 100}),
        "obstacles: no free space is left",
    ),
    (
        edit("starts", "west side", "center", [30, 2]),
        'starts["west side"]: a robot of radius 0.1 m does not fit into the disc of radius 0.8',
    ),
    (
        edit("starts", "west side", {"kind": "disc", "center": [3.5, 3.5], "radius": 0.2}),
        'starts["west side"]: a robot of radius 0.1 m does not fit into the disc of radius 0.2 m',
    ),
    (
        edit("starts", "given", "positions", 1, [7, 2]),
        "starts.given.positions[1]: [7, 2] is inside an obstacle or outside",
    ),
    (
        edit("starts", "given", "positions", 1, [385123.25, 2]),
        "starts.given.positions[1]: [385123.25, 2] is inside",
    ),
    (
        edit("starts", "given", "positions", 1, [1, 1]),
        "starts.given.positions: duplicate position",
    ),
    (edit("boundary", [[0, 0], [0.15, 0], [0, 0.15]]) | {"obstacles": []}, "(and 3 more issues)"),
]


@pytest.mark.parametrize(("document", "expected"), STRUCTURAL + GEOMETRIC, ids=lambda value: str(value)[-40:])
def test_errors_name_the_path_the_expected_value_and_the_actual_one(
    document: dict[str, Any], expected: str
) -> None:
    with pytest.raises(MapError) as caught:
        parse_map(json.dumps(document), "folder/m.json")
    message = str(caught.value)
    assert message.startswith(f"folder/m.json:1:{caught.value.column}: ")
    assert expected in message
    assert "\n" not in message
    with pytest.raises(MapError) as caught_for_document:
        from_json(document, "folder/m.json")
    # A document that was not parsed from a text has no lines.
    assert str(caught_for_document.value) == message.replace(f":1:{caught.value.column}: ", ": ", 1)
    assert caught_for_document.value.line is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"", "expected JSON, got an empty file"),
        (b" \n", "expected JSON, got an empty file"),
        (b"\xff\xfe{", "m.json:1:1: byte 0xff at offset 0: not UTF-8"),
        (b'\xef\xbb\xbf{\n"\xc3\xa9\xff', "m.json:2:3: byte 0xff at offset 8: not UTF-8"),
        (b'{"format":\n "robocov-map"\n  oops}', "m.json:3:3: 'oops}': not JSON"),
        (b'{"a": ', "m.json:1:7: end of file: not JSON"),
        (b'{"a":\n1 /* one */}', "m.json:2:3: '/* one */}': not JSON: JSON has no comments"),
        (b"{'a': 1}", "m.json:1:2: \"'a': 1}\": not JSON: strings need double quotes"),
        (b"[1,\n2 ,\n]", "m.json:2:3: ',': not JSON: a comma without a value after it"),
        (b'{"a": 1, }', "m.json:1:8: ', }': not JSON: a comma without a value after it"),
        (b"nul", "m.json:1:1: 'nul': not JSON"),
        (b'{"a": {"b": 1, "c": 2,\n "b": 3}}', "m.json:2:2: a.b: duplicate key"),
        (b"[[NaN]]", "m.json:1:3: [0][0]: expected a finite number"),
        (b"[-Infinity]", "m.json:1:2: [0]: expected a finite number"),
        (b"[1e999]", "m.json:1:2: [0]: expected a finite number"),
        (b"[" + b"9" * 5000 + b"]", "[0]: expected a finite number"),
        (b"[" * 100_000, "m.json:1:33: nested too deeply"),
        (b"[" * 40 + b"]" * 40, "m.json:1:33: [0][0][0][0]...: nested too deeply"),
        (b'[\n"\\ud800"]', "m.json:2:1: [0]: expected text that UTF-8 can encode, got '\\ud800'"),
        (b'{"a": {"\\ud800": 1}}', "m.json:1:8: a: key: expected text that UTF-8 can encode, got '\\ud800'"),
        (b"[]", "m.json:1:1: expected a JSON object with a map, got []"),
    ],
)
def test_invalid_json_is_reported_with_its_position(text: bytes, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        parse_map(text, "m.json")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, 10**400, {1, 2}, np.float32(1), {3: 4}, "\ud800"])
def test_values_that_are_not_json_are_rejected_in_documents(value: object) -> None:
    with pytest.raises(MapError, match=r"m: extra\.a: "):
        from_json(edit("extra", {"a": value}), "m")


def test_a_misspelled_key_is_reported_before_the_missing_one() -> None:
    document = edit("boundry", DOCUMENT["boundary"], document=edit("boundary", DELETED))
    with pytest.raises(
        MapError, match=r"^map: unknown key 'boundry': did you mean 'boundary'\?.*\(and 1 more issue\)$"
    ):
        from_json(document)


def test_several_errors_are_counted() -> None:
    document = edit("boundary", 0, 0, "a", document=edit("obstacles", 1, "radius", -1))
    with pytest.raises(MapError, match=r"boundary\[0\]\[0\].*\(and 1 more issue\)$"):
        from_json(document)


def test_every_issue_has_its_line() -> None:
    document = edit("boundary", 0, 0, "a", document=edit("obstacles", 1, "radius", -1))
    lines = json.dumps(document, indent=2).splitlines()
    with pytest.raises(MapError) as caught:
        parse_map("\r\n".join(lines), "m.json")
    first, second = caught.value.issues
    assert (first.path, second.path) == (("boundary", 0, 0), ("obstacles", 1, "radius"))
    for issue, value in ((first, '"a"'), (second, "-1")):
        assert issue.line is not None
        assert issue.column is not None
        assert lines[issue.line - 1][issue.column - 1 :].startswith(value)
    assert str(caught.value) == f"m.json:{first.line}:{first.column}: {first.text} (and 1 more issue)"
    assert (caught.value.line, caught.value.column) == (first.line, first.column)


@pytest.mark.parametrize("build_position", [lambda k: [1, 2, k], lambda k: [70 + k, 2]])
def test_the_first_of_many_issues_are_listed_and_all_are_counted(
    build_position: Callable[[int], list[int]],
) -> None:
    """The issues violate the structure of the file or the rules of positions."""
    starts = {"given": {"kind": "points", "positions": [build_position(k) for k in range(50)]}}
    with pytest.raises(MapError, match=r"\(and 49 more issues\)$") as caught:
        parse_map(json.dumps(edit("starts", starts)), "m.json")
    assert len(caught.value.issues) == MapError.MAX_LISTED
    assert caught.value.unlisted == 50 - MapError.MAX_LISTED


@pytest.mark.slow
def test_issues_in_large_files_have_lines() -> None:
    ring = [[math.cos(k / 1e4), math.sin(k / 1e4)] for k in range(60_000)]
    document = edit("boundary", [*ring, [2, "x"]], document=edit("extra", {"more": ring}))
    with pytest.raises(MapError) as caught:
        parse_map(json.dumps(document, indent=1), "m.json")
    lines = json.dumps(document, indent=1).splitlines()
    assert caught.value.line is not None
    assert '"x"' in lines[caught.value.line - 1]


def test_an_issue_has_no_line_if_it_cannot_be_located(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def raise_recursion_error(*_: object, **__: object) -> int:
        raise RecursionError

    monkeypatch.setattr("robocov.files.strictjson.find_offset", raise_recursion_error)
    with pytest.raises(MapError, match=r"^m\.json: a: expected a finite number") as caught:
        parse_map('{"a": NaN}', "m.json")
    assert caught.value.line is None


def test_errors_can_be_pickled() -> None:
    with pytest.raises(MapError) as caught:
        parse_map(json.dumps(edit("obstacles", 1, "radius", -1)), "m.json")
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)
    assert copy.issues == caught.value.issues


def test_files_that_cannot_be_read_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MapError, match="no such file"):
        load_map(tmp_path / "none.json")
    with pytest.raises(MapError, match="expected a file, got a folder"):
        load_map(tmp_path)
    with pytest.raises(MapError, match="cannot be read"):
        load_map("a\0b")
    monkeypatch.setattr("robocov.files.strictjson.MAX_BYTES", 1_000_000)
    large = tmp_path / "large.json"
    large.write_bytes(b" " * 1_000_001)
    with pytest.raises(MapError, match="expected at most 1 MB, got more"):
        load_map(large)


@pytest.mark.parametrize("content", [b"image: office.pgm\n", b"P5\n1 1\n255\n\xcd"])
def test_for_a_file_of_another_kind_the_message_names_the_import(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "office.yaml"
    path.write_bytes(content)
    with pytest.raises(MapError, match=r"office\.yaml: expected a robocov map, .* `robocov import`\."):
        load_map(path)


def test_bundled_maps_are_loaded_by_name() -> None:
    assert load_map("rooms") == load_map(list_bundled_maps()["rooms"])
    with pytest.raises(MapError, match=r"unknown map 'roms': did you mean 'rooms'\? \(known: .*rooms"):
        load_map("roms")


def test_a_file_without_suffix_is_loaded_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine").write_text(json.dumps(DOCUMENT))
    assert load_map("mine") == from_json(DOCUMENT)


# Any changed map file either loads or raises one MapError with a message of one line.

PLAIN_JUNK: list[Any] = [None, True, "", "x", -1, 0, 1e-9, 1e9, [], {}, [[]], [0, 0], [[0, 0]] * 4]
junk = st.sampled_from([*PLAIN_JUNK, 10**400, math.nan, math.inf]) | json_values


def list_paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values inside a document."""
    paths = [path] if path else []
    if isinstance(value, dict):
        for key, item in value.items():
            paths += list_paths(item, (*path, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            paths += list_paths(item, (*path, index))
    return paths


@st.composite
def mutants(draw: st.DrawFn, values: st.SearchStrategy[Any] = junk) -> dict[str, Any]:
    document = DOCUMENT
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(list_paths(document)))
        if draw(st.integers(0, 3)) == 0:
            document = edit(*path, DELETED, document=document)
        elif draw(st.integers(0, 3)) == 0:
            document = copy.deepcopy(document)
            parent: Any = document
            for key in path[:-1]:
                parent = parent[key]
            if isinstance(parent, dict):
                parent[draw(st.text(max_size=3))] = draw(values)
            else:
                parent.append(draw(values))
        else:
            document = edit(*path, draw(values), document=document)
        if not document:
            break
    return document


def assert_loads_or_raises(load: Any) -> None:
    """Assert that loading gives a map or a readable MapError of one line."""
    try:
        environment = load()
    except MapError as error:
        message = str(error)
        assert re.match(r"m\.json(:\d+:\d+)?: ", message)
        assert message.isprintable()
        assert any(
            phrase in message
            for phrase in (
                "expected",
                "no free space",
                "does not fit",
                "duplicate",
                "not JSON",
                "not UTF-8",
                "nested too",
                "known:",
            )
        ), message
    else:
        assert from_json(to_json(environment)) == environment


@settings(deadline=None, max_examples=count_examples(400))
@given(mutants())
def test_a_changed_document_loads_or_raises(document: dict[str, Any]) -> None:
    assert_loads_or_raises(lambda: from_json(document, "m.json"))


@settings(deadline=None, max_examples=count_examples(200))
@given(st.data())
def test_a_damaged_text_loads_or_raises(data: st.DataObject) -> None:
    text = bytearray(json.dumps(DOCUMENT).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        offset = data.draw(st.integers(0, len(text)))
        cut_length = data.draw(st.integers(0, 3))
        insertion = data.draw(st.binary(max_size=3) | st.sampled_from([b"-", b"9", b",", b"e5", b"[["]))
        text[offset : offset + cut_length] = insertion
    assert_loads_or_raises(lambda: parse_map(bytes(text), "m.json"))


@settings(deadline=None, max_examples=count_examples(200))
@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=8))
def test_any_ring_on_a_grid_loads_or_raises(ring: list[tuple[int, int]]) -> None:
    document = edit("boundary", [list(point) for point in ring]) | {"obstacles": [], "starts": {}}
    assert_loads_or_raises(lambda: from_json(document, "m.json"))
    polygon = {"kind": "polygon", "vertices": [list(point) for point in ring]}
    assert_loads_or_raises(lambda: from_json(edit("obstacles", [polygon]) | {"starts": {}}, "m.json"))


# The schema agrees with the loader


def test_the_schema_checks_the_names_of_starts() -> None:
    for name in ("", "a\nb", "x" * 101):
        assert not SCHEMA.is_valid(edit("starts", name, {"kind": "uniform"}))
    assert SCHEMA.is_valid(edit("starts", "the lobby", {"kind": "uniform"}))
    assert not SCHEMA.is_valid(edit("starts", "the lobby", {"kind": "lobby"}))


def test_the_schema_is_valid_and_describes_every_key() -> None:
    schema = build_map_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"].endswith("2020-12/schema")
    assert set(schema["properties"]) == {*DOCUMENT}
    for item in (schema, *schema["$defs"].values()):
        assert item["description"]
        assert item["additionalProperties"] is False
        for key, value in item["properties"].items():
            assert value["description"], key
            assert value["examples"], key
    SCHEMA.validate(DOCUMENT)


def test_the_examples_of_the_schema_are_valid() -> None:
    schema = build_map_schema()
    for item in (schema, *schema["$defs"].values()):
        for key, value in item["properties"].items():
            property_schema = {"$schema": schema["$schema"], "$defs": schema["$defs"], **value}
            validator = jsonschema.Draft202012Validator(property_schema)
            for example in value["examples"]:
                validator.validate(example)
            assert not validator.is_valid(object()), key
    # Together the examples form a map.
    document = {key: value["examples"][0] for key, value in schema["properties"].items()}
    assert from_json(document).obstacles


@pytest.mark.parametrize("name", list_bundled_maps())
def test_the_schema_accepts_every_bundled_map(name: str) -> None:
    SCHEMA.validate(json.loads(list_bundled_maps()[name].read_text()))


@pytest.mark.parametrize(("document", "expected"), STRUCTURAL, ids=lambda value: str(value)[-40:])
def test_the_schema_rejects_what_the_loader_rejects(document: dict[str, Any], expected: str) -> None:
    assert not SCHEMA.is_valid(document), expected


@settings(deadline=None, max_examples=count_examples(200))
@given(mutants(st.sampled_from(PLAIN_JUNK)))
def test_schema_and_loader_agree_on_structure(document: dict[str, Any]) -> None:
    try:
        validate_document(document, "m")
    except MapError as error:
        # A schema cannot express that a matrix is positive definite or that a sum of weights is positive.
        assume("positive definite" not in str(error))
        assume("at least one weight above 0" not in str(error))
        is_valid = False
    else:
        is_valid = True
    assert SCHEMA.is_valid(document) == is_valid
