"""Recognition of formats, their options, and properties that all formats share."""

import os
from dataclasses import fields
from pathlib import Path

import pytest
from raster_files import PLAN, build_pgm, draw_pixels, write_ros_map

from robocov.errors import MapError, ParameterError
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping, detect_format, get_importer, import_map


def test_every_format_has_a_name_and_a_title() -> None:
    known = {field.name for field in fields(ReadOptions)}
    for name, one in IMPORTERS.items():
        assert one.name == name
        assert one.title
        assert all(suffix.startswith(".") and suffix.islower() for suffix in one.suffixes)
        # YAML files are recognized as IR-SIM only by their content; others are read as ROS maps.
        # Files of CoverageControl are recognized only by their content.
        assert one.suffixes or one.name in ("irsim", "coverage-control")
        assert one.options <= known, name
        assert get_importer(name) is one
    assert {"ros", "movingai", "image"} <= IMPORTERS.keys()


def test_no_format_accepts_noise(tmp_path: Path) -> None:
    rng_free = [
        b"",
        b"\0" * 5000,
        bytes(range(256)) * 20,
        b"hello",
        b"[" * 5000,
        b"\xff\xfe",
        b"{}",
        b"<",
        b"#",
    ]
    for head in rng_free:
        for name, one in IMPORTERS.items():
            assert one.sniff(tmp_path / "file.bin", head) is False, (name, head[:10])


def test_the_content_counts_before_the_suffix(tmp_path: Path) -> None:
    (tmp_path / "plan.map").write_bytes(build_pgm(draw_pixels(PLAN)))
    assert detect_format(tmp_path / "plan.map").name == "image"
    assert detect_format(write_ros_map(tmp_path, draw_pixels(PLAN))).name == "ros"
    (tmp_path / "half.yaml").write_text("image: plan.map\n")
    assert detect_format(tmp_path / "half.yaml").name == "ros"
    with pytest.raises(MapError, match="resolution: missing"):
        import_map(tmp_path / "half.yaml")


def test_unknown_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "plan.xyz"
    path.write_text("nothing")
    expected = r"plan\.xyz: unknown format \(text that begins with 'nothing'\), expected one of .*ros.*"
    with pytest.raises(MapError, match=expected):
        detect_format(path)
    with pytest.raises(MapError, match="no such file"):
        detect_format(tmp_path / "none.png")
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(MapError, match="expected a file, got a pipe or a device"):
        detect_format(tmp_path / "pipe.png")
    with pytest.raises(MapError, match="expected a file, got a folder"):
        import_map(tmp_path)
    with pytest.raises(ParameterError, match="unknown format 'gif'"):
        import_map(path, format="gif")


def test_a_format_may_be_forced(tmp_path: Path) -> None:
    # A map of ROS with a key "world" looks like a world of IR-SIM.
    path = write_ros_map(tmp_path, draw_pixels(PLAN), world={"width": 10, "height": 10})
    assert detect_format(path).name == "irsim"
    environment, report, _ = import_map(path, format="ros")
    assert report.format == "ros"
    free_cells = PLAN.count(".")
    cell_area = 0.25**2
    assert environment.free_area == pytest.approx(free_cells * cell_area)
    with pytest.raises(MapError, match="line 1: expected type octile, height N, width N or map"):
        import_map(path, format="movingai")


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"cell": 0.0}, "cell: expected a number from 0.000001 to 10000 m, got 0.0"),
        ({"cell": float("nan")}, "cell: expected a number from 0.000001 to 10000 m, got nan"),
        ({"scale": -1.0}, "scale: expected a number from 0.000001 to 10000 m, got -1.0"),
        ({"thickness": float("inf")}, "thickness: expected a number from 0.000001 to 10000 m, got inf"),
        ({"threshold": 1.1}, "threshold: expected a number from 0 to 1"),
        ({"threshold": float("nan")}, "threshold: expected a number from 0 to 1, got nan"),
        ({"unknown": "solid"}, "unknown: expected one of obstacle, free, cut"),
        ({"trees": "green"}, "trees: expected one of obstacle, free"),
    ],
)
def test_options_out_of_range_are_rejected(options: dict[str, object], expected: str) -> None:
    with pytest.raises(ParameterError, match=expected):
        ReadOptions(**options)  # type: ignore[arg-type]


def test_the_same_file_gives_the_same_map(tmp_path: Path) -> None:
    path = write_ros_map(tmp_path, draw_pixels(PLAN))
    first, report, _ = import_map(path, shaping=Shaping(keep="all"))
    again, same, _ = import_map(path, shaping=Shaping(keep="all"))
    assert first == again
    assert report == same
