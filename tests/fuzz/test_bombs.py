"""Decompression bombs are rejected with a message of one line, within limits of time and memory."""

import os
from collections.abc import Iterator

import pytest
from bombs import BOMBS
from fuzz_reading import Reader
from importers import list_targets

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name == "nt", reason="select() works with pipes on POSIX only"),
]
FORMATS_WITHOUT_BOMBS = {"map", "check", "movingai", "coverage-control", "houseexpo", "rings"}
"""Formats in which nothing is compressed, repeated or included."""


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    with Reader() as reader:
        yield reader


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_rejected(name: str, reader: Reader) -> None:
    build_case, job, message = BOMBS[name]
    outcome = reader.read(build_case(), job)
    assert outcome.outcome == "rejected", f"{outcome.text}\n{outcome.traceback}"
    assert message in outcome.text


def test_every_format_that_may_contain_a_bomb_has_one() -> None:
    assert {name.partition(":")[0] for name in BOMBS} == set(list_targets()) - FORMATS_WITHOUT_BOMBS
