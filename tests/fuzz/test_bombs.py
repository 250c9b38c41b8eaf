"""Bombs are refused with a message of one line, within limits of time and memory."""

import os
from collections.abc import Iterator

import pytest
from bombs import BOMBS
from fuzz_reading import Reader
from importers import list_targets

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="waits for pipes as POSIX does")]
NOTHING_TO_REPEAT = {"map", "check", "movingai", "coverage-control", "houseexpo", "rings"}
"""What reads files in which everything is written out."""


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    with Reader() as reading:
        yield reading


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_refused(name: str, reader: Reader) -> None:
    make, job, words = BOMBS[name]
    outcome = reader.read(make(), job)
    assert outcome.outcome == "refused", f"{outcome.words}\n{outcome.traceback}"
    assert words in outcome.words


def test_every_format_that_could_hold_a_bomb_has_one() -> None:
    assert {name.partition(":")[0] for name in BOMBS} == set(list_targets()) - NOTHING_TO_REPEAT
