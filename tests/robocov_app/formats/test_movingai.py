"""Grids of Moving AI: characters, line ends, and mistakes with their line and column."""

from pathlib import Path

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, import_map
from robocov_app.formats.foreign_map import ForeignMap

IMPORTER = IMPORTERS["movingai"]

ROWS = ("@@@@@@", "@..GT@", "@S.OW@", "@....@", "@@@@@@")
GRID = "type octile\nheight 5\nwidth 6\nmap\n" + "\n".join(ROWS) + "\n"


def write(folder: Path, text: str | bytes, name: str = "a.map") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def read(folder: Path, text: str | bytes, **options: object) -> ForeignMap:
    return IMPORTER.read(write(folder, text), ReadOptions(**options))  # type: ignore[arg-type]


def test_characters_have_their_meaning(tmp_path: Path) -> None:
    foreign = read(tmp_path, GRID)
    expected = shapely.box(1, 1, 5, 2) | shapely.box(1, 2, 3, 3) | shapely.box(1, 3, 4, 4)
    assert shapely.equals(foreign.free, expected)
    assert foreign.cell == 1.0
    assert foreign.notes == (
        "no cell size given; assuming 1 m. Set it with --cell.",
        "6 x 5 cells of 1 m: 30.0% free, 70.0% blocked",
    )
    assert read(tmp_path, GRID, trees="free").free.area == 10
    # The water touches free cells at two corners, at which obstacles touch too.
    assert read(tmp_path, GRID, water="free").free.area == pytest.approx(10, abs=0.002)
    assert read(tmp_path, GRID, trees="free", water="free", cell=0.5).free.area == 11 / 4
    assert read(tmp_path, GRID, trees="obstacle").free.area == 9


def test_the_format_is_detected_by_content_and_suffix(tmp_path: Path) -> None:
    assert detect_format(write(tmp_path, GRID, "grid.txt")) is IMPORTER
    assert detect_format(write(tmp_path, "nothing of the kind", "b.map")) is IMPORTER
    with pytest.raises(MapError, match=r"b\.map: line 1: expected type octile"):
        import_map(tmp_path / "b.map")


def test_variants_of_the_header_are_accepted(tmp_path: Path) -> None:
    same = read(tmp_path, GRID).free
    for text in (
        GRID.replace("\n", "\r\n"),
        "\ufeff" + GRID,
        GRID.rstrip("\n"),
        GRID + "\n\n  \n",
        GRID.replace("height 5\nwidth 6", "width 6\nheight 5"),
        GRID.replace("type octile", "type  octile  \n"),
        GRID.replace("@..GT@", "@..GT@ \t"),
        GRID.replace("octile", "tile"),
    ):
        assert shapely.equals(read(tmp_path, text).free, same)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "expected a line map after type, height and width, got none"),
        ("type octile\n", "expected a line map after type, height and width, got none"),
        ("type hex\nheight 1\nwidth 1\nmap\n.", "line 1: expected octile"),
        ("type octile\nheight 1\nmap\n.", "line 3: expected width first"),
        (
            "type octile\nheight -1\nwidth 1\nmap\n.",
            "line 2: expected type octile, height N, width N or map, got 'height -1'",
        ),
        (
            "type octile\nheight nan\nwidth 1\nmap\n.",
            "line 2: expected type octile, height N, width N or map, got 'height nan'",
        ),
        ("type octile\nheight 0\nwidth 1\nmap\n", "expected at least 1 x 1"),
        ("type octile\nheight 999999999\nwidth 999999999\nmap\n.", "at most 64 million"),
        (
            "type octile\nheight 9999999999999\nwidth 1\nmap\n.",
            "line 2: expected a smaller height, got '9999999999999'",
        ),
        ("type octile\nheight \u0665\nwidth 1\nmap\n.", "line 2: "),
        (GRID.replace("@S.OW@", "@S.XW@"), "line 7, column 4: expected one of . G S @ O T W"),
        (GRID.replace("@S.OW@", "@S.OW"), "line 7: expected 6 characters"),
        (GRID.replace("@S.OW@", "@S.OW@@"), "line 7: expected 6 characters, got 7 characters"),
        (GRID.replace("@S.OW@\n", "\n@S.OW@\n"), "line 7: expected 6 characters, got 0 characters"),
        (GRID.replace("@....@\n@@@@@@\n", ""), "line 8: expected 6 characters"),
        (GRID + "......\n", "line 10: expected 5 rows, got more"),
        (GRID.replace(".", "@").replace("G", "@").replace("S", "@"), "no cell is free"),
        ("type octile\n" * 30, "expected a line map after type, height and width, got none"),
        ("x" * 5000, "line 1: expected type octile, height N, width N or map, got"),
    ],
    ids=map(str, range(99)),
)
def test_invalid_files_are_rejected(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        read(tmp_path, text)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@settings(deadline=None, max_examples=count_examples(150))
@given(st.binary(max_size=12), st.integers(0, len(GRID)), st.integers(0, 6))
def test_a_damaged_grid_is_read_or_rejected(
    tmp_path_factory: pytest.TempPathFactory, patch: bytes, at: int, gone: int
) -> None:
    data = GRID.encode()
    try:
        foreign = read(tmp_path_factory.getbasetemp(), data[:at] + patch + data[at + gone :])
    except MapError as error:
        assert "\n" not in str(error)
        return
    assert foreign.free.area > 0
