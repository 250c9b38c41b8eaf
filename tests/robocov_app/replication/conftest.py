"""What the tests of the paper share."""

import pytest

from robocov_app.figures.statistics import bootstrap, bootstrap_statistic


@pytest.fixture
def few_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Intervals of a twentieth of the samples, where only what is made of them is looked at."""
    for drawn in (bootstrap, bootstrap_statistic):
        monkeypatch.setitem(drawn.__kwdefaults__, "resamples", 200)
