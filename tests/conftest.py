"""Environments that many tests share, drawn here so that the bundled maps may change."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Environment,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov_app.terminal import progress

# Tests neither use nor change the cache of the user.
os.environ["ROBOCOV_CACHE"] = ""
os.environ["ROBOCOV_DRAFTS"] = ""
# Machine code is kept: otherwise every process of a test would compile the kernels again.
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "kernels"))

# Which kernels are compiled already depends on earlier tests, so that commands do not report it here.
progress._print_compilation_notice = lambda: None

# A process in the background of a script ignores SIGINT, and so do its children.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# A process that is started by nohup ignores SIGHUP, and so do its children.
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# The times of examples differ by orders of magnitude, and machines are shared.
WITHOUT_DEADLINE = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
# Examples are the same every time, so that a new failure is caused by the change under test.
# `pytest --hypothesis-profile=thorough` runs twice as many, and `=explore` new ones.
settings.register_profile("quick", max_examples=8, derandomize=True, database=None, **WITHOUT_DEADLINE)
settings.register_profile("thorough", max_examples=16, derandomize=True, database=None, **WITHOUT_DEADLINE)
settings.register_profile("explore", max_examples=500, print_blob=True, **WITHOUT_DEADLINE)
settings.load_profile("quick")

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))


@pytest.fixture(scope="session")
def empty() -> Environment:
    """A convex square without obstacles."""
    return Environment("empty", SQUARE, (), {"corner": DiscStart((1.5, 1.5), 1.0), "uniform": UniformStart()})


@pytest.fixture(scope="session")
def cluttered() -> Environment:
    """An L-shaped hall with a pillar, a bent wall and a concave block."""
    return Environment(
        "cluttered",
        ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 10.0), (5.0, 5.0), (0.0, 5.0)),
        (
            CircleObstacle((3.0, 2.0), 0.5),
            WallObstacle(((5.0, 0.0), (5.0, 2.4), (7.0, 2.4)), 0.1),
            PolygonObstacle(((7.0, 5.0), (9.0, 5.0), (9.0, 8.0), (8.5, 8.0), (8.5, 5.5), (7.0, 5.5))),
        ),
        {"corner": DiscStart((1.0, 1.0), 0.8), "uniform": UniformStart()},
    )
