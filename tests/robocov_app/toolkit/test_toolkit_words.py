"""Layout of a window, names of keys, and typed commands."""

import pytest

from robocov_app.toolkit.commands.command import split_command
from robocov_app.toolkit.window.input import format_key
from robocov_app.toolkit.window.layout import build_layout, find_max_scale, is_inside


def test_the_panel_is_to_the_right_of_the_arena() -> None:
    layout = build_layout((1280, 720), 1.0, 1, 4 / 3)
    assert layout.panel == (960, 44, 320, 676)
    assert layout.arena == (128, 44, 832, 506)
    assert is_inside((10, 10, 5, 5), (14, 10))
    assert not is_inside((10, 10, 5, 5), (15, 10))


@pytest.mark.parametrize(
    ("size", "scale"),
    [((900, 600), 1.0), ((1280, 720), 1.125), ((3840, 2160), 3.5), ((640, 480), 0.625), ((1170, 2532), 3.25)],
)
def test_the_scale_is_limited_by_the_window_size(size: tuple[int, int], scale: float) -> None:
    assert find_max_scale(size) == scale


def test_keys_are_formatted_and_commands_split() -> None:
    keys = ("ctrl+shift+z", "page down", "f1", "space", "`", "left")
    assert [format_key(key) for key in keys] == ["Ctrl+Shift+Z", "Page down", "F1", "Space", "`", "←"]
    assert split_command("k_rep = 0.5") == ("k_rep", "0.5")
    assert (split_command("map a=b.json"), split_command("robots")) == (("map", "a=b.json"), ("robots", ""))
