"""Exported ROS maps: pixels, YAML, and the same map after an import."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from robocov.environment import CircleObstacle, Environment, PolygonObstacle
from robocov.errors import OutputError
from robocov.mapfile import load_map
from robocov_app.formats import EXPORTERS, ReadOptions, Shaping, WriteOptions, export_map, import_map

CORNER = Environment(
    "corner",
    ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)),
    (PolygonObstacle(((1.0, 1.0), (1.5, 1.0), (1.5, 1.5), (1.0, 1.5))),),
)
"""An L with a block; the lower left is the origin."""


def read_pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path))


def test_yaml_and_pixels_as_map_saver_writes_them(tmp_path: Path) -> None:
    report = export_map(CORNER, tmp_path / "corner.yaml", options=WriteOptions(cell=0.5))
    assert report.files == (tmp_path / "corner.yaml", tmp_path / "corner.pgm")
    assert yaml.safe_load((tmp_path / "corner.yaml").read_text()) == {
        "image": "corner.pgm", "mode": "trinary", "resolution": 0.5, "origin": [-0.5, -0.5, 0.0],
        "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196,
    }  # fmt: skip
    drawing = """
        ######????
        #....#????
        #....#????
        #....#????
        #....#####
        #........#
        #.#......#
        #........#
        #........#
        ##########
    """.split()
    # The block of half a meter is one cell; the rest is unchanged.
    values = {"#": 0, ".": 254, "?": 205}
    assert read_pixels(tmp_path / "corner.pgm").tolist() != []
    found = read_pixels(tmp_path / "corner.pgm")
    expected = np.array([[values[c] for c in line] for line in drawing])
    expected[6, 2] = 254
    expected[6, 3] = 0
    np.testing.assert_array_equal(found, expected)
    assert report.area == CORNER.free_area
    assert report.area_written == pytest.approx(CORNER.free_area)
    assert (tmp_path / "corner.pgm").read_bytes().startswith(b"P5\n# robocov 0.5 m/pix\n10 10\n255\n")


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("image", ["pgm", "png"])
def test_a_written_map_can_be_read(tmp_path: Path, mode: str, image: str) -> None:
    report = export_map(CORNER, tmp_path / "c.yaml", options=WriteOptions(cell=0.25, mode=mode, image=image))  # type: ignore[arg-type]
    environment, conversion, _ = import_map(tmp_path / "c.yaml", shaping=Shaping(simplify=0.0))
    assert environment.free.equals(CORNER.free)
    assert set(environment.boundary) == set(CORNER.boundary)
    unknown = mode != "scale" or image == "png"
    assert ("unknown" in conversion.notes[0]) == unknown
    assert bool(report.notes) == (not unknown)
    if unknown:
        cut, _, _ = import_map(
            tmp_path / "c.yaml", options=ReadOptions(unknown="cut"), shaping=Shaping(simplify=0.0)
        )
        assert cut.free.equals(CORNER.free)
        assert cut.area == CORNER.area


def test_scale_and_raw_give_the_solid_fraction_of_a_cell(tmp_path: Path) -> None:
    half = Environment("half", ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), (
        PolygonObstacle(((0.875, 0.0), (1.375, 0.0), (1.375, 1.0), (0.875, 1.0))),
    ))  # fmt: skip
    export_map(half, tmp_path / "raw.yaml", options=WriteOptions(cell=0.5, mode="raw"))
    assert read_pixels(tmp_path / "raw.pgm")[1].tolist() == [100, 0, 25, 100, 0, 100]
    export_map(half, tmp_path / "scale.yaml", options=WriteOptions(cell=0.5, mode="scale"))
    found = read_pixels(tmp_path / "scale.png")
    assert found.shape[2] == 2
    dark = 1 - found[1, :, 0] / 255
    assert dark[[1, 4]].tolist() == [0, 0]
    assert dark[3] == 1
    assert dark[2] == pytest.approx(0.196 + 0.25 * (0.65 - 0.196), abs=0.003)


def test_names_that_yaml_would_misread_are_quoted(tmp_path: Path) -> None:
    for name in ("a: b", "#1", "- x", "über", "'q'", "true", "12", "tür 🚪", "\x7f"):
        path = tmp_path / f"{name}.yaml"
        export_map(CORNER, path, options=WriteOptions(cell=0.25))
        assert import_map(path)[0].free_area > 0, name


def test_the_picture_is_not_written_over_the_yaml(tmp_path: Path) -> None:
    with pytest.raises(
        OutputError, match=r"corner\.pgm: expected another name for the YAML than for the image"
    ):
        export_map(CORNER, tmp_path / "corner.pgm", format="ros")
    assert not list(tmp_path.iterdir())
    exporter = EXPORTERS["ros"]
    assert exporter.list_files(Path("a.yaml"), WriteOptions(mode="scale")) == (Path("a.yaml"), Path("a.png"))


def test_both_files_are_replaced_or_neither(tmp_path: Path) -> None:
    export_map(CORNER, tmp_path / "corner.yaml")
    picture = (tmp_path / "corner.pgm").read_bytes()
    (tmp_path / "corner.yaml").unlink()
    (tmp_path / "corner.yaml").mkdir()
    with pytest.raises(OutputError, match="expected a file, got a folder"):
        export_map(load_map("rooms"), tmp_path / "corner.yaml")
    assert (tmp_path / "corner.pgm").read_bytes() == picture
    assert sorted(file.name for file in tmp_path.iterdir()) == ["corner.pgm", "corner.yaml"]


def test_the_same_map_gives_the_same_bytes(tmp_path: Path) -> None:
    office = load_map("office")
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        for options in (WriteOptions(), WriteOptions(mode="scale")):
            export_map(office, tmp_path / folder / f"office-{options.mode}.yaml", options=options)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(files) == 4
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_an_unwritable_folder_is_reported_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        export_map(CORNER, tmp_path / "none" / "a.yaml")
    round_room = Environment("round", CORNER.boundary, (CircleObstacle((1.0, 1.0), 0.3, "pillar"),))
    report = export_map(round_room, tmp_path / "a.yaml")
    assert report.dropped == ("names of obstacles",)
    assert report.format_lines()[-1] == f"saved in {tmp_path / 'a.yaml'}, {tmp_path / 'a.pgm'}"
