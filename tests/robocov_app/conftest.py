"""A browser that the tests of a module share."""

from __future__ import annotations

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
