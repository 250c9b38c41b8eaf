"""Mappings of plain values; other features of YAML are rejected."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import MapError
from robocov_app.formats.files import MAX_YAML_BYTES as MAX_BYTES
from robocov_app.formats.files import parse_yaml as parse


def test_values_are_text_as_it_is_written() -> None:
    text = (
        b"\xef\xbb\xbfimage: 'a b.pgm' # here\r\nresolution: 1e-2\r\norigin: [-1, .5, 010]\r\nnegate: no\r\n"
    )
    assert parse(text, "m") == {
        "image": "a b.pgm", "resolution": "1e-2", "origin": ["-1", ".5", "010"], "negate": "no",
    }  # fmt: skip
    assert parse(b"---\na:\n- 1\n- 2\n...\n", "m") == {"a": ["1", "2"]}
    assert parse(b'{"a": "1", b: null, c: }', "m") == {"a": "1", "b": "null", "c": ""}
    assert parse(b"", "m") == parse(b"# nothing\n", "m") == {}


def test_lists_and_mappings_are_nested() -> None:
    text = b"a: {b: 1, c: [2, 3]}\nd: [[1, {x: y}], 3]\ne: 4\nf: {}\ng:\n  - h: []\n    i: 5"
    assert parse(text, "m") == {
        "a": {"b": "1", "c": ["2", "3"]}, "d": [["1", {"x": "y"}], "3"], "e": "4", "f": {},
        "g": [{"h": [], "i": "5"}],
    }  # fmt: skip


BOMB = b"a: &a [x,x,x]\n" + b"".join(
    b"%c: &%c [*%c,*%c,*%c]\n" % (k, k, k - 1, k - 1, k - 1) for k in range(98, 110)
)


DEEP = b"a: &a [x]\n" + b"".join(b"%c: &%c [*%c]\n" % (k, k, k - 1) for k in range(98, 118))


def test_aliases_repeat_values() -> None:
    text = b"a: &box {w: 1, h: [2, 3]}\nb: [*box, *box]\nc: &word x\nd: *word\ne: &box y\nf: *box"
    box = {"w": "1", "h": ["2", "3"]}
    assert parse(text, "m") == {"a": box, "b": [box, box], "c": "x", "d": "x", "e": "y", "f": "y"}


def test_merge_keys_add_missing_values() -> None:
    text = b"a: &a {x: 1, y: 2}\nb: &b {y: 3, z: 4}\nc: {<<: *a, y: 5}\nd: {z: 6, <<: [*a, *b]}\ne: {'<<': 7}"
    found = parse(text, "m")
    assert found["c"] == {"x": "1", "y": "5"}
    assert found["d"] == {"x": "1", "y": "2", "z": "6"}
    assert found["e"] == {"<<": "7"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"a: !!python/object/apply:os.system [ls]", "m: line 1: expected a plain value, got the tag"),
        (b"a: 1\nb: !x 2", "m: line 2: expected a plain value"),
        (b"a: *x\nb: &x 1", "m: line 1: expected the name of an anchor before it, got the alias 'x'"),
        (b"a: &x [1, *x]", "m: line 1: expected the name of an anchor before it, got the alias 'x'"),
        (BOMB, "m: line 10: expected at most 50000 values, including those of aliases, got more"),
        (DEEP, "m: line 12: nested too deeply, expected at most 12 levels"),
        (b"<<: *x", "m: line 1: expected the name of an anchor before it, got the alias 'x'"),
        (b"a: &x 1\nb: {<<: *x}", "m: line 2: <<: expected a mapping, or a list of them, got another value"),
        (b"a: &x b\n*x : 1", "m: line 2: expected a scalar as the key, got an alias"),
        (b"a: 1\na: 2", "m: line 2: a: duplicate key"),
        (b"- 1\n- 2", "m: line 1: expected a mapping"),
        (b"just a word", "m: line 1: expected a mapping"),
        (b"a: 1\n---\nb: 2", "m: line 2: expected one document, got a second one"),
        (b"[a, b]: 1", "m: line 1: "),
        (b"a: {b: 1, b: 2}", "m: line 1: b: duplicate key"),
        (b"? {a: b}\n: 1", "m: line 1: expected a scalar as the key, got a collection"),
        (b"a: [1", "m: line 1: not YAML: "),
        (b"a: 'x", "not YAML"),
        (b"a: \tb: c", "not YAML"),
        (b'a: "\\UFFFFFFFF"', "not YAML"),
        (b"a: \x01", "not YAML"),
        (b"\xff\xfea", "byte 0: not UTF-8"),
        (b"a: " + b"[" * 1000, "nested too deeply"),
        (b"[" * 60_000, "expected a mapping"),
        (b"{" * 60_000, "m: line 1: "),
        (b"a: " + b"x" * MAX_BYTES, "m: expected at most 256 kB of YAML, got more"),
    ],
    ids=map(str, range(99)),
)
def test_unsupported_yaml_is_rejected(text: bytes, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        parse(text, "m")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@settings(deadline=None, max_examples=count_examples(300))
@given(st.one_of(st.binary(max_size=80), st.text(alphabet="ab:-[]{},&*!|>'\"#%@ \n\t01.?", max_size=60)))
def test_any_text_is_a_mapping_or_rejected(text: bytes | str) -> None:
    try:
        result = parse(text if isinstance(text, bytes) else text.encode(), "m")
    except MapError as error:
        assert str(error).startswith("m: ")
        assert "\n" not in str(error)
        return
    for key, value in result.items():
        assert isinstance(key, str)
        assert isinstance(value, str | list | dict)
