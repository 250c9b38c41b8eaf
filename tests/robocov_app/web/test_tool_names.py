"""The buttons on the page of a phone have the names of the tools in the window."""

import re
from importlib.resources import files

from driven_editor import open_editor
from driven_window import open_viewer


def read_button_labels(constant):
    """Return the labels of the page's buttons by the names of their tools, from a constant of its script."""
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8")
    content = re.search(rf"const {constant} = \{{(.*?)\}};", page, re.DOTALL)[1]
    return dict(re.findall(r'(\w+): "([^"]+)"', content))


def get_titles(tools):
    return {tool.name: tool.title for tool in tools}


def test_tools_of_the_viewer_have_one_name(tmp_path):
    with open_viewer(tmp_path) as driver:
        assert read_button_labels("TOOLS") == get_titles(driver.viewer.toolbox.by_name.values())


def test_tools_of_the_editor_have_one_name(tmp_path):
    with open_editor(tmp_path) as driver:
        assert read_button_labels("EDITOR_TOOLS") == get_titles(driver.editor.toolbox.by_name.values())
