"""Drawings by their colors: free, solid and ignored paint, floors, nesting, thin strokes, widths."""

from pathlib import Path

import pytest
import shapely
from vector_files import build_svg, read

from robocov.errors import ParameterError
from robocov_app.formats import ForeignMap, import_map

PAGE = 'width="10000mm" height="6000mm" viewBox="0 0 10 6"'
FLOOR = '<rect width="10" height="6" fill="#c8c8c8"/>'
WALLS = '<path d="M0 0H10V6H0Z M5 0V4" fill="none" stroke="#000" stroke-width="0.2"/>'
ROOM = 9.8 * 5.8 - 0.2 * 3.9  # m² free within the walls


def read_shapes(folder: Path, body: str, **options: object) -> ForeignMap:
    return read(folder, "svg", build_svg(body, PAGE), **options)


def read_free_space(folder: Path, body: str, **options: object) -> float:
    return read_shapes(folder, body, **options).free.area


def test_paint_that_is_declared_free_is_not_an_obstacle(tmp_path: Path) -> None:
    rug = FLOOR + WALLS + '<rect x="1" y="1" width="3" height="2" fill="#e0e0ff"/>'
    foreign = read_shapes(tmp_path, rug)
    assert foreign.free.area == pytest.approx(ROOM - 6)
    assert "pale paint treated as solid: #e0e0ff (1) (--free-color: as free space)" in foreign.notes
    chosen = read_shapes(tmp_path, rug, free_color=("#e0e0ff",))
    assert chosen.free.area == pytest.approx(ROOM)
    assert "painted as free: #e0e0ff (1) (--free-color)" in chosen.notes
    assert read_free_space(tmp_path, rug, free_color=("#e6e6fa",), color_tolerance=6.0) == pytest.approx(ROOM)
    ignored = read_shapes(tmp_path, rug, ignore_color=("#e0e0ff",))
    assert ignored.free.area == pytest.approx(ROOM)
    assert any("in an ignored color" in line for line in ignored.dropped)


def test_an_absent_color_is_reported_with_the_present_ones(tmp_path: Path) -> None:
    notes = read_shapes(tmp_path, FLOOR + WALLS, free_color=("red",)).notes
    assert any("nothing is painted #ff0000 (--free-color); there are #" in note for note in notes)


def test_later_paint_covers_earlier_paint(tmp_path: Path) -> None:
    door = '<rect x="4.8" y="2" width="0.4" height="1" fill="white"/>'
    assert read_free_space(tmp_path, FLOOR + WALLS + door, free_color=("white",)) == pytest.approx(ROOM + 0.2)
    below = FLOOR + door + WALLS
    assert read_free_space(tmp_path, below, free_color=("white",)) == pytest.approx(ROOM)


def test_a_free_stroke_opens_a_wall(tmp_path: Path) -> None:
    door = '<line x1="5" y1="2" x2="5" y2="3" stroke="white" stroke-width="0.4"/>'
    assert read_free_space(tmp_path, FLOOR + WALLS + door, free_color=("white",)) == pytest.approx(ROOM + 0.2)


def test_a_pale_fill_with_dark_paint_on_it_is_floor(tmp_path: Path) -> None:
    rooms = '<rect x="0" y="0" width="5" height="6" fill="#fff0d0"/>'
    table = '<circle cx="2" cy="3" r="0.5" fill="#444"/>'
    foreign = read_shapes(tmp_path, FLOOR + rooms + table + WALLS)
    assert any(note.startswith("pale fills treated as floor: #fff0d0 (1)") for note in foreign.notes)
    assert foreign.free.area == pytest.approx(ROOM - shapely.Point(0, 0).buffer(0.5).area, abs=0.01)
    # All shapes of this color are floor, and none of other colors.
    other = '<rect x="6" y="1" width="1" height="1" fill="#fff0d0"/>'
    same = read_free_space(tmp_path, FLOOR + rooms + table + WALLS + other)
    assert same == pytest.approx(foreign.free.area)
    declared = read_free_space(tmp_path, FLOOR + rooms + table + WALLS, solid_color=("#fff0d0",))
    assert declared == pytest.approx(4.9 * 5.8 - 0.1 * 3.9)


def test_a_stroke_around_floor_is_a_wall(tmp_path: Path) -> None:
    room = '<rect x="1" y="1" width="4" height="4" fill="white" stroke="#000" stroke-width="0.2"/>'
    foreign = read_shapes(tmp_path, FLOOR + WALLS.replace("M5 0V4", "") + room, free_color=("white",))
    assert foreign.free.area == pytest.approx(9.8 * 5.8 - (4.2**2 - 3.8**2))


def test_rooms_on_a_dark_ground_are_free(tmp_path: Path) -> None:
    ground = '<rect width="10" height="6" fill="#333"/>'
    rooms = "".join(f'<rect x="{x}" y="1" width="3" height="4" fill="#eee"/>' for x in (1, 6))
    door = '<rect x="4" y="2" width="2" height="1" fill="#fff"/>'
    foreign = read_shapes(tmp_path, ground + rooms + door)
    assert foreign.free.area == pytest.approx(26)
    assert any(
        "#eeeeee (2), #ffffff (1), because they are on a dark background" in note for note in foreign.notes
    )
    # Without pale fills, a dark outline is a boundary like any other.
    assert read_free_space(
        tmp_path, ground + '<rect x="1" y="1" width="3" height="3" fill="#777"/>'
    ) == pytest.approx(51)


def test_only_free_paint_is_free_without_a_boundary(tmp_path: Path) -> None:
    rooms = "".join(f'<rect x="{x}" y="1" width="3" height="4" fill="#eef"/>' for x in (1, 4))
    assert read_free_space(tmp_path, rooms, free_color=("#eef",)) == pytest.approx(24)


def test_nested_outlines_alternate_between_free_and_solid(tmp_path: Path) -> None:
    boxes = "".join(
        f'<rect x="{k}" y="{k}" width="{10 - 2 * k}" height="{6 - 2 * k}" fill="#555"/>' for k in range(3)
    )
    foreign = read_shapes(tmp_path, boxes, outlines="nested")
    assert foreign.free.area == pytest.approx(60 - 32 + 12)
    assert any("an odd number of outlines are free, 40 m²" in note for note in foreign.notes)
    # With double lines, the walls between them are the smaller area.
    double = '<rect width="10" height="6"/>' + "".join(
        f'<rect x="{x}" y="0.2" width="4.7" height="5.6"/>' for x in (0.2, 5.1)
    )
    walls = read_shapes(tmp_path, double, outlines="nested")
    assert walls.free.area == pytest.approx(2 * 4.7 * 5.6)
    assert any("an even number of outlines are free" in note for note in walls.notes)


def test_nested_outlines_within_a_named_boundary_begin_solid(tmp_path: Path) -> None:
    body = (
        '<rect id="boundary" width="10" height="6"/><rect x="1" y="1" width="7" height="4"/>'
        '<rect x="2" y="2" width="1" height="1"/>'
    )
    assert read_free_space(tmp_path, body, outlines="nested") == pytest.approx(60 - 28 + 1)


def test_a_white_page_around_a_plan_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "plan.svg"
    walls = '<path d="M2 1H8V5H2Z" fill="none" stroke="#000" stroke-width="0.2"/>'
    path.write_text(build_svg('<rect width="10" height="6" fill="#fff"/>' + walls, PAGE))
    environment, report, _ = import_map(path)
    assert environment.free_area == pytest.approx(5.8 * 3.8)
    assert any("paper around a plan" in note for note in report.notes)
    # With a stroke, it is an arena with a box in it.
    path.write_text(
        build_svg('<rect width="10" height="6" fill="#fff" stroke="#000" stroke-width=".1"/>' + walls, PAGE)
    )
    assert import_map(path)[0].free_area > 30


def test_thin_strokes_and_shapes_are_dropped(tmp_path: Path) -> None:
    thin = (
        '<path d="M1 1L3 3" fill="none" stroke="#000" stroke-width="0.02"/>'
        '<rect x="6" y="1" width="0.03" height="3"/>'
    )
    body = FLOOR + WALLS + thin
    assert read_free_space(tmp_path, body) < ROOM - 0.1
    foreign = read_shapes(tmp_path, body, min_stroke="0.05")
    assert foreign.free.area == pytest.approx(ROOM)
    assert foreign.dropped == (
        "1 shape thinner than 0.05 m (--min-stroke)",
        "1 stroke thinner than 0.05 m (--min-stroke)",
    )
    # A pixel is a unit of the page: 1/96 of an inch.
    assert read_free_space(tmp_path, body, min_stroke=f"{0.05 / 0.0254 * 96:.0f}px") == pytest.approx(ROOM)


@pytest.mark.parametrize(
    ("transform", "d", "width"),
    [
        ("scale(2 1)", "M1 1V5", "0.4"),
        ("scale(2 1)", "M1 1H3", "0.2"),
        ("scale(2 1)", "M1 1V5H3", "0.2 to 0.4"),
        ("scale(3)", "M1 1V2", "0.6"),
        ("skewX(45)", "M0 1V3", "0.141"),
        ("rotate(30) scale(1 2)", "M1 1H2", "0.4"),
    ],
)
def test_the_width_of_a_stretched_stroke_is_that_across_it(
    tmp_path: Path, transform: str, d: str, width: str
) -> None:
    path = f'<path d="{d}" fill="none" stroke="#000" stroke-width="0.2" transform="{transform}"/>'
    notes = read_shapes(tmp_path, '<rect id="boundary" x="-20" y="-20" width="50" height="50"/>' + path).notes
    assert f"1 line treated as a wall, {width} m wide (--thickness)" in notes


@pytest.mark.parametrize(
    ("paint", "color"),
    [
        ('fill="#bcd"', "#bbccdd"),
        ('style="fill:rgb(187, 204, 221)"', "#bbccdd"),
        ('style="fill:rgb(187 204 221 / 100%)"', "#bbccdd"),
        ('style="fill:RGBA(0,0,0,.2)"', "#cccccc"),
        ('fill="black" fill-opacity="20%"', "#cccccc"),
        ('fill="black" opacity="0.2"', "#cccccc"),
        ('class="room"', "#ffeedd"),
        ('color="#ffeedd" fill="currentColor"', "#ffeedd"),
        ('fill="url(#shade)"', "#eeeeee"),
        ('fill="url(#second)"', "#eeeeee"),
        ('fill="url(#gone) #eee"', "#eeeeee"),
        ('fill="lavender"', "#e6e6fa"),
    ],
)
def test_colors_are_read_as_they_are_seen(tmp_path: Path, paint: str, color: str) -> None:
    head = (
        "<style>.room { fill: #fed }</style><defs><linearGradient id='shade'>"
        "<stop style='stop-color:#eee'/><stop stop-color='#111'/></linearGradient>"
        "<linearGradient id='second' href='#shade'/></defs>"
    )
    shape = f'<g><rect x="1" y="1" width="3" height="2" {paint}/></g>'
    foreign = read_shapes(tmp_path, head + FLOOR + WALLS + shape)
    assert f"pale paint treated as solid: {color} (1) (--free-color: as free space)" in foreign.notes


@pytest.mark.parametrize("paint", ['fill="rgba(0,0,0,0)"', 'fill="#0000"', 'fill="transparent"'])
def test_transparent_shapes_are_omitted(tmp_path: Path, paint: str) -> None:
    shape = f'<rect x="1" y="1" width="3" height="2" {paint}/>'
    assert read_free_space(tmp_path, FLOOR + WALLS + shape) == pytest.approx(ROOM)


def test_layers_can_be_omitted_by_name(tmp_path: Path) -> None:
    layers = (
        '<g xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" inkscape:groupmode="layer" '
        'inkscape:label="Furniture"><rect x="1" y="1" width="1" height="1"/></g>'
        '<g id="text"><rect x="3" y="1" width="1" height="1"/></g>'
    )
    assert read_free_space(tmp_path, FLOOR + WALLS + layers) == pytest.approx(ROOM - 2)
    assert read_free_space(tmp_path, FLOOR + WALLS + layers, skip=("furniture", "text")) == pytest.approx(
        ROOM
    )
    with pytest.raises(ParameterError, match=r"skip: .*[Ff]urnitur"):
        read_shapes(tmp_path, FLOOR + WALLS + layers, skip=("Furnitur",))
