"""Fixtures for the tests of the paper's study."""

import pytest

from robocov_app.figures.statistics import bootstrap, bootstrap_statistic


@pytest.fixture
def few_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compute intervals from a twentieth of the samples, for tests that need no exact intervals."""
    for function in (bootstrap, bootstrap_statistic):
        monkeypatch.setitem(function.__kwdefaults__, "resamples", 200)
