"""SVG drawings: positions, areas and walls, sizes, and rejected files."""

import math
from pathlib import Path
from typing import Any

import pytest
import shapely
from shapely import box
from shapely.geometry.base import BaseGeometry
from vector_files import build_svg, read

from robocov.environment import CircleObstacle
from robocov.errors import MapError, RobocovError
from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions, detect_format
from robocov_app.formats.files.xml_tree import MAX_ELEMENTS, MAX_NESTING

PAGE = '<rect width="1000" height="600" fill="white"/>'
BLOCK = box(1, 4, 3, 5)
WALL = box(1, 4.9, 3, 5.1)
XLINK = 'xmlns:xlink="http://www.w3.org/1999/xlink"'


def read_shapes(
    folder: Path, body: str, head: str = 'width="1000" height="600"', **options: Any
) -> ForeignMap:
    """Read a drawing in which a unit is a centimeter."""
    return read(folder, "svg", build_svg(body, head), **{"scale": 0.01, **options})


def read_solid_area(folder: Path, body: str, **options: Any) -> BaseGeometry:
    """Return the area of a page of 10 x 6 m, y up, that is not free."""
    return box(0, 0, 10, 6) - read_shapes(folder, PAGE + body, **options).free


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<rect x="100" y="100" width="200" height="100"/>', BLOCK),
        ('<polygon points="100,100 300,100 300,200 100,200"/>', BLOCK),
        ('<polyline points="100,100 300,100 300,200 100,200"/>', BLOCK),
        ('<path d="M100 100h200v100h-200"/>', BLOCK),
        ('<g transform="translate(100 100)"><rect width="200" height="100"/></g>', BLOCK),
        ('<rect width="20" height="10" transform="translate(100 100) scale(10)"/>', BLOCK),
        ('<rect x="10%" y="50%" width="20%" height="10%"/>', box(1, 2.4, 3, 3)),
        ('<rect width="1in" height="25.4mm"/>', box(0, 6 - 0.96, 0.96, 6)),
        ('<line x1="100" y1="100" x2="300" y2="100" stroke="red" stroke-width="20"/>', WALL),
        ('<path d="M100 100H300" stroke="red" stroke-width="20"/>', WALL),
        (
            '<g stroke="red" stroke-width="20" stroke-linecap="square"><path d="M100 100h200"/></g>',
            box(0.9, 4.9, 3.1, 5.1),
        ),
        (
            '<rect x="110" y="110" width="180" height="80" fill="none" stroke="red" stroke-width="20"/>',
            BLOCK - box(1.2, 4.2, 2.8, 4.8),
        ),
        ('<g fill="none" stroke="red"><g stroke-width="20"><path d="M100 100H300"/></g></g>', WALL),
        (
            '<style>.w{fill:none;stroke:#000;stroke-width:20px}</style><path class="w" d="M100 100H300"/>',
            WALL,
        ),
        ('<path d="M100 100h200v100h-200zM150 125v50h100v-50z"/>', BLOCK - box(1.5, 4.25, 2.5, 4.75)),
        ('<path d="M100 100h200v100h-200zM150 125h100v50h-100z"/>', BLOCK),
        (
            '<path fill-rule="evenodd" d="M100 100h200v100h-200zM150 125h100v50h-100z"/>',
            BLOCK - box(1.5, 4.25, 2.5, 4.75),
        ),
        ('<defs><rect id="a" width="200" height="100"/></defs><use href="#a" x="100" y="100"/>', BLOCK),
        (
            f'<defs><g id="a"><rect width="2" height="1"/></g></defs><use {XLINK} xlink:href="#a" '
            'transform="translate(100 100) scale(100)"/>',
            BLOCK,
        ),
        (
            '<symbol id="a" viewBox="0 0 4 2"><rect width="4" height="2"/></symbol>'
            '<use href="#a" x="100" y="100" width="200" height="100"/>',
            BLOCK,
        ),
        (
            '<svg x="100" y="100" width="200" height="100" viewBox="0 0 4 2"><path d="M0 0h4v2H0"/></svg>',
            BLOCK,
        ),
        (
            '<svg x="100" y="100" width="200" height="200" viewBox="0 0 4 2"><path d="M0 0h4v2H0"/></svg>',
            box(1, 3.5, 3, 4.5),
        ),
        ('<svg x="100" y="100" width="200" height="100"><rect width="100%" height="100%"/></svg>', BLOCK),
        ('<switch><foreignObject/><g><rect x="100" y="100" width="200" height="100"/></g></switch>', BLOCK),
    ],
)
def test_shapes_are_where_they_are_drawn(tmp_path: Path, body: str, expected: Any) -> None:
    assert read_solid_area(tmp_path, body).symmetric_difference(expected).area < 1e-6


def test_circles_and_ellipses_are_read(tmp_path: Path) -> None:
    pillar = read_solid_area(tmp_path, '<circle cx="500" cy="300" r="50"/>')
    exact = CircleObstacle((5.0, 3.0), 0.5).polygon
    assert pillar.symmetric_difference(exact).area < 1e-5
    oval = read_solid_area(tmp_path, '<ellipse cx="500" cy="300" rx="200" ry="50"/>')
    assert oval.area == pytest.approx(math.pi * 2 * 0.5, abs=oval.length * 1e-3)
    assert oval.bounds == pytest.approx((3, 2.5, 7, 3.5), abs=1e-3)
    # A radius that is missing or "auto" equals the other one.
    for radii in ('rx="50"', 'rx="auto" ry="50"', 'rx="50" ry="auto"'):
        circle = read_solid_area(tmp_path, f'<ellipse cx="500" cy="300" {radii}/>')
        assert circle.symmetric_difference(exact).area < circle.length * 1e-3
    same = read_solid_area(tmp_path, '<circle cx="125" cy="300" r="50" transform="scale(4 1)"/>')
    assert same.symmetric_difference(oval).area < oval.length * 1e-3
    rounded = read_solid_area(tmp_path, '<rect x="100" y="100" width="200" height="100" rx="20"/>')
    assert rounded.area == pytest.approx(2 - (4 - math.pi) * 0.04, abs=1e-3)
    # Radii are at most half a side, and a single radius is used for both axes.
    pill = read_solid_area(tmp_path, '<rect x="100" y="100" width="200" height="100" ry="900"/>')
    assert pill.bounds == pytest.approx((1, 4, 3, 5))
    assert pill.area == pytest.approx(math.pi * 0.5, abs=pill.length * 1e-3)


@pytest.mark.parametrize(
    ("body", "dropped"),
    [
        ('<g display="none"><rect width="9" height="9"/></g>', "1 hidden element"),
        ('<rect width="9" height="9" style="display:none"/>', "1 hidden element"),
        ('<g visibility="hidden"><rect width="9" height="9"/></g>', "1 hidden element"),
        ('<rect width="9" height="9" opacity="0"/>', "1 hidden element"),
        ('<rect width="9" height="9" fill="none"/>', "1 hidden element"),
        ("<text>Kitchen</text>", "1 text"),
        ('<image href="photo.png"/>', "1 image"),
        ('<path d="M0 0L9 9"/>', "1 shape without an area"),
        ('<rect width="0" height="9"/>', "1 shape without an area"),
        ('<line x2="9" stroke="red" stroke-width="0"/>', "1 stroke without a width"),
        ('<use href="other.svg#a"/>', "1 use of an element that is not in the file"),
    ],
)
def test_omitted_elements_are_counted(tmp_path: Path, body: str, dropped: str) -> None:
    foreign = read_shapes(tmp_path, PAGE + body)
    assert foreign.free.equals(box(0, 0, 10, 6))
    assert foreign.dropped == (dropped,)


@pytest.mark.parametrize(
    "body",
    [
        '<defs><rect width="9" height="9"/></defs>',
        '<clipPath><rect width="9" height="9"/></clipPath><mask><rect width="9" height="9"/></mask>',
        '<pattern><rect width="9" height="9"/></pattern><marker><path d="M0 0h9v9z"/></marker>',
        '<x:view xmlns:x="http://sodipodi.sourceforge.net/"><path d="M0 0h9v9z"/></x:view>',
        '<symbol id="a"><rect width="9" height="9"/></symbol>',
        "<title>Plan</title><metadata/><script>alert(1)</script>",
    ],
)
def test_elements_that_are_never_drawn_are_not_counted(tmp_path: Path, body: str) -> None:
    foreign = read_shapes(tmp_path, PAGE + body)
    assert foreign.free.equals(box(0, 0, 10, 6))
    assert foreign.dropped == ()


def test_approximations_are_noted(tmp_path: Path) -> None:
    body = (
        '<g fill="none" stroke="red"><path d="M100 100h50" stroke-dasharray="4"/><path d="M100 200h50" '
        'transform="scale(1 3)"/></g><g clip-path="url(#a)"><rect width="9" height="9"/></g>'
        "<style>g > rect{fill:none}</style>"
    )
    notes = read_shapes(tmp_path, PAGE + body).notes
    for words in (
        "a unit is 0.01 m",
        "curves flattened to within 1 mm",
        "1 dashed strokes treated as continuous lines",
        "1 clip paths and masks not applied",
        "1 style rules of other kinds than tag, .class and #id not applied",
    ):
        assert words in notes


def test_strokes_become_walls_of_their_width(tmp_path: Path) -> None:
    line = '<path d="M0 300H1000" fill="none" stroke="red" stroke-width="5" transform="scale(1 2)"/>'
    lower = line.replace("M0 300", "M0 150")
    assert read_shapes(tmp_path, PAGE + lower).free.area == pytest.approx(60 - 10 * 0.1)
    upright = '<path d="M300 0V300" fill="none" stroke="red" stroke-width="5" transform="scale(1 2)"/>'
    assert read_shapes(tmp_path, PAGE + upright).free.area == pytest.approx(60 - 6 * 0.05)
    assert read_shapes(tmp_path, PAGE + lower, thickness=0.3).free.area == pytest.approx(60 - 3)
    plain = line.replace("scale(1 2)", "scale(2)").replace("M0 300H1000", "M0 150H500")
    assert read_shapes(tmp_path, PAGE + plain).free.area == pytest.approx(60 - 1)
    percent = '<line x2="1000" y1="300" y2="300" stroke="red" stroke-width="1%"/>'
    width = math.hypot(10, 6) / math.sqrt(2) / 100
    assert read_shapes(tmp_path, PAGE + percent).free.area == pytest.approx(60 - 10 * width)


def test_labels_include_those_of_all_groups(tmp_path: Path) -> None:
    body = (
        '<g id="layer1" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" inkscape:label="Walls">'
        '<rect class="load-bearing brick" width="100" height="100"/></g>'
        '<g class="furniture"><rect id="desk" x="500" width="200" height="100"/></g>'
    )
    for name in ("layer1", "walls", "Load-Bearing", "brick"):
        assert read_shapes(tmp_path, PAGE + body, skip=(name,)).free.area == pytest.approx(60 - 2)
    assert read_shapes(tmp_path, PAGE + body, skip=("furniture", "layer1")).free.area == pytest.approx(60)
    assert read_shapes(tmp_path, PAGE + body, boundary="desk").free.area == pytest.approx(2)
    with pytest.raises(RobocovError, match="skip: unknown name 'wals': did you mean 'Walls'"):
        read_shapes(tmp_path, PAGE + body, skip=("wals",))


def test_rooms_can_be_free(tmp_path: Path) -> None:
    rooms = '<rect width="300" height="300"/><rect x="300" y="100" width="200" height="100"/>'
    assert read_shapes(tmp_path, rooms, outlines="free").free.area == pytest.approx(9 + 2)
    assert read_shapes(tmp_path, rooms).free.area == pytest.approx(7 * 5 - 11)


@pytest.mark.parametrize(
    ("head", "options", "size"),
    [
        ('width="10000mm" height="6000mm" viewBox="0 0 1000 600"', {"scale": None}, (10, 6)),
        ('width="1000cm" height="600cm" viewBox="5 7 1000 600"', {"scale": None}, (10, 6)),
        ('width="37795.2756" height="22677.1654" viewBox="0 0 1000 600"', {"scale": None}, (10, 6)),
        ('width="100mm" height="60mm" viewBox="0 0 1000 600"', {"scale": 0.02}, (20, 12)),
        ('viewBox="0 0 1000 600"', {"scale": 0.01}, (10, 6)),
        ('width="100%" height="100%" viewBox="0 0 1000 600"', {"scale": 0.01}, (10, 6)),
        ('width="1000" height="600"', {"scale": 0.01}, (10, 6)),
        ("", {"scale": 0.01}, (10, 6)),
    ],
)
def test_units_give_the_scale(
    tmp_path: Path, head: str, options: dict[str, Any], size: tuple[float, float]
) -> None:
    corner = 'x="5" y="7"' if "5 7" in head else ""
    free = read_shapes(tmp_path, f'<rect {corner} width="1000" height="600"/>', head, **options).free
    x, y, right, top = free.bounds
    assert (right - x, top - y) == pytest.approx(size, rel=1e-6)
    if head:
        assert (x, y) == pytest.approx((0, 0), abs=1e-6), "the lower left corner of the picture"


def test_an_origin_in_the_file_is_used(tmp_path: Path) -> None:
    foreign = read_shapes(tmp_path, PAGE, 'width="1000" height="600" data-origin="-3 2.5"')
    assert foreign.free.bounds == pytest.approx((-3, 2.5, 7, 8.5))


def test_a_plan_as_small_as_its_paper_needs_a_scale(tmp_path: Path) -> None:
    expected = "expected at least 1 m, got 0.265 x 0.159 m at its own scale: --scale METERS"
    with pytest.raises(MapError, match=expected):
        read_shapes(tmp_path, PAGE, scale=None)


def test_the_title_names_the_map(tmp_path: Path) -> None:
    foreign = read_shapes(tmp_path, f"<title>Ground\n floor</title><desc>With stairs.</desc>{PAGE}")
    assert (foreign.name, foreign.description, foreign.format) == ("Ground floor", "With stairs.", "svg")
    assert read_shapes(tmp_path, PAGE).name == "plan"


def test_prologues_of_editors_are_accepted(tmp_path: Path) -> None:
    text = build_svg(PAGE).replace('xmlns="http://www.w3.org/2000/svg"', "")
    for content in (
        b"\xef\xbb\xbf<?xml version='1.0'?>\r\n<!-- Created with Inkscape -->\r\n" + text.encode(),
        f"<?xml version='1.0' encoding='UTF-16'?>{text}".encode("utf-16"),
        f"<?xml version='1.0' encoding='ISO-8859-1'?><!-- Küche -->{text}".encode("latin-1"),
    ):
        path = tmp_path / "plan.svg"
        path.write_bytes(content)
        assert IMPORTERS["svg"].read(path, ReadOptions(scale=0.01)).free.area == pytest.approx(60)
        assert detect_format(path).name == "svg"


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<path id="p" d="M0 0 L 10"/>', ":1: <path> 'p': character 10: expected a number"),
        ('\n<rect width="10em"/>', ":2: <rect>: expected a length in px"),
        ('<rect width="9" height="9" transform="spin(1)"/>', "<rect>: expected a transform"),
        ('<polygon points="1 2 x"/>', "<polygon>: expected a number"),
        ('<circle cx="1e300" r="5"/>', "<circle>: expected a number up to 1e+30"),
        ('<circle cx="1e20" r="5"/>', "line 1: expected coordinates"),
        ('<circle r="1e20"/>', "line 1: expected coordinates"),
        ('<ellipse rx="1e20" ry="1e20"/>', "<ellipse>: expected at most 250000 points, got more"),
        ('<path d="M0 0 A 1e20 1e20 0 1 1 5 5"/>', "<path>: expected at most 500000 points, got more"),
        ('<path d="M0 0 C 1e10 0 0 1e10 5 5"/>', "got a point at"),
        (
            '<g transform="scale(1e20)"><g transform="scale(1e20)"/></g>',
            "<g>: a transform to coordinates beyond 1e+30",
        ),
        ('<svg viewBox="0 0 1"/>', "<svg>: expected four numbers"),
        ("", "expected at least one closed outline or line, got none"),
        ("<g><text>Hall</text></g>", "or line, got none (1 text left out)"),
    ],
)
def test_invalid_drawings_are_rejected(tmp_path: Path, body: str, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        read_shapes(tmp_path, body)
    assert str(caught.value).startswith(str(tmp_path / "plan.svg"))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


PUBLIC = 'PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd"'


@pytest.mark.parametrize(
    "inside",
    [
        "",
        ' [<!ENTITY ns_svg "http://www.w3.org/2000/svg"> <!ENTITY ns_ai "http://ns.adobe.com/AdobeIllustrator/10.0/">]',
        ' [<!ATTLIST svg xmlns:xlink CDATA #FIXED "http://www.w3.org/1999/xlink">]',
    ],
    ids=["public", "entities", "attributes"],
)
def test_document_types_that_drawing_programs_write(tmp_path: Path, inside: str) -> None:
    name = "&ns_svg;" if "ns_svg" in inside else "http://www.w3.org/2000/svg"
    text = f'<?xml version="1.0"?>\n<!DOCTYPE svg {PUBLIC}{inside}>\n'
    text += f'<svg xmlns="{name}" width="1000" height="600">{PAGE}<rect width="200" height="100"/></svg>'
    assert read(tmp_path, "svg", text, scale=0.01).free.area == pytest.approx(60 - 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "not XML: no element found"),
        (b"<svg><g></svg>", ":1: not XML: mismatched tag"),
        (b"<svg><g xlink:href='#a'/></svg>", ":1: not XML: unbound prefix"),
        (b"<html><svg/></html>", ": expected <svg>, got <html>"),
        (b"<x:y xmlns:x='urn:z'/>", ": expected <svg>, got other XML"),
        (b"\x1f\x8b\x08", ": expected plain SVG, got a gzip-compressed file"),
        (
            b"<!DOCTYPE svg [\n<!ENTITY a SYSTEM 'file:///etc/passwd'>]><svg>&a;</svg>",
            ":2: expected plain SVG, got an entity 'a' that refers to another file ('file:///etc/passwd')",
        ),
        (b"<!DOCTYPE svg [<!ENTITY % a SYSTEM 'b'> %a;]><svg/>", "entity 'a' that refers to another file"),
        (b"<!DOCTYPE svg [<!ENTITY % a 'b'>]><svg/>", "entity 'a' that refers to other entities"),
        (
            b"<!DOCTYPE svg [<!ENTITY a 'b'><!ENTITY c '&a;'>]><svg/>",
            "entity 'c' that refers to other entities",
        ),
        (
            b"<!DOCTYPE svg [<!ENTITY a '" + b"b" * 900 + b"'>]><svg a='" + b"&a;" * 2000 + b"'/>",
            "entity 'a' that expands to too much text",
        ),
        (
            b"<!DOCTYPE svg [<!ATTLIST g a CDATA '" + b"b" * 9000 + b"'>]><svg>" + b"<g/>" * 900 + b"</svg>",
            "entities that expand to too much text",
        ),
        (b"<!DOCTYPE svg [<!ATTLIST g" + b" a CDATA ''" * 1001 + b">]><svg/>", "more than 1000 declarations"),
        (b"<svg xmlns='" + b"x" * 2000 + b"'/>", "a namespace of 2000 characters"),
        (b"<svg>&lol;</svg>", "not XML: undefined entity"),
        ("<!DOCTYPE svg [<!ENTITY a SYSTEM 'b'>]><svg/>".encode("utf-16"), "refers to another file"),
        (b"<?xml version='1.0' encoding='EBCDIC-CP-BE'?><svg/>", "not XML: "),
        (b"<svg width='0' height='5'/>", "<svg>: expected a size, got 0 x 5 px"),
        (b"<svg data-origin='1'/>", "<svg>: expected two numbers"),
        (b"<svg" + b" a='1'" * 1_000_001 + b"/>", "expected at most 1000000 attributes, got more"),
        (
            b"<svg>" + b"<g/>" * (MAX_ELEMENTS + 1) + b"</svg>",
            f"expected at most {MAX_ELEMENTS} elements, got more",
        ),
        (b"<g>" * 1_000_000, f"nested deeper than {MAX_NESTING}"),
    ],
    ids=lambda value: value if isinstance(value, str) else "content",
)
def test_other_xml_is_rejected(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "plan.svg"
    path.write_bytes(content)
    with pytest.raises(MapError) as caught:
        IMPORTERS["svg"].read(path, ReadOptions())
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<g id="a"><use href="#a"/></g>', "<g> 'a': uses itself"),
        ('<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>', "uses itself"),
        ('<use id="a" href="#a"/>', "<use> 'a': uses itself"),
        (
            "<defs><g id='a0'><path d='M0 0h1v1z'/></g>"
            + "".join(f"<g id='a{k + 1}'>" + f"<use href='#a{k}'/>" * 10 + "</g>" for k in range(10))
            + "</defs><use href='#a10'/>",
            f"expected at most {MAX_ELEMENTS} elements to draw, including uses, got ",
        ),
        (
            "".join(f"<g id='a{k + 1}'><use href='#a{k}'/></g>" for k in reversed(range(500))),
            f"uses are nested deeper than {MAX_NESTING}",
        ),
    ],
)
def test_uses_without_an_end_are_rejected(tmp_path: Path, body: str, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        read_shapes(tmp_path, body)
    assert expected in str(caught.value)


@pytest.mark.slow
def test_a_path_may_have_many_subpaths(tmp_path: Path) -> None:
    data = "".join(f"M{x} {y}h4v4h-4z" for x in range(10, 990, 10) for y in range(10, 590, 10))
    foreign = read_shapes(tmp_path, f'{PAGE}<path d="{data}"/>')
    assert shapely.get_num_interior_rings(foreign.free.geoms[0]) == 98 * 58
    assert foreign.free.area == pytest.approx(60 - 98 * 58 * 0.0016)
