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

# no test finds, or leaves, anything in the cache of whoever runs it
os.environ["ROBOCOV_CACHE"] = ""
os.environ["ROBOCOV_DRAFTS"] = ""
# but for what is compiled: every process of a test would take its time over that
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "kernels"))

# which kernels are compiled already depends on the tests before: of that commands tell nothing here
progress._tell = lambda kernel: None

# what is started in the background of a script ignores Ctrl-C, and hands that on to all that it starts
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# what is started by nohup ignores SIGHUP, and hands that on as well
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# examples differ in cost by orders of magnitude, and machines are shared: time says nothing here
QUIET = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
# the same examples every time, so that a failure is the fault of the change that is tested; a sixth of them
# unless `pytest --hypothesis-profile=thorough` asks for all, or `=explore` for new ones
settings.register_profile("thorough", derandomize=True, database=None, **QUIET)
settings.register_profile("explore", max_examples=500, print_blob=True, **QUIET)
settings.load_profile("thorough")


@pytest.hookimpl(trylast=True)  # hypothesis marks its tests in a hook of its own
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--hypothesis-profile"):
        return
    for test in {item.function for item in items if item.get_closest_marker("hypothesis")}:  # type: ignore[attr-defined]
        wanted = getattr(test, "_hypothesis_internal_use_settings", None) or settings.default
        test._hypothesis_internal_use_settings = settings(wanted, max_examples=-(-wanted.max_examples // 6))


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
