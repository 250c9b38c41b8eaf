"""Fixtures of the viewer's tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from driven_window import Driver, open_viewer

from robocov_app.viewer.session import present
from robocov_app.viewer.session.past import history


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[Driver]:
    """Yield the driver of a window with three robots in the hall."""
    with open_viewer(tmp_path) as driver:
        yield driver


@pytest.fixture
def short_history(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the memory of the past, so that it is thinned soon."""
    monkeypatch.setattr(history, "MIN_STATES", 20)
    monkeypatch.setattr(present, "RunHistory", lambda dt: history.RunHistory(dt, 60_000))
