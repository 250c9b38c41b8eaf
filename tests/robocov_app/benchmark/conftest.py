"""Fixtures for the tests of the benchmark."""

from dataclasses import replace

import pytest
from benchmark_results import MAPS

from robocov_app.benchmark import suite


@pytest.fixture
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the plots of the page, which take most of the time to build it."""
    monkeypatch.setattr("robocov_app.benchmark.page.page.build_plots", lambda *args: [])


@pytest.fixture
def short_ideal_track(monkeypatch: pytest.MonkeyPatch) -> None:
    track = replace(suite.TRACKS["ideal"], seeds=(0,), maps=MAPS)
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]
