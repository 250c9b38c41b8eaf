"""Sweeps, per run, and the start of commands, against an interpreter that imports numpy."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from itertools import count

from robocov.mapfile import load_map
from robocov_app.bench.measure import Case, Row, in_turn
from robocov_app.sweep.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

NUMPY = "import numpy"  # the yardstick
BEFORE = 6.0  # see `Row.before`
MAPS, CONTROLLERS, DURATION, WORKERS = ("rooms", "museum", "campus"), ("rapf", "lloyd"), 20.0, 2


def cases(*, quick: bool = False) -> list[Case]:
    return [partial(_rows, 1 if quick else 84)]


def _rows(seeds: int) -> Iterator[Row]:
    maps = tuple(StudyMap(name, load_map(name)) for name in MAPS)
    study = Study(maps=maps, controllers=CONTROLLERS, seeds=range(seeds), robots=(6,), duration=DURATION)
    folders = count()
    with tempfile.TemporaryDirectory() as folder:
        calls = {
            "sweep": lambda: sweep(study, f"{folder}/{next(folders)}", workers=WORKERS, quiet=True),
            "numpy": lambda: [subprocess.run([sys.executable, "-c", NUMPY]) for _ in range(5)],
        }
        # processor time of all processes: a sweep takes all cores there are
        taken = in_turn(calls, 1, clock=lambda: sum(os.times()[:4]))
    size, each = {"runs": len(study), "workers": WORKERS}, taken["sweep"] / len(study)
    note, yardstick = f"{WORKERS / each:.1f} runs a second, all cores free", (NUMPY, taken["numpy"] / 5)
    shown = "sweep", f"a run of {DURATION:g} s", size, each
    yield Row(*shown, *yardstick, goal=BEFORE / 4, note=note, before=BEFORE)


# how long a command takes before it does anything

EVERYTHING = "import robocov\nfor name in robocov.__all__: getattr(robocov, name)"
WORDS: dict[str, tuple[str, ...]] = {  # first actions of a user, with the interpreter's arguments for each
    "robocov --help": ("-m", "robocov_app", "--help"),
    "robocov run --help": ("-m", "robocov_app", "run", "--help"),
    "robocov maps": ("-m", "robocov_app", "maps"),
    "import robocov": ("-c", "import robocov"),
    "import robocov, all of it": ("-c", EVERYTHING),
}
GOALS = {"robocov --help": 2.0}


def start_cases(*, quick: bool = False) -> list[Case]:
    return [partial(_start_rows, quick)]


def _start_rows(quick: bool) -> Iterator[Row]:
    silent = partial(subprocess.run, stdout=subprocess.DEVNULL, check=True)
    words = {NUMPY: ("-c", NUMPY), **WORDS}
    calls = {name: partial(silent, [sys.executable, *given]) for name, given in words.items()}
    taken = in_turn(calls, 3 if quick else 15)
    for name in WORDS:
        yield Row("start", name, {}, taken[name], NUMPY, taken[NUMPY], GOALS.get(name))
