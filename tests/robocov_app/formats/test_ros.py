"""ROS maps: meaning of pixels in each mode, position of the map, and rejected files."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from property_examples import count_examples
from raster_files import FREE, OCCUPIED, PLAN, UNKNOWN, build_pgm, draw_pixels, write_ros_map
from shapely import MultiPolygon

from robocov.errors import MapError, ParameterError
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping, detect_format, import_map
from robocov_app.formats.raster.picture import Brightness
from robocov_app.formats.raster.ros.classification import classify_raw, classify_scale, classify_trinary

IMPORTER = IMPORTERS["ros"]

ROOMS = shapely.box(2, 2, 8, 8) | shapely.box(9, 2, 14, 8) | shapely.box(8, 4, 9, 6)
"""The free space of `PLAN`, in cells."""


def read(path: Path, **options: object) -> MultiPolygon:
    return IMPORTER.read(path, ReadOptions(**options)).free  # type: ignore[arg-type]


def test_a_map_is_read_at_its_origin(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN), origin=[-1.5, 2.0, 0.0])
    assert detect_format(path) is IMPORTER
    foreign = IMPORTER.read(path, ReadOptions())
    expected = shapely.transform(ROOMS, lambda p: p * 0.25 + (-1.5, 2.0))
    assert shapely.equals(foreign.free, expected)
    assert (foreign.name, foreign.cell, foreign.vertices_read) == ("plan", 0.25, 12)
    assert foreign.notes == (
        "16 x 10 cells of 0.25 m: 42.5% free, 27.5% blocked, 30.0% unknown, treated as obstacles",
    )


def test_the_top_row_of_the_picture_is_the_highest(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels("..#\n###\n###"), resolution=1.0)
    assert shapely.equals(read(path), shapely.box(0, 2, 2, 3))


def test_yaw_turns_the_map_about_its_lower_left_corner(tmp_path: Path) -> None:
    pixels = draw_pixels("...\n.##")
    straight = read(write_ros_map(tmp_path, pixels, resolution=1.0, origin="[1, 2, 0]"))
    turned = read(
        write_ros_map(tmp_path, pixels, "turned", resolution=1.0, origin=f"[1, 2, {math.pi / 2!r}]")
    )
    expected = shapely.affinity.rotate(straight, 90, origin=(1, 2))
    assert shapely.equals_exact(turned.normalize(), expected.normalize(), 1e-9)
    slanted = write_ros_map(tmp_path, np.full((30, 40), FREE, np.uint8), "slanted", origin="[0, 0, 0.5]")
    environment, report, _ = import_map(slanted)
    assert report.vertices_kept == 4
    assert environment.free_area == pytest.approx(75, abs=0.01)
    assert (0.0, 0.0) in environment.boundary


@pytest.mark.parametrize(
    ("yaw", "notes"),
    [
        ("0", []),
        ("-0.0", []),
        ("1.5707963267948966", ["origin: rotated by 90 degrees about the lower left corner"]),
        ("-0.5", ["origin: rotated by -28.65 degrees about the lower left corner"]),
        (
            "90",
            [
                "origin: rotated by 116.6 degrees about the lower left corner, as its yaw is 90 rad; "
                "if it was meant in degrees, write 1.5708"
            ],
        ),
    ],
)
def test_a_rotated_map_has_a_note(tmp_path: Path, yaw: str, notes: list[str]) -> None:
    path = write_ros_map(tmp_path, np.full((3, 3), FREE, np.uint8), origin=f"[0, 0, {yaw}]")
    foreign = IMPORTER.read(path, ReadOptions())
    assert [note for note in foreign.notes if note.startswith("origin")] == notes


@pytest.mark.parametrize(
    ("mode", "cause"),
    [
        (
            "trinary",
            "100% of the pixels are transparent, which map_server averages in as if it were a dark color",
        ),
        ("raw", "100% of the pixels are transparent; their hidden color is used"),
    ],
)
def test_transparency_is_reported_as_the_cause(tmp_path: Path, mode: str, cause: str) -> None:
    Image.new("LA", (4, 4), (200, 0)).save(tmp_path / "plan.png")
    path = write_ros_map(tmp_path, b"", image="plan.png", mode=mode)
    with pytest.raises(MapError, match=f"no cell is free: {cause}"):
        IMPORTER.read(path, ReadOptions())


def test_a_map_of_floats_is_read_in_every_mode(tmp_path: Path) -> None:
    values = np.array([[1.0, 1.0, 0.0], [1.0, np.nan, 0.5]], dtype=np.float32)
    Image.fromarray(values).save(tmp_path / "plan.tif")
    path = write_ros_map(tmp_path, b"", image="plan.tif", resolution=1.0)
    assert read(path).area == 3


def test_unknown_cells_follow_the_option(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN), resolution=1.0)
    # `PLAN` has 68 free cells and 48 unknown ones.
    assert read(path).area == 68
    assert read(path, unknown="free").area == 68 + 48
    foreign = IMPORTER.read(path, ReadOptions(unknown="cut"))
    assert shapely.equals(foreign.free, ROOMS)
    assert foreign.boundary is not None
    # The known region of 14 x 8 cells gets a solid rim of two cells.
    assert shapely.equals(foreign.boundary, shapely.box(-1, -1, 17, 11))


def test_a_cut_map_keeps_the_island_with_most_free_space(tmp_path: Path) -> None:
    pixels = draw_pixels("...????\n...????\n???????\n?????..")
    foreign = IMPORTER.read(write_ros_map(tmp_path, pixels, resolution=1.0), ReadOptions(unknown="cut"))
    assert shapely.equals(foreign.free, shapely.box(0, 2, 3, 4))
    assert foreign.dropped == ("2 m² of free space on other islands of known cells",)


def compute_occupancy(level: int, mode: str, negate: bool, low: float, high: float, alpha: int) -> int:
    """Return the occupancy of a gray pixel, -1 to 100, by the documented rules of map_server."""
    if mode == "raw":
        return level if level <= 100 else -1
    x = (3 * level + alpha) / 4 if mode == "trinary" and alpha >= 0 else level
    p = x / 255 if negate else (255 - x) / 255
    if mode == "scale" and 0 <= alpha < 255:
        return -1
    if p > high:
        return 100
    if p < low:
        return 0
    return -1 if mode == "trinary" else round(100 * (p - low) / (high - low))


@settings(deadline=None, max_examples=count_examples(100))
@given(
    st.sampled_from(["trinary", "scale", "raw"]), st.booleans(), st.booleans(),
    st.floats(0, 1), st.floats(0, 1), st.integers(0, 255),
)  # fmt: skip
def test_every_pixel_agrees_with_map_server(
    mode: str, negate: bool, with_alpha: bool, one: float, other: float, opacity: int
) -> None:
    low, high = sorted((one, other))
    if high - low < 1e-6:
        high = low + 1e-6
    level = np.arange(256, dtype=np.uint8)[None]
    alpha = np.full((1, 256), opacity, np.uint8) if with_alpha else None
    picture = Brightness(level, 255, alpha)
    if mode == "trinary":
        cells = classify_trinary(picture, negate=negate, free=low, occupied=high)
    elif mode == "scale":
        cells = classify_scale(picture, negate=negate, free=low, occupied=high, threshold=0.5)
    else:
        cells = classify_raw(picture, 0.5)
    for value in range(256):
        expected = compute_occupancy(value, mode, negate, low, high, opacity if with_alpha else -1)
        kind = 2 if expected < 0 else int(expected >= 50)
        near = mode != "raw" and any(
            abs(x - t) < 1e-9 for x in ((255 - value) / 255, value / 255) for t in (low, high)
        )
        assert near or cells[0, value] == kind, (value, expected)


def test_colors_count_as_their_mean(tmp_path: Path) -> None:
    colors = np.zeros((4, 4, 3), dtype=np.uint8)
    colors[:, :2] = (255, 255, 200)  # mean 237: dark by 0.07
    colors[:, 2] = (255, 0, 0)  # dark by 0.67
    colors[:, 3] = (255, 100, 100)  # dark by 0.4: unknown
    Image.fromarray(colors).save(tmp_path / "plan.png")
    path = write_ros_map(tmp_path, b"", image="plan.png", resolution=1.0)
    assert shapely.equals(read(path), shapely.box(0, 0, 2, 4))
    assert shapely.equals(read(path, unknown="free"), shapely.box(0, 0, 2, 4) | shapely.box(3, 0, 4, 4))


def test_scale_and_raw_use_the_threshold(tmp_path: Path) -> None:
    levels = np.array([[0, 30, 49, 50, 100, 101, 255]], dtype=np.uint8)
    path = write_ros_map(tmp_path, levels, mode="raw", resolution=1.0)
    assert shapely.equals(read(path), shapely.box(0, 0, 3, 1))
    assert shapely.equals(read(path, threshold=0.2), shapely.box(0, 0, 1, 1))
    assert shapely.equals(read(path, threshold=1.0), shapely.box(0, 0, 4, 1))
    assert shapely.equals(
        read(path, unknown="free", threshold=0.5), shapely.box(0, 0, 3, 1) | shapely.box(5, 0, 7, 1)
    )
    # Cells that are certainly free are free with any threshold.
    assert shapely.equals(read(path, threshold=0.0), shapely.box(0, 0, 1, 1))


def test_pictures_of_16_bits_are_read(tmp_path: Path) -> None:
    deep = np.array([[65535, 65535, 52685, 0]])
    path = write_ros_map(tmp_path, build_pgm(deep, 65535), resolution=1.0)
    assert shapely.equals(read(path), shapely.box(0, 0, 2, 1))
    assert "25.0% unknown" in IMPORTER.read(path, ReadOptions()).notes[-1]


def test_remarkable_metadata_has_notes(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN), free_thresh=0.25, occupied_thresh=None, frame="map")
    environment, report, _ = import_map(path, shaping=Shaping(radius=0.1))
    assert report.repaired == ("occupied_thresh is missing, 0.65 used",)
    assert report.notes[0] == "frame: unknown key, ignored"
    assert report.notes[1] == (
        "48 cells have the value 205, which is saved for unknown cells, and are free "
        "according to free_thresh 0.25"
    )
    assert environment.free_area > 0


def test_single_cells_are_noise_by_default(tmp_path: Path) -> None:
    pixels = np.full((60, 60), FREE, np.uint8)
    pixels[10, 10] = OCCUPIED
    pixels[20, 30] = UNKNOWN
    pixels[40, 40:42] = OCCUPIED
    path = write_ros_map(tmp_path, pixels, resolution=0.05)
    environment, report, _ = import_map(path)
    assert len(environment.obstacles) == 1
    assert report.dropped == (
        "2 obstacles smaller than 0.00375 m², 0.005 m² in total (--specks 0 keeps them)",
    )
    assert len(import_map(path, shaping=Shaping(specks=0.0))[0].obstacles) == 3
    assert len(import_map(path, shaping=Shaping(specks=0.01))[0].obstacles) == 0


def test_line_ends_byte_order_marks_and_comments_are_accepted(tmp_path: Path) -> None:
    (tmp_path / "plan.pgm").write_bytes(
        build_pgm(draw_pixels(PLAN), head="# CREATOR: map_saver.cpp 0.250 m/pix\n")
    )
    text = (
        "# saved\r\nimage: plan.pgm\r\nresolution: 2.5e-1\r\norigin: [-1.0, -2.0, 0.0]\r\nnegate: 0\r\n\r\n"
        "occupied_thresh: 0.65\r\nfree_thresh: 0.196\r\n"
    )
    path = tmp_path / "crlf.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read(path).bounds == (-0.5, -1.5, 2.5, 0.0)


def test_the_picture_must_be_next_to_the_file(tmp_path: Path) -> None:
    maps = tmp_path / "maps"
    (maps / "pictures").mkdir(parents=True)
    (maps / "pictures" / "a.pgm").write_bytes(build_pgm(draw_pixels(PLAN)))
    (tmp_path / "secret.pgm").write_bytes(build_pgm(draw_pixels(PLAN)))
    assert read(write_ros_map(maps, b"", image="pictures/a.pgm")).area > 0
    assert read(write_ros_map(maps, b"", image="./pictures/../pictures/a.pgm")).area > 0
    (maps / "link.pgm").symlink_to(tmp_path / "secret.pgm")
    (maps / "away").symlink_to(tmp_path)
    (maps / "secret.pgm").symlink_to(tmp_path / "secret.pgm")
    for image in ("../secret.pgm", str(tmp_path / "secret.pgm"), "link.pgm", "away/secret.pgm", "secret.pgm"):
        path = write_ros_map(maps, b"", image=image)
        with pytest.raises(MapError, match=r"expected the image in it .--anywhere allows it."):
            read(path)
        assert read(path, anywhere=True).area > 0
    # A link to the whole folder does not lead out of it.
    (tmp_path / "linked").symlink_to(maps)
    assert read(write_ros_map(tmp_path / "linked", b"", image="pictures/a.pgm")).area > 0


@pytest.mark.parametrize(
    "name",
    [
        "/home/somebody/maps/plan.pgm",
        "../maps/plan.pgm",
        "maps/plan.pgm",
        r"C:\maps\plan.pgm",
        r"..\plan.pgm",
    ],
)
def test_a_missing_picture_is_replaced_by_one_next_to_the_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "plan.pgm").write_bytes(build_pgm(draw_pixels(PLAN)))
    foreign = IMPORTER.read(write_ros_map(tmp_path, b"", "a", image=name), ReadOptions())
    assert foreign.free.area > 0
    assert foreign.repaired == (f"image: {name!r} not found, used 'plan.pgm' next to the file",)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"image": "none.pgm"}, "none.pgm: no such file"),
        ({"image": "''"}, "image: empty"),
        ({"image": "[a, b]"}, "image: expected one file name"),
        ({"image": "."}, "expected a file, got a folder"),
        ({"image": "x" * 300}, "image: 'xxx"),
        ({"image": "x/" * 2000}, "expected a shorter name, got 4000 characters"),
        ({"image": '"a\\0b"'}, "image: 'a\\x00b'"),
        ({"image": "pipe"}, "expected a file, got a pipe or a device"),
        ({"resolution": None}, "resolution: missing, expected a number"),
        ({"resolution": "nan"}, "resolution: expected a number"),
        ({"resolution": ".nan"}, "resolution: expected a number"),
        ({"resolution": "inf"}, "resolution: expected a number"),
        ({"resolution": -0.05}, "resolution: expected a number from 0.0001 to 1000 (m)"),
        ({"resolution": 0}, "resolution: expected a number"),
        ({"resolution": 1e-9}, "resolution: expected a number"),
        ({"resolution": "{a: 1}"}, "resolution: expected a number"),
        ({"origin": "[1, 2, nan]"}, "origin[2]: expected a number, got 'nan'"),
        (
            {"origin": "[1, 1e30, 0]"},
            "origin[1]: expected a number from -10000000 to 10000000 (m), got 1e+30",
        ),
        ({"origin": "[1]"}, "origin: expected [x, y, yaw]"),
        ({"origin": "[[1, 2], 0]"}, "origin[0]: expected a number"),
        ({"origin": 5}, "origin: expected [x, y, yaw]"),
        ({"negate": 2}, "negate: expected 0 or 1"),
        (
            {"free_thresh": 0.9},
            "plan.yaml: expected 0 <= free_thresh <= occupied_thresh <= 1, got 0.9 and 0.65",
        ),
        ({"free_thresh": -1}, "expected 0 <= free_thresh <= occupied_thresh <= 1, got -1 and 0.65"),
        ({"occupied_thresh": "much"}, "occupied_thresh: expected a number"),
        ({"mode": "quaternary"}, "mode: expected one of trinary, scale, raw"),
        ({"mode": "!!str raw"}, "the tag 'tag:yaml.org,2002:str'"),
    ],
)
def test_invalid_maps_are_rejected(tmp_path: Path, keys: dict[str, object], expected: str) -> None:
    (tmp_path / "plan.pgm").write_bytes(build_pgm(draw_pixels(PLAN)))
    os.mkfifo(tmp_path / "pipe")
    keys = {"image": "plan.pgm"} | keys
    path = write_ros_map(tmp_path, b"", **keys)  # type: ignore[arg-type]
    with pytest.raises(MapError) as caught:
        IMPORTER.read(path, ReadOptions())
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 700
    assert str(caught.value).startswith(str(tmp_path))
    assert "\n" not in str(caught.value)


def test_maps_without_free_cells_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"no cell is free \(--unknown free treats unknown"):
        read(write_ros_map(tmp_path, draw_pixels("##\n??")))
    with pytest.raises(MapError, match=r"no cell is free$"):
        read(write_ros_map(tmp_path, draw_pixels("##\n##")))


def test_options_of_other_formats_are_rejected(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN))
    with pytest.raises(
        ParameterError, match=r"--trees: not supported by the format ros \(supported: --anywhere, --"
    ):
        import_map(path, options=ReadOptions(trees="free"))
    with pytest.raises(ParameterError, match=r"--threshold: not applicable: .*plan\.yaml is of mode trinary"):
        import_map(path, options=ReadOptions(threshold=0.4))
    with pytest.raises(ParameterError, match="unknown format 'rose': did you mean 'ros'"):
        import_map(path, format="rose")
