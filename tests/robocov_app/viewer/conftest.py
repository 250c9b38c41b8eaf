"""What several tests of the window share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from driven_window import Driver, opened

from robocov_app.viewer.session import history, present


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[Driver]:
    """A window with a session, as a user has it in front of them."""
    with opened(tmp_path) as driver:
        yield driver


@pytest.fixture
def short_history(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the past be thinned soon."""
    monkeypatch.setattr(history, "MIN_STATES", 20)
    monkeypatch.setattr(present, "RunHistory", lambda dt: history.RunHistory(dt, 60_000))
