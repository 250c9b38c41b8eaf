"""A browser that the tests of a module share, and a process that Ctrl+C interrupts."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from driven_browser import Browser


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with pytest.MonkeyPatch.context() as patch:
        # Without this, Selenium would look for drivers in the network.
        patch.setenv("SE_OFFLINE", "true")
        shared = Browser(tmp_path_factory.mktemp("browser"))
        try:
            yield shared
        finally:
            shared.driver.quit()


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let SIGINT raise a KeyboardInterrupt, as in a terminal."""
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)
