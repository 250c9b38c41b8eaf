"""The image of an import: two maps at the same scale, marked differences, and readable texts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import PathPatch
from page_layout import assert_layout_is_clear
from PIL import Image
from shapely import MultiPolygon, Polygon, box

from robocov.errors import OutputError, ParameterError
from robocov_app.figures.page import to_plot_color
from robocov_app.formats import ForeignMap, Shaping, build_environment
from robocov_app.formats.preview import plot_import, save_preview
from robocov_app.formats.preview.plotting import FORMAT_LABELS
from robocov_app.formats.registry import IMPORTERS
from robocov_app.look.theme import DARK, LIGHT

HALL = box(0, 0, 12, 8)
PILLARS = shapely.union_all([box(4, 2, 5, 3), box(4, 3.6, 5, 5), box(9, 6, 9.1, 6.1)])
CLOSET = box(13, 0, 15, 2)


KEEP_SMALL_OBSTACLES = Shaping(specks=0.05)


def build_foreign_map(free: Any, **attributes: Any) -> ForeignMap:
    parts = list(getattr(free, "geoms", [free]))
    return ForeignMap("plan", "", MultiPolygon(parts), "svg", vertices_read=123, **attributes)


def plot_converted_map(
    free: Any, shaping: Shaping = KEEP_SMALL_OBSTACLES, theme: str = "light", **attributes: Any
) -> Any:
    foreign = build_foreign_map(free, **attributes)
    environment, report = build_environment(foreign, shaping, "plan.svg")
    return plot_import(foreign, environment, report, theme=theme)


def find_marks(axes: Any, color: tuple[int, int, int]) -> list[Any]:
    return [patch for patch in axes.patches if to_rgb(patch.get_facecolor()) == to_plot_color(color)]


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=lambda theme: theme.name)
def test_lost_areas_are_on_the_left_and_opened_ones_on_the_right(theme: Any) -> None:
    figure = plot_converted_map((HALL - PILLARS).union(CLOSET), theme=theme.name)
    before, after = figure.axes
    assert before.get_xlim() == after.get_xlim()
    assert before.get_ylim() == after.get_ylim()
    lost = find_marks(before, theme.trajectory)
    assert [patch.get_path().get_extents().bounds for patch in lost] == [CLOSET.bounds[:2] + (2, 2)]
    opened = find_marks(after, theme.start)
    assert np.allclose([patch.get_path().get_extents().bounds for patch in opened], [(9, 6, 0.1, 0.1)])
    assert not find_marks(before, theme.start)
    assert not find_marks(after, theme.trajectory)
    texts = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"left out: 4 m² were free", "opened: 0.01 m² were solid", "narrowest passage, 0.6 m"} <= texts
    assert_layout_is_clear(figure)


def test_the_preview_has_title_and_report() -> None:
    figure = plot_converted_map((HALL - PILLARS).union(CLOSET), repaired=("2 rings closed",))
    words = [text.get_text() for text in figure.texts]
    assert {"plan", "as read", "as imported", "repaired: 2 rings closed"} <= set(words)
    assert any(word.startswith("123 vertices, ") for word in words)
    assert any(word.startswith("dropped: 1 separate part") for word in words)
    assert any(word.endswith("imported from SVG") for word in words)


def test_each_format_has_a_label() -> None:
    assert set(FORMAT_LABELS) == set(IMPORTERS)


def test_nothing_is_marked_where_nothing_differs() -> None:
    figure = plot_converted_map(HALL - box(4, 2, 5, 8))
    before, after = figure.axes
    assert not find_marks(before, LIGHT.trajectory)
    assert not find_marks(after, LIGHT.start)
    assert len(figure.legends[0].get_texts()) == 3
    edges = [found for found in before.collections if isinstance(found, LineCollection)]
    assert sum(len(found.get_segments()) for found in edges) == 1


def test_walls_moved_within_the_tolerance_are_not_marked() -> None:
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    wavy = Polygon(np.column_stack([np.cos(angle), np.sin(angle)]) * (4 + 0.03 * np.cos(40 * angle))[:, None])
    figure = plot_converted_map(wavy, Shaping(simplify=0.1))
    assert not find_marks(figure.axes[0], LIGHT.trajectory)
    assert not find_marks(figure.axes[1], LIGHT.start)


def test_all_lines_of_a_long_note_but_the_first_are_indented() -> None:
    figure = plot_converted_map(HALL, notes=("long note " * 60,))
    lines = [text.get_text() for text in figure.texts if "long note" in text.get_text()]
    assert len(lines) > 2
    *indented, first = lines  # The last line of the report is written first.
    assert first.startswith("note: long note")
    assert all(line.startswith("    ") for line in indented)


@pytest.mark.slow
@pytest.mark.parametrize(
    "free", [HALL, box(0, 0, 60, 2), box(0, 0, 2, 60), box(5e5, 5e6, 5e5 + 30, 5e6 + 20), box(0, 0, 1, 1)],
    ids=["hall", "corridor", "shaft", "far away", "small"],
)  # fmt: skip
@pytest.mark.parametrize("lines", [0, 1, 30])
def test_texts_and_maps_do_not_overlap(free: Any, lines: int) -> None:
    notes = tuple(f"note {k}: " + "what was taken as something else " * 9 for k in range(lines))
    figure = plot_converted_map(free, notes=notes)
    assert_layout_is_clear(figure)
    words = [text.get_text() for text in figure.texts]
    assert any(word.startswith("and ") and word.endswith(" more lines") for word in words) == (lines > 9)


def test_invalid_free_space_is_drawn() -> None:
    bow = Polygon([(0, 0), (8, 8), (8, 0), (0, 8)])
    assert not bow.is_valid
    figure = plot_converted_map(bow)
    assert any(isinstance(patch, PathPatch) for patch in figure.axes[0].patches)


@pytest.mark.slow
def test_files_are_the_same_every_time(tmp_path: Path) -> None:
    read = build_foreign_map(HALL - PILLARS)
    environment, report = build_environment(read, Shaping(), "plan.svg")
    for name in ("plan.png", "plan.svg", "plan.pdf"):
        save_preview(read, environment, report, tmp_path / name)
        first = (tmp_path / name).read_bytes()
        save_preview(read, environment, report, tmp_path / name)
        assert (tmp_path / name).read_bytes() == first
    with Image.open(tmp_path / "plan.png") as picture:
        assert picture.getpixel((2, 2))[:3] == LIGHT.background
    with pytest.raises(ParameterError, match=r"expected .png, .svg or .pdf, got suffix '.bmp'"):
        save_preview(read, environment, report, tmp_path / "plan.bmp")
    with pytest.raises(OutputError, match="there is no folder"):
        save_preview(read, environment, report, tmp_path / "none" / "plan.png")
