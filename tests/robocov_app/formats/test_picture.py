"""Images of plans: dark, light and transparent pixels, and the position that the file contains."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image, PngImagePlugin
from raster_files import build_pgm

from robocov.errors import MapError
from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, import_map
from robocov_app.formats.raster.picture import GEOREFERENCE_CHUNK

IMPORTER = IMPORTERS["image"]

LEVELS = np.array([[0, 127, 128, 255], [255, 255, 255, 255]], dtype=np.uint8)


def save_picture(
    folder: Path, pixels: np.ndarray, chunk: str | None = None, title: str | None = None
) -> Path:
    texts = PngImagePlugin.PngInfo()
    if chunk is not None:
        texts.add_text(GEOREFERENCE_CHUNK, chunk)
    if title is not None:
        texts.add_text("Title", title)
    path = folder / "plan.png"
    Image.fromarray(pixels).save(path, pnginfo=texts)
    return path


def read(path: Path, **options: object) -> shapely.MultiPolygon:
    return IMPORTER.read(path, ReadOptions(**options)).free  # type: ignore[arg-type]


def test_dark_is_an_obstacle(tmp_path: Path) -> None:
    path = save_picture(tmp_path, LEVELS)
    assert detect_format(path) is IMPORTER
    lower = shapely.box(0, 0, 4, 1)
    assert shapely.equals(read(path, cell=1.0), lower | shapely.box(2, 1, 4, 2))
    assert shapely.equals(read(path, cell=1.0, threshold=0.4), lower | shapely.box(1, 1, 4, 2))
    assert shapely.equals(read(path, cell=1.0, threshold=1.0), lower | shapely.box(3, 1, 4, 2))
    assert shapely.equals(read(path, cell=1.0, invert=True), shapely.box(0, 1, 2, 2))
    assert shapely.equals(read(path, cell=1.0, invert=True, threshold=0.0), shapely.box(0, 1, 4, 2) | lower)


def test_a_pgm_is_a_picture_too(tmp_path: Path) -> None:
    path = tmp_path / "plan.pgm"
    path.write_bytes(build_pgm(LEVELS))
    assert detect_format(path) is IMPORTER
    assert read(path, cell=0.5).area == 6 / 4


def test_single_cells_of_a_jpeg_are_noise(tmp_path: Path) -> None:
    pixels = np.full((64, 64), 255, dtype=np.uint8)
    pixels[20:23, 20:23] = pixels[40, 40] = 0
    Image.fromarray(pixels).save(tmp_path / "plan.jpg", quality=100)
    Image.fromarray(pixels).save(tmp_path / "plan.bmp")
    lossy, report, _ = import_map(tmp_path / "plan.jpg", options=ReadOptions(cell=0.1))
    assert len(lossy.obstacles) == 1
    assert report.dropped == ("1 obstacle smaller than 0.015 m², 0.01 m² (--specks 0 keeps them)",)
    exact, _, _ = import_map(tmp_path / "plan.bmp", options=ReadOptions(cell=0.1))
    assert len(exact.obstacles) == 2


def test_transparent_pixels_are_unknown(tmp_path: Path) -> None:
    pixels = np.full((4, 4, 4), 255, dtype=np.uint8)
    pixels[:, 2, 3] = 127
    pixels[:, 3] = (0, 0, 0, 128)
    path = save_picture(tmp_path, pixels)
    assert shapely.equals(read(path, cell=1.0), shapely.box(0, 0, 2, 4))
    assert shapely.equals(read(path, cell=1.0, unknown="free"), shapely.box(0, 0, 3, 4))
    foreign = IMPORTER.read(path, ReadOptions(cell=1.0, unknown="cut"))
    assert foreign.boundary is not None
    assert foreign.notes == ("4 x 4 cells of 1 m: 50.0% free, 25.0% blocked, 25.0% transparent, cut away",)
    pixels[..., 3] = 0
    with pytest.raises(MapError, match="--unknown free treats transparent cells as free"):
        read(save_picture(tmp_path, pixels), cell=1.0)


def test_position_and_scale_in_the_file_are_used(tmp_path: Path) -> None:
    path = save_picture(tmp_path, LEVELS, json.dumps({"cell_m": 0.5, "origin_m": [3, -2]}), title="an office")
    foreign = IMPORTER.read(path, ReadOptions())
    assert foreign.free.bounds == (3.0, -2.0, 5.0, -1.0)
    assert (foreign.name, foreign.cell) == ("an office", 0.5)
    assert read(path, cell=2.0).bounds == (3.0, -2.0, 11.0, 2.0)


@pytest.mark.parametrize(
    "chunk",
    [
        None, "", "no JSON", "[]", "{}", '{"cell_m": 1}', '{"cell_m": "x", "origin_m": [0, 0]}',
        '{"cell_m": NaN, "origin_m": [0, 0]}', '{"cell_m": -1, "origin_m": [0, 0]}',
        '{"cell_m": 1, "origin_m": [0, Infinity]}', '{"cell_m": 1, "origin_m": [0]}', "[" * 5000,
        '{"cell_m": 1e999, "origin_m": [0, 0]}', '{"cell_m": 1, "origin_m": {"a": 0, "b": 1}}',
    ],
)  # fmt: skip
def test_a_picture_without_a_scale_requires_one(tmp_path: Path, chunk: str | None) -> None:
    path = save_picture(tmp_path, LEVELS, chunk)
    with pytest.raises(
        MapError, match=r"plan.png: an image has no scale, expected --cell, the meters per pixel"
    ):
        read(path)
    assert read(path, cell=1.0).bounds == (0.0, 0.0, 4.0, 2.0)


def test_a_yaml_file_next_to_it_is_suggested(tmp_path: Path) -> None:
    path = save_picture(tmp_path, LEVELS)
    (tmp_path / "plan.yaml").write_text("image: plan.png")
    with pytest.raises(MapError, match=r"\(or import plan\.yaml next to it\)"):
        import_map(path)
