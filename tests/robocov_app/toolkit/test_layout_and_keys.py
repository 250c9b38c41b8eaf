"""Layout and scale of a window, names of keys, and typed commands."""

import re

import pytest

from robocov_app.toolkit.commands.command import split_command
from robocov_app.toolkit.window.input import format_key
from robocov_app.toolkit.window.layout import build_layout, explain_reduced_scale, find_max_scale, is_inside


def test_the_panel_is_to_the_right_of_the_map() -> None:
    layout = build_layout((1280, 720), 1.0, 1, 4 / 3)
    assert layout.panel == (960, 44, 320, 676)
    assert layout.arena == (136, 44, 824, 506)


def test_a_box_does_not_contain_its_right_edge() -> None:
    assert is_inside((10, 10, 5, 5), (14, 10))
    assert not is_inside((10, 10, 5, 5), (15, 10))


@pytest.mark.parametrize(
    ("size", "scale"),
    [((900, 600), 1.0), ((1280, 720), 1.125), ((3840, 2160), 3.5), ((640, 480), 0.625), ((1170, 2532), 3.25)],
)
def test_the_scale_is_limited_by_the_window_size(size: tuple[int, int], scale: float) -> None:
    assert find_max_scale(size) == scale


def test_a_window_in_portrait_orientation_needs_less_width_for_a_scale() -> None:
    assert explain_reduced_scale(2.0, (700, 1000)) == "scale 2 needs a window of 720 × 1200; using 1.625"
    assert explain_reduced_scale(2.0, (720, 1200)) == ""


@pytest.mark.parametrize("scale", [1.1, 1.125, 1.9, 3.3])
def test_a_window_of_the_recommended_size_has_the_requested_scale(scale: float) -> None:
    recommended = re.search(r"a window of (\d+) × (\d+);", explain_reduced_scale(scale, (900, 600)))
    assert recommended is not None
    assert explain_reduced_scale(scale, (int(recommended[1]), int(recommended[2]))) == ""


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("ctrl+shift+z", "Ctrl+Shift+Z"),
        ("page down", "Page down"),
        ("f1", "F1"),
        ("space", "Space"),
        ("`", "`"),
        ("left", "←"),
    ],
)
def test_keys_have_readable_names(key: str, text: str) -> None:
    assert format_key(key) == text


@pytest.mark.parametrize(
    ("text", "name", "argument"),
    [("k_rep = 0.5", "k_rep", "0.5"), ("map a=b.json", "map", "a=b.json"), ("robots", "robots", "")],
)
def test_typed_commands_are_split_into_name_and_argument(text: str, name: str, argument: str) -> None:
    assert split_command(text) == (name, argument)
