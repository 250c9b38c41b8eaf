"""How long a command takes before it does anything, against an interpreter that imports numpy."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from functools import partial

from robocov_app.bench.measure import Case, InTurn, Row

EVERYTHING = "import robocov\nfor name in robocov.__all__: getattr(robocov, name)"

WORDS: dict[str, tuple[str, ...]] = {
    "robocov --help": ("-m", "robocov_app", "--help"),
    "robocov run --help": ("-m", "robocov_app", "run", "--help"),
    "robocov maps": ("-m", "robocov_app", "maps"),
    "import robocov": ("-c", "import robocov"),
    "import robocov, all of it": ("-c", EVERYTHING),
}
"""What people do first, and the words of the interpreter for it."""

GOALS = {"robocov --help": 2.0}

YARDSTICK = "import numpy"


def cases(*, quick: bool = False) -> list[Case]:
    """Return the one case: all processes in turn."""
    return [partial(_rows, quick)]


def _rows(quick: bool) -> Iterator[Row]:
    words = {YARDSTICK: ("-c", YARDSTICK), **WORDS}
    taken = InTurn({name: partial(_started, *given) for name, given in words.items()}).rounds(
        3 if quick else 15
    )
    for name in WORDS:
        yield Row("start", name, {}, taken[name], YARDSTICK, taken[YARDSTICK], GOALS.get(name))


def _started(*words: str) -> None:
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
