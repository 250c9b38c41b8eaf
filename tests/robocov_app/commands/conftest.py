import pytest
from swept import DirectExecutor

from robocov_app.runs import artifacts
from robocov_app.runs import cost as run_cost
from robocov_app.sweep import sweeping


@pytest.fixture(autouse=True)
def _quick(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of distances from few sites, and sweeps in this process; but for the thorough run."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(run_cost, "MIN_FIGURE_LATTICE", 32)
        monkeypatch.setattr(sweeping, "LocalPool", DirectExecutor)


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs are not drawn, which takes longer than the runs."""
    monkeypatch.setattr(artifacts, "save_figures", lambda *_, **__: None)
