"""Scanned plans: the page around them, thin strokes, colors, and the meaning of transparency."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageOps

from robocov.errors import MapError, ParameterError
from robocov_app.formats import ForeignMap, ImportReport, ReadOptions, Shaping, import_map
from robocov_app.formats.geometry.cells.strokes import remove_thin_strokes


def create_paper(width: int = 200, height: int = 120) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    picture = Image.new("RGB", (width, height), "white")
    return picture, ImageDraw.Draw(picture)


def import_picture(
    folder: Path, picture: Image.Image, name: str = "plan.png", inside: tuple[float, float] | None = None,
    **options: object,
) -> tuple[float, ImportReport, ForeignMap]:  # fmt: skip
    """Save a picture, and return the free area of the map that it becomes with cells of 0.1 m."""
    picture.save(folder / name)
    read = ReadOptions(cell=0.1, **options)  # type: ignore[arg-type]
    environment, report, foreign = import_map(folder / name, options=read, shaping=Shaping(inside=inside))
    return environment.free_area, report, foreign


def draw_flat() -> Image.Image:
    """A flat of 7.4 x 3.4 m with a wall that parts it, amid paper of 20 x 12 m."""
    picture, draw = create_paper()
    draw.rectangle((60, 40, 139, 79), fill="black")
    draw.rectangle((63, 43, 136, 76), fill="white")
    draw.line((100, 40, 100, 64), fill="black", width=2)
    return picture


def test_the_paper_around_a_plan_is_removed(tmp_path: Path) -> None:
    area, report, _ = import_picture(tmp_path, draw_flat())
    assert area == pytest.approx(7.4 * 3.4 - 0.2 * 2.2, abs=0.05)
    (note,) = [note for note in report.notes if "paper around a plan" in note]
    assert "the largest part of the free space, 208 m²" in note and "100% of the edge" in note
    assert "--inside" in note
    place = report.others[0]
    assert import_picture(tmp_path, draw_flat(), inside=place)[0] == pytest.approx(20 * 12 - 8 * 4, abs=0.1)


def test_the_inside_of_a_small_obstacle_is_not_a_plan(tmp_path: Path) -> None:
    picture, draw = create_paper()
    draw.rectangle((60, 40, 84, 64), outline="black", width=3)
    area, report, _ = import_picture(tmp_path, picture)
    assert area > 200.0
    assert not any("paper" in note for note in report.notes)


def test_free_space_within_walls_at_the_edge_stays(tmp_path: Path) -> None:
    picture, draw = create_paper()
    draw.rectangle((0, 0, 199, 119), outline="black", width=2)
    draw.rectangle((90, 0, 99, 5), fill="white")  # a door to the edge of the picture
    draw.rectangle((150, 60, 199, 119), outline="black", width=2)
    area, report, _ = import_picture(tmp_path, picture)
    assert area > 150.0
    assert not any("paper" in note for note in report.notes)


def test_an_open_outer_door_is_reported_as_the_cause(tmp_path: Path) -> None:
    picture = draw_flat()
    ImageDraw.Draw(picture).rectangle((110, 76, 119, 82), fill="white")
    area, report, _ = import_picture(tmp_path, picture)
    assert area > 200.0
    assert any("an outer door may be open" in note for note in report.notes)


def test_thin_strokes_are_dropped_and_walls_keep_their_corners(tmp_path: Path) -> None:
    picture = draw_flat()
    draw = ImageDraw.Draw(picture)
    draw.arc((104, 46, 124, 66), 180, 360, fill="black")
    draw.line((104, 56, 124, 56), fill="black")
    draw.rectangle((110, 66, 116, 72), outline="black")
    with_strokes = import_picture(tmp_path, picture)[0]
    area, report, _ = import_picture(tmp_path, picture, min_stroke="2px")
    assert with_strokes < area - 0.1
    assert area == pytest.approx(7.4 * 3.4 - 0.2 * 2.2, abs=0.05)
    (dropped,) = [line for line in report.dropped if "strokes" in line]
    assert dropped.startswith("strokes thinner than 0.2 m (2 px) in ")
    assert dropped.endswith("(--min-stroke)")
    assert import_picture(tmp_path, picture, min_stroke="0.2")[0] == area
    # The wall of two pixels is thinner than 3 px.
    assert import_picture(tmp_path, picture, min_stroke="3px")[0] == pytest.approx(7.4 * 3.4, abs=0.1)


@pytest.mark.parametrize("text", ["", "x", "-1", "1e9", "3 pixels", "nan", "px", "99999m"])
def test_invalid_stroke_widths_are_rejected(text: str) -> None:
    with pytest.raises(ParameterError, match="min_stroke: "):
        ReadOptions(min_stroke=text)


def test_a_stroke_as_wide_as_a_hall_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="min_stroke: expected at most 200 pixels, got 201"):
        import_picture(tmp_path, draw_flat(), min_stroke="201px")


@pytest.mark.parametrize("width", range(1, 10))
def test_an_opening_distinguishes_widths_by_a_cell(width: int) -> None:
    solid = np.zeros((60, 70), dtype=bool)
    solid[20 : 20 + width, 10:50] = True
    solid[30:60, 40 : 40 + width] = True  # on to the edge
    assert (remove_thin_strokes(solid, width) == solid).all()
    assert not remove_thin_strokes(solid, width + 1).any()


def test_an_opening_does_not_depend_on_tiles(monkeypatch: pytest.MonkeyPatch) -> None:
    solid = np.random.default_rng(1).random((70, 60)) > 0.15
    whole = [remove_thin_strokes(solid, width) for width in (2, 3, 6)]
    monkeypatch.setattr("robocov_app.formats.geometry.cells.strokes._TILE_CELLS", 20)
    tiled = [remove_thin_strokes(solid, width) for width in (2, 3, 6)]
    assert all((one == other).all() for one, other in zip(whole, tiled, strict=True))


@pytest.mark.parametrize("shape", [(30_000, 24), (24, 30_000), (1200, 3000)])
def test_an_opening_by_a_wide_disc_needs_little_memory(shape: tuple[int, int]) -> None:
    solid = np.ones(shape, dtype=bool)
    tracemalloc.start()
    try:
        remove_thin_strokes(solid, 150)
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 250_000_000


def draw_colored_room() -> Image.Image:
    """A room of 20 x 12 m with a pale gray bench, a dark blue rug, and a red line across everything."""
    picture, draw = create_paper()
    draw.rectangle((0, 0, 199, 119), outline="black", width=3)
    draw.rectangle((20, 20, 59, 39), fill="#c8c8c8")
    draw.rectangle((100, 60, 139, 79), fill="#000080")
    draw.line((0, 100, 199, 100), fill="red", width=2)
    return picture


@pytest.mark.parametrize("name", ["plan.png", "plan.ppm", "plan.jpg"])
def test_colors_of_a_picture_have_their_declared_roles(tmp_path: Path, name: str) -> None:
    room = 19.4 * 11.4
    bench = 8.0
    rug = 8.0
    above = 9.7 * 19.4
    area, _, _ = import_picture(tmp_path, draw_colored_room(), name)
    assert area == pytest.approx(above - rug, abs=1.0)
    declared = {"free_color": ("navy", "white"), "solid_color": ("#c8c8c8",), "ignore_color": ("red",)}
    area, report, _ = import_picture(tmp_path, draw_colored_room(), name, **declared, color_tolerance=90.0)
    assert area == pytest.approx(room - bench, abs=1.0)
    shares = [note for note in report.notes if "of the pixels are" in note]
    assert [note.rpartition(" ")[2] for note in shares] == ["free", "obstacles", "out"]


@pytest.mark.parametrize("role", ["free", "ignore"])
def test_soft_edges_of_a_dark_color_are_not_walls(tmp_path: Path, role: str) -> None:
    large = Image.new("RGB", (800, 480), "white")
    draw = ImageDraw.Draw(large)
    draw.rectangle((0, 0, 799, 479), outline="black", width=16)
    draw.rectangle((501, 101, 702, 303), fill="#204080")
    soft = large.resize((200, 120), Image.Resampling.LANCZOS)
    area, _, _ = import_picture(tmp_path, soft, **{f"{role}_color": ("#204080",)})
    assert area == pytest.approx(19.2 * 11.2, abs=0.3)


def test_an_ignored_line_leaves_the_wall_below_it(tmp_path: Path) -> None:
    _, _, foreign = import_picture(tmp_path, draw_colored_room(), ignore_color=("red",))
    low_x, _, high_x, _ = foreign.free.bounds
    assert (low_x, high_x) == pytest.approx((0.3, 19.7))


def test_the_nearest_declared_color_counts(tmp_path: Path) -> None:
    picture, draw = create_paper(40, 40)
    draw.rectangle((0, 0, 39, 39), outline="black", width=2)
    draw.rectangle((10, 10, 19, 19), fill=(200, 200, 200))
    draw.rectangle((25, 25, 34, 34), fill=(210, 210, 210))
    options = {"solid_color": ("#c8c8c8",), "free_color": ("#d2d2d2",)}
    area, _, _ = import_picture(tmp_path, picture, **options)
    assert area == pytest.approx(3.6**2 - 1.0)
    assert import_picture(tmp_path, picture, solid_color=("#c8c8c8",))[0] == pytest.approx(3.6**2 - 2.0)
    exact = import_picture(tmp_path, picture, solid_color=("#c8c8c8",), color_tolerance=0.0)
    assert exact[0] == pytest.approx(3.6**2 - 1.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"free_color": ("nocolor",)}, "free_color: expected a color name or #rrggbb"),
        ({"solid_color": ("transparent",)}, "solid_color: expected a color name"),
        ({"free_color": ("red",), "ignore_color": ("#f00",)}, "ignore_color: '#f00' is a color of free"),
        ({"color_tolerance": 256.0}, "color_tolerance: expected a number from 0 to 255, got 256"),
        (
            {"free_color": tuple(f"#0000{k:02x}" for k in range(33))},
            "free_color: expected at most 32 colors in all, got 33",
        ),
        (
            {"free_color": ("red",), "solid_color": tuple(f"#0000{k:02x}" for k in range(39))},
            "solid_color: expected at most 32 colors in all, got 40",
        ),
    ],
)
def test_invalid_colors_are_rejected(options: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        ReadOptions(**options)  # type: ignore[arg-type]


def draw_on_transparency() -> Image.Image:
    picture = Image.new("RGBA", (80, 60), (0, 0, 0, 0))
    ImageDraw.Draw(picture).rectangle((5, 5, 74, 54), outline=(0, 0, 0, 255), width=3)
    return picture


def test_a_dark_drawing_without_paper_is_free_where_it_is_transparent(tmp_path: Path) -> None:
    area, report, _ = import_picture(tmp_path, draw_on_transparency())
    assert area == pytest.approx(6.4 * 4.4)
    assert any(note.startswith("only dark paint on a transparent background") for note in report.notes)
    with pytest.raises(MapError, match=r"no cell is free: .*% of the pixels are transparent"):
        import_picture(tmp_path, draw_on_transparency(), unknown="obstacle")


@pytest.mark.parametrize(
    ("unknown", "treatment"), [("obstacle", "treated as obstacles"), ("cut", "cut away")]
)
def test_the_treatment_of_transparency_is_reported_if_nothing_is_free(
    tmp_path: Path, unknown: str, treatment: str
) -> None:
    with pytest.raises(MapError, match=f"of the pixels are transparent and {treatment}"):
        import_picture(tmp_path, draw_on_transparency(), unknown=unknown)


def test_brightness_is_reported_if_few_pixels_of_a_dark_picture_are_transparent(tmp_path: Path) -> None:
    picture = Image.new("RGBA", (30, 30), (51, 51, 51, 255))
    picture.putpixel((3, 3), (0, 0, 0, 0))
    with pytest.raises(MapError, match="no cell is free: the brightness of the pixels"):
        import_picture(tmp_path, picture)


def test_transparency_is_reported_if_nothing_is_solid(tmp_path: Path) -> None:
    picture = Image.new("RGBA", (40, 40), (255, 255, 255, 255))
    ImageDraw.Draw(picture).rectangle((10, 10, 19, 19), fill=(0, 0, 0, 100))
    _, report, _ = import_picture(tmp_path, picture, unknown="free")
    (note,) = [note for note in report.notes if note.startswith("nothing is solid")]
    assert "6.25% of the pixels are transparent (less than half opaque)" in note


def test_brightness_is_reported_if_everything_is_solid_or_free(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"the brightness of the pixels is from 0.2 to 0.4 .*--threshold"):
        picture = Image.new("L", (30, 30), 51)
        ImageDraw.Draw(picture).rectangle((5, 5, 20, 20), fill=102)
        import_picture(tmp_path, picture)
    _, report, _ = import_picture(tmp_path, Image.new("L", (30, 30), 204))
    assert any("the darkest pixel has a brightness of 0.8" in note for note in report.notes)


def test_light_lines_on_a_dark_ground_are_reported(tmp_path: Path) -> None:
    blueprint = ImageOps.invert(draw_flat())
    ImageDraw.Draw(blueprint).line((100, 41, 100, 79), fill="white", width=3)
    _, report, _ = import_picture(tmp_path, blueprint)
    assert any("use --invert if they are the walls" in note for note in report.notes)
    # Rooms surrounded by dark rock are not lines.
    rooms = Image.new("L", (200, 120), 0)
    ImageDraw.Draw(rooms).rectangle((20, 20, 59, 59), fill=255)
    _, report, _ = import_picture(tmp_path, rooms)
    assert not any("--invert" in note for note in report.notes)


def test_a_thin_frame_at_the_edge_is_dropped(tmp_path: Path) -> None:
    picture = draw_flat()
    ImageDraw.Draw(picture).rectangle((0, 0, 199, 119), outline="black")
    assert import_picture(tmp_path, picture)[0] > 200.0
    area, report, _ = import_picture(tmp_path, picture, min_stroke="2px")
    assert area == pytest.approx(7.4 * 3.4 - 0.2 * 2.2, abs=0.1)
    assert any("paper around a plan" in note for note in report.notes)
