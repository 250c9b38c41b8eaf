"""Densities in map files: reading, writing, error messages, and images in the folder of a map."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from density_cases import KINDS
from example_map import SCHEMA
from PIL import Image

from robocov.density import MAX_RASTER_SIZE, Gaussians, Raster, Uniform, WeightedPolygons
from robocov.environment import Environment
from robocov.errors import MapError
from robocov.mapfile import MAX_IMAGE_BYTES, dump_map, from_json, load_map, parse_map, save_map, to_json

RING = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
PLAIN = to_json(Environment("plain", RING))


def build_document(density) -> dict:
    return PLAIN | {"density": density}


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_written_densities_are_read_unchanged(density, tmp_path):
    environment = Environment("weighted", RING, density=density)
    document = to_json(environment)
    SCHEMA.validate(document)
    assert from_json(document) == environment
    assert parse_map(dump_map(environment), "again").density == density
    save_map(environment, tmp_path / "weighted.json")
    assert load_map(tmp_path / "weighted.json") == environment
    assert "density" not in to_json(Environment("plain", RING))


def test_optional_keys_have_defaults():
    assert from_json(build_document({"kind": "uniform"})).density == Uniform(1.0)
    peaks = [{"center": [1, 2], "sigma": 0.5, "weight": 3}]
    density = from_json(build_document({"kind": "gaussians", "peaks": peaks})).density
    assert isinstance(density, Gaussians)
    assert density.floor == 0.0
    density = from_json(build_document({"kind": "polygons", "areas": []})).density
    assert isinstance(density, WeightedPolygons)
    assert density.background == 1.0
    density = from_json(build_document({"kind": "raster", "rows": [[1, 2], [3, 4]]})).density
    assert isinstance(density, Raster)
    assert density.extent == (0.0, 0.0, 10.0, 6.0)
    # The top row is the first one in the file.
    assert density.values.tolist() == [[3.0, 4.0], [1.0, 2.0]]
    assert density.interpolation == "bilinear"
    assert from_json(build_document(None)).density is None


def test_each_row_of_a_raster_is_a_line():
    text = dump_map(Environment("weighted", RING, density=Raster(np.eye(2), (0.0, 0.0, 10.0, 6.0), "cells")))
    assert '    "rows": [\n      [0, 1],\n      [1, 0]\n    ]' in text


PEAK = {"center": [1, 2], "sigma": 0.5, "weight": 3}
AREA = {"vertices": [[1, 1], [2, 1], [2, 3]], "weight": 5}


@pytest.mark.parametrize(
    ("density", "expected"),
    [
        (3, "density: expected an object whose kind is one of uniform, gaussians, polygons, raster, got 3"),
        ({}, "density.kind: missing"),
        ({"kind": "gaussian"}, "density.kind: expected one of .* (did you mean 'gaussians'?)"),
        ({"kind": "uniform", "weight": 0}, "density.weight: expected at least one weight above 0, got none"),
        ({"kind": "uniform", "weight": -1}, "density.weight: expected a number from 0 to 1000000, got -1"),
        ({"kind": "uniform", "weight": True}, "density.weight: expected a number"),
        ({"kind": "gaussians"}, "density.peaks: missing"),
        ({"kind": "gaussians", "peaks": [3]}, "density.peaks[0]: expected an object, got 3"),
        ({"kind": "gaussians", "peaks": []}, "density: expected at least one weight above 0, got none"),
        (
            {"kind": "gaussians", "peaks": [PEAK, {**PEAK, "wight": 1}]},
            "density.peaks[1]: unknown key 'wight': did you mean 'weight'?",
        ),
        ({"kind": "gaussians", "floor": "x", "peaks": [PEAK]}, "density.floor: expected a number from 0"),
        ({"kind": "gaussians", "peaks": [{**PEAK, "center": [1]}]}, "density.peaks[0].center: expected a"),
        ({"kind": "gaussians", "peaks": [{**PEAK, "sigma": 0}]}, "density.peaks[0].sigma: expected a number"),
        (
            {"kind": "gaussians", "peaks": [{"center": [1, 2], "weight": 1}]},
            "density.peaks[0]: expected one of sigma and covariance, got neither",
        ),
        (
            {"kind": "gaussians", "peaks": [{**PEAK, "covariance": [[1, 0], [0, 1]]}]},
            "density.peaks[0]: expected one of sigma and covariance, got both",
        ),
        (
            {"kind": "gaussians", "peaks": [{"center": [1, 2], "weight": 1, "covariance": [[1, 2], [2, 1]]}]},
            "density.peaks[0].covariance: expected a symmetric, positive definite",
        ),
        (
            {
                "kind": "gaussians",
                "peaks": [
                    {"center": [1, 2], "weight": 1, "covariance": [[1e6, 1e6 - 1e-4], [1e6 - 1e-4, 1e6]]}
                ],
            },
            "in all directions with an absolute correlation of at most 1 - 5e-10",
        ),
        (
            {"kind": "polygons", "background": 0, "areas": []},
            "density: expected at least one weight above 0, got none",
        ),
        (
            {"kind": "polygons", "areas": [{**AREA, "vertices": [[1, 1], [2, 1]]}]},
            "density.areas[0].vertices: expected a list of at least 3 points",
        ),
        (
            {"kind": "polygons", "areas": [{**AREA, "vertices": [[1, 1], [3, 3], [3, 1], [1, 3]]}]},
            "density.areas[0].vertices[",
        ),
        (
            {"kind": "polygons", "areas": [{**AREA, "holes": [[[5, 5], [6, 5], [6, 6]]]}]},
            "density.areas[0].holes[0]: sticks out of density.areas[0].vertices",
        ),
        (
            {
                "kind": "polygons",
                "background": 0,
                "areas": [{**AREA, "vertices": [[90, 1], [92, 1], [92, 3]]}],
            },
            "density: expected at least one weight above 0, got none in the free space",
        ),
        ({"kind": "raster"}, "density: expected one of rows and image, got neither"),
        (
            {"kind": "raster", "rows": [[1]], "image": "a.png"},
            "density: expected one of rows and image, got both",
        ),
        (
            {"kind": "raster", "rows": []},
            f"density.rows: expected a list of 1 to {MAX_RASTER_SIZE} rows, got []",
        ),
        (
            {"kind": "raster", "rows": [[1] * (MAX_RASTER_SIZE + 1)]},
            f"density.rows[0]: expected a list of 1 to {MAX_RASTER_SIZE} numbers, got",
        ),
        (
            {"kind": "raster", "rows": [[1, 2], [1]]},
            "density.rows[1]: expected 2 numbers as in the first row, got 1",
        ),
        ({"kind": "raster", "rows": [[1, -1]]}, "density.rows[0][1]: expected a number from 0"),
        (
            {"kind": "raster", "rows": [[0, 0]]},
            "density.rows: expected at least one weight above 0, got none",
        ),
        (
            {"kind": "raster", "rows": [[1]], "extent": [0, 0, 0, 1]},
            "density.extent: expected [x_min, y_min, x_max, y_max]",
        ),
        (
            {"kind": "raster", "rows": [[1]], "interpolation": "cubic"},
            'density.interpolation: expected "bilinear" or "cells", got "cubic"',
        ),
        ({"kind": "raster", "rows": [[1]], "white": 2}, "density.white: expected only with an image"),
        (
            {"kind": "raster", "image": "a.png"},
            'density.image: "a.png": image densities require a map loaded from a file',
        ),
    ],
    ids=lambda value: str(value)[:40],
)
def test_mistakes_are_reported_with_their_path(density, expected):
    with pytest.raises(MapError) as caught:
        from_json(build_document(density), "mine.json")
    start, _, end = expected.partition(".* ")
    message = str(caught.value)
    assert message.startswith("mine.json: ")
    assert start in message
    assert end in message
    assert "\n" not in message


def test_mistakes_in_a_file_have_line_and_column():
    text = json.dumps(build_document({"kind": "gaussians", "peaks": [{**PEAK, "sigma": -1}]}), indent=1)
    with pytest.raises(MapError) as caught:
        parse_map(text, "mine.json")
    line = text.splitlines()[caught.value.line - 1]
    assert '"sigma": -1' in line
    assert str(caught.value).startswith(f"mine.json:{caught.value.line}:")


def test_a_raster_on_a_flat_boundary_is_reported_as_an_error_in_the_boundary():
    document = build_document({"kind": "raster", "rows": [[1, 2], [3, 4]]})
    document["boundary"] = [[0, 0], [0, 4], [0, 8]]
    with pytest.raises(MapError, match=r"boundary: expected a width and a height above 0, got 0 m x 8 m"):
        from_json(document)


def test_tiny_weights_are_read_as_zero():
    """Otherwise they would become zero when a map is written and read again."""
    for density in (
        {"kind": "uniform", "weight": 1e-16},
        {"kind": "raster", "rows": [[1e-12, 0]]},
        {"kind": "gaussians", "floor": 1e-300, "peaks": []},
    ):
        with pytest.raises(MapError, match="expected at least one weight above 0, got none"):
            from_json(build_document(density))
    tiny = from_json(build_document({"kind": "raster", "rows": [[1e-12, 1]]}))
    assert tiny.density.lower_bound == 0.0
    assert parse_map(dump_map(tiny), "again") == tiny
    flat = {"kind": "polygons", "areas": [{**AREA, "vertices": [[0, 0], [9, 0], [9, 5], [0, 1e-320]]}]}
    assert from_json(build_document(flat)).free_masses.sum() == pytest.approx(60.0 + 4.0 * 22.5)


# Images


def write_map(folder: Path, image: str, **more) -> Path:
    path = folder / "mine.json"
    path.write_text(json.dumps(build_document({"kind": "raster", "image": image, **more})))
    return path


def write_image(path: Path, rows, mode: str = "L") -> None:
    dtype = np.uint16 if mode == "I;16" else np.uint8
    Image.fromarray(np.array(rows, dtype=dtype)).save(path)


def test_images_next_to_the_map_are_read_as_rasters(tmp_path):
    write_image(tmp_path / "phi.png", [[0, 255], [51, 102]])
    density = load_map(write_map(tmp_path, "phi.png", black=1, white=6)).density
    assert isinstance(density, Raster)
    assert density.values.tolist() == [[2.0, 3.0], [1.0, 6.0]]
    (tmp_path / "more").mkdir()
    write_image(tmp_path / "more" / "deep.png", [[0, 65535]], "I;16")
    density = load_map(write_map(tmp_path, "more/deep.png", extent=[0, 0, 10, 6])).density
    assert isinstance(density, Raster)
    assert density.values.tolist() == [[0.0, 1.0]]
    Image.fromarray(np.full((2, 2, 3), 255, dtype=np.uint8)).save(tmp_path / "color.png")
    assert load_map(write_map(tmp_path, "color.png")).density.values.min() == 1.0
    (tmp_path / "phi.pgm").write_bytes(b"P5 2 1 255\n\x00\xff")
    assert load_map(write_map(tmp_path, "phi.pgm")).density.values.tolist() == [[0.0, 1.0]]


def test_the_former_key_of_an_image_is_accepted(tmp_path):
    write_image(tmp_path / "phi.png", [[0, 255]])
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(build_document({"kind": "raster", "picture": "phi.png"})))
    assert load_map(path) == load_map(write_map(tmp_path, "phi.png"))


def test_the_former_key_of_an_image_has_messages_with_a_path(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(build_document({"kind": "raster", "picture": "none.png"}), indent=1))
    with pytest.raises(MapError, match=r'density\.image: "none\.png"'):
        load_map(path)


def test_images_are_written_as_rows(tmp_path):
    write_image(tmp_path / "phi.png", [[0, 200], [7, 102]])
    environment = load_map(write_map(tmp_path, "phi.png", black=0.1, white=5))
    document = to_json(environment)
    assert "image" not in document["density"]
    assert from_json(document) == environment
    save_map(environment, tmp_path / "again.json")
    (tmp_path / "phi.png").unlink()
    assert load_map(tmp_path / "again.json") == environment


@pytest.mark.parametrize(
    "name", ["../phi.png", "/etc/passwd", "C:\\phi.png", "\\\\host\\phi.png", "a/../../phi.png", "C:phi.png"]
)
def test_images_must_be_in_the_folder(tmp_path, name):
    folder = tmp_path / "inner"
    folder.mkdir()
    write_image(tmp_path / "phi.png", [[1, 2]])
    with pytest.raises(MapError, match="expected a file in the folder of the map"):
        load_map(write_map(folder, name))


def test_links_out_of_the_folder_are_not_followed(tmp_path):
    folder = tmp_path / "inner"
    folder.mkdir()
    write_image(tmp_path / "phi.png", [[1, 2]])
    (folder / "link.png").symlink_to(tmp_path / "phi.png")
    with pytest.raises(MapError, match="expected a file in the folder of the map"):
        load_map(write_map(folder, "link.png"))


def test_unusable_images_are_rejected(tmp_path):
    def get_error(name: str, **more) -> str:
        with pytest.raises(MapError) as caught:
            load_map(write_map(tmp_path, name, **more))
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert 'density.image: "none.png": no such file' in get_error("none.png")
    (tmp_path / "text.png").write_text("not a picture")
    assert "cannot be read as PNG or PGM" in get_error("text.png")
    write_image(tmp_path / "whole.png", np.arange(10_000).reshape(100, 100) % 251)
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:-2000])
    assert "cannot be read as PNG or PGM" in get_error("cut.png")
    (tmp_path / "wide.pgm").write_bytes(b"P5 1025 1 255\n" + bytes(1025))
    assert f"expected at most {MAX_RASTER_SIZE} x {MAX_RASTER_SIZE} pixels, got 1025 x 1" in get_error(
        "wide.pgm"
    )
    (tmp_path / "bomb.pgm").write_bytes(b"P5 100000 100000 255\n")
    assert "got 100000 x 100000" in get_error("bomb.pgm") or "PNG or PGM" in get_error("bomb.pgm")
    (tmp_path / "float.pgm").write_bytes(b"Pf 2 1 -1.0\n" + np.array([0.25, 0.5], "<f4").tobytes())
    assert "expected 8 or 16 bits per pixel, got floating-point values" in get_error("float.pgm")
    with (tmp_path / "heavy.png").open("wb") as file:
        file.truncate(MAX_IMAGE_BYTES + 1)
    assert "expected at most 8 MB, got more" in get_error("heavy.png")
    write_image(tmp_path / "black.png", [[0, 0]])
    assert "density.image: expected at least one weight above 0, got none" in get_error("black.png")
    (tmp_path / "folder.png").mkdir()
    assert "no such file" in get_error("folder.png")
