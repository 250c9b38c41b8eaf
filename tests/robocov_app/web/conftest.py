"""A served window, and pages that are connected to it."""

import pytest


@pytest.fixture
def folder(tmp_path):
    """Return the folder of the served window's files."""
    folder = tmp_path / "served"
    folder.mkdir()
    return folder


@pytest.fixture
def display(folder):
    from robocov_app.web.server import WebDisplay

    with WebDisplay(folder=folder) as display:
        yield display


@pytest.fixture
def teacher(display):
    """Return a page that may control the window."""
    from page_client import connect_page

    with connect_page(display.link) as teacher:
        yield teacher


@pytest.fixture
def viewer(display):
    """Return a page that watches the window."""
    from page_client import connect_page

    with connect_page(display.watch_link) as viewer:
        yield viewer
