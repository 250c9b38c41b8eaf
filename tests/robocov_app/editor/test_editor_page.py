"""The editor in a page: the part that shows the map alone, and dialogs of phones."""

from pathlib import Path

import pytest
from driven_editor import open_editor

from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.page_view import PageAppearance


def test_the_part_is_the_map_below_the_legend(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        window = driver.window
        arena = window.layout.arena
        with_legend = window.controls.map_box
        driver.editor.shown.discard("legend")
        assert window.controls.map_box == arena
    assert with_legend.top > arena.top
    assert with_legend.top + with_legend.height == arena.top + arena.height


@pytest.mark.parametrize("is_compact", [True, False])
def test_only_dialogs_of_phones_do_not_mention_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_compact: bool
) -> None:
    labels: list[str] = []
    monkeypatch.setattr(Ui, "label", lambda ui, text, **style: labels.append(text))
    with open_editor(tmp_path, size=(780, 1584), scale=2.0) as driver:
        appearance = PageAppearance(
            scale=2.0, theme="light", shows_panel=False, is_compact=is_compact, is_motion_reduced=True
        )
        driver.window.set_appearance(appearance)
        driver.window.run_command("recent")
        driver.run_frames(2)
    counts = {label for label in labels if "in all" in label}
    assert len(counts) == 1
    assert ("Esc" not in counts.pop()) == is_compact
