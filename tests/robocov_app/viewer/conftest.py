"""What several tests of the window share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from driven_window import Driver, opened

from robocov_app.viewer.session import moments, session


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[Driver]:
    """A window with a session, as a user has it in front of them."""
    with opened(tmp_path) as driver:
        yield driver


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the past be thinned soon."""
    monkeypatch.setattr(moments, "_FEWEST", 20)
    monkeypatch.setattr(session, "History", lambda dt, most=0: moments.History(dt, 60_000))
