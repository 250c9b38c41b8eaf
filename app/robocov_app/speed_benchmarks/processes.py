"""Benchmark of sweeps and of command start-up, compared with an interpreter that imports numpy."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from itertools import count

from robocov.mapfile import load_map
from robocov_app.speed_benchmarks.measure import Case, Row, measure_interleaved
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.sweeping import sweep

BASELINE = "import numpy"
"""Program of the baseline, as for `python -c`."""
MAPS = ("rooms", "museum", "campus")
"""Maps of the sweep."""
CONTROLLERS = ("rapf", "lloyd")
"""Controllers of the sweep."""
DURATION_S = 20.0
"""Simulated time of a run."""
WORKERS = 2
"""Number of processes."""
EARLIER_RATIO = 6.0
"""Earlier ratio of a run; see `Row.earlier_ratio`."""
_SWEEP_SPEEDUP = 4.0
"""Minimum speedup over the earlier ratio."""
_QUICK_SEEDS = 1
"""Number of seeds of the quick benchmark."""
_FULL_SEEDS = 84
"""Number of seeds of the full benchmark."""
_QUICK_START_ROUNDS = 3
"""Number of rounds of the quick benchmark of command start-up."""
_FULL_START_ROUNDS = 15
"""Number of rounds of the full benchmark of command start-up."""
_BASELINE_REPEATS = 5
"""Number of interpreters that are started in each round."""

_IMPORT_EVERYTHING = "import robocov\nfor name in robocov.__all__: getattr(robocov, name)"
COMMANDS: dict[str, tuple[str, ...]] = {
    "robocov --help": ("-m", "robocov_app", "--help"),
    "robocov run --help": ("-m", "robocov_app", "run", "--help"),
    "robocov maps": ("-m", "robocov_app", "maps"),
    "import robocov": ("-c", "import robocov"),
    "import robocov, all of it": ("-c", _IMPORT_EVERYTHING),
}
"""Commands that a new user runs first, with the arguments of the Python interpreter."""
START_GOALS = {"robocov --help": 2.0}
"""Maximum ratio of each command with a goal."""


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark case of a sweep."""
    seeds = _QUICK_SEEDS if quick else _FULL_SEEDS
    return [partial(_measure_sweep, seeds)]


def list_start_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark case of command start-up."""
    return [partial(_measure_starts, quick=quick)]


def _measure_sweep(seeds: int) -> Iterator[Row]:
    """Measure a sweep over maps, controllers and seeds, and yield the CPU time per run."""
    maps = tuple(StudyMap(name, load_map(name)) for name in MAPS)
    study = Study(maps=maps, controllers=CONTROLLERS, seeds=range(seeds), robots=(6,), duration=DURATION_S)
    numbers = count()
    with tempfile.TemporaryDirectory() as folder:
        calls = {
            "sweep": lambda: sweep(study, f"{folder}/{next(numbers)}", workers=WORKERS, quiet=True),
            "numpy": lambda: [
                subprocess.run([sys.executable, "-c", BASELINE]) for _ in range(_BASELINE_REPEATS)
            ],
        }
        # CPU time of all processes, because a sweep runs in several of them.
        times = measure_interleaved(calls, 1, clock=_get_processor_time)
    seconds = times["sweep"] / len(study)
    yield Row(
        "sweep",
        f"a run of {DURATION_S:g} s",
        {"runs": len(study), "workers": WORKERS},
        seconds,
        baseline=BASELINE,
        baseline_seconds=times["numpy"] / _BASELINE_REPEATS,
        max_ratio=EARLIER_RATIO / _SWEEP_SPEEDUP,
        note=f"{WORKERS / seconds:.1f} runs per second, all cores free",
        earlier_ratio=EARLIER_RATIO,
    )


def _get_processor_time() -> float:
    """Return the CPU time of this process and its finished child processes, s."""
    # The first four fields: user and system time, of this process and of its children.
    return sum(os.times()[:4])


def _measure_starts(*, quick: bool) -> Iterator[Row]:
    """Measure the start-up time of each command."""
    run_silently = partial(subprocess.run, stdout=subprocess.DEVNULL, check=True)
    commands = {BASELINE: ("-c", BASELINE), **COMMANDS}
    calls = {
        name: partial(run_silently, [sys.executable, *arguments]) for name, arguments in commands.items()
    }
    rounds = _QUICK_START_ROUNDS if quick else _FULL_START_ROUNDS
    times = measure_interleaved(calls, rounds)
    for name in COMMANDS:
        yield Row(
            "start",
            name,
            {},
            times[name],
            baseline=BASELINE,
            baseline_seconds=times[BASELINE],
            max_ratio=START_GOALS.get(name),
        )
