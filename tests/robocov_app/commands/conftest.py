"""Fixtures for the tests of the commands."""

import pytest
from small_studies import DirectExecutor

from robocov_app.runs import artifacts
from robocov_app.runs import cost as run_cost
from robocov_app.sweep import sweeping


@pytest.fixture(autouse=True)
def use_quick_settings(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw distances on a coarse lattice and sweep in this process, except in slow tests."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(run_cost, "MIN_FIGURE_LATTICE", 32)
        monkeypatch.setattr(sweeping, "LocalPool", DirectExecutor)


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Save no figures of runs: to draw them takes longer than to simulate."""
    monkeypatch.setattr(artifacts, "save_figures", lambda *_, **__: None)
