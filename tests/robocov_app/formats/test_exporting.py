"""Choice of the export format, and maps that are exported and imported again."""

import functools
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from shapely import Polygon

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import CircleObstacle, Environment, Obstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError, ParameterError
from robocov.generator import generate_map
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.formats import (
    EXPORTERS,
    ReadOptions,
    Shaping,
    WriteOptions,
    choose_exporter,
    export_map,
    import_map,
)
from robocov_app.formats.geometry.conversion.starts import find_center_regions

ROOM = Environment("room", ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)))


def test_every_exporter_describes_its_format() -> None:
    known = {field.name for field in fields(WriteOptions)}
    for name, exporter in EXPORTERS.items():
        assert exporter.name == name
        assert exporter.title and exporter.suffixes
        assert exporter.options <= known
        path = Path(f"a{exporter.suffixes[0]}")
        assert exporter.list_files(path, WriteOptions())[0] == path
        assert choose_exporter(path) is exporter
        assert choose_exporter("anything", name) is exporter


def test_unknown_formats_and_options_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(
        ParameterError, match=r"a\.xyz: unknown format, expected a file ending in one of \.yaml, .*\.png"
    ):
        export_map(ROOM, "a.xyz")
    with pytest.raises(ParameterError, match="unknown format 'rosy': did you mean 'ros'"):
        export_map(ROOM, "a.yaml", format="rosy")
    with pytest.raises(
        ParameterError, match=r"--mode: not supported by the format image \(supported: --cell"
    ):
        export_map(ROOM, tmp_path / "a.png", options=WriteOptions(mode="raw"))
    for options, expected in (
        ({"cell": 0.0}, "cell: expected a number from 0.000001 to 10000 m, got 0.0"),
        ({"mode": "binary"}, "mode: expected one of trinary, scale, raw"),
        ({"image": "bmp"}, "image: expected one of pgm, png, got 'bmp'"),
        ({"digits": 99}, "digits: expected a number from 0 to 12, got 99"),
        ({"scale": float("nan")}, "scale: expected a number from"),
    ):
        with pytest.raises(ParameterError, match=expected):
            WriteOptions(**options)  # type: ignore[arg-type]


positions = st.tuples(st.floats(0.3, 7.7), st.floats(0.3, 5.7))
obstacles: st.SearchStrategy[Obstacle] = st.one_of(
    st.builds(CircleObstacle, positions, st.floats(0.15, 0.9)),
    st.builds(
        lambda at, size, turn: PolygonObstacle(
            tuple(shapely.get_coordinates(
                shapely.affinity.rotate(shapely.box(*at, at[0] + size[0], at[1] + size[1]), turn)
            )[:-1].tolist())  # type: ignore[arg-type]
        ),
        positions, st.tuples(st.floats(0.15, 2), st.floats(0.15, 2)), st.floats(0, 90),
    ),
    st.builds(
        lambda ends, width: WallObstacle(tuple(ends), width),
        st.lists(positions, min_size=2, max_size=2, unique=True), st.floats(0.1, 0.3),
    ),
)  # fmt: skip


def build_slanted_room(slant: float, obstacles: list[Obstacle]) -> Environment:
    corners = ((0.0, 0.0), (8.0, slant), (8.0 - slant, 6.0), (slant / 2, 6.0 - slant))
    return Environment("drawn", corners, tuple(obstacles))


@pytest.mark.slow
@settings(deadline=None, max_examples=count_examples(50))
@given(
    st.floats(0, 1.5), st.lists(obstacles, max_size=5), st.sampled_from([0.05, 0.08]),
    st.sampled_from(["ros", "scale", "raw", "png-of-ros", "movingai", "image"]),
)  # fmt: skip
def test_a_round_trip_changes_less_than_a_row_of_cells(
    tmp_path_factory: pytest.TempPathFactory,
    slant: float,
    obstacles: list[Obstacle],
    cell: float,
    format_name: str,
) -> None:
    folder = tmp_path_factory.getbasetemp()
    environment = build_slanted_room(slant, obstacles)
    if not Polygon(environment.boundary).is_valid or environment.free.is_empty:
        return
    exporter_name = {"scale": "ros", "raw": "ros", "png-of-ros": "ros"}.get(format_name, format_name)
    options = WriteOptions(
        cell=cell,
        mode=format_name if format_name in ("scale", "raw") else None,  # type: ignore[arg-type]
        image="png" if format_name == "png-of-ros" else None,
    )
    path = folder / f"drawn{EXPORTERS[exporter_name].suffixes[0]}"
    written = export_map(environment, path, options=options)
    read_options = ReadOptions()
    if exporter_name == "movingai":
        read_options = ReadOptions(cell=cell)
    try:
        imported, _, foreign = import_map(path, options=read_options, shaping=Shaping(keep="all", specks=0.0))
    except MapError as error:
        assert "no position has enough clearance" in str(error)
        return
    row = cell * environment.free.length
    assert abs(written.area_written - environment.free_area) < 0.5 * row
    assert abs(foreign.free.area - environment.free_area) < 0.5 * row
    assert abs(imported.free_area - environment.free_area) < row
    if exporter_name != "movingai":
        assert imported.free.symmetric_difference(environment.free).area < row
    # A second round trip changes no more than the first one.
    second_path = folder / f"again{EXPORTERS[exporter_name].suffixes[0]}"
    export_map(imported, second_path, options=options)
    imported_again, _, _ = import_map(
        second_path, options=read_options, shaping=Shaping(keep="all", specks=0.0)
    )
    assert abs(imported_again.free_area - imported.free_area) < row


PLACES = {
    "equator": (-78.5, 0.0), "northern hemisphere": (8.4, 49.0), "southern hemisphere": (151.2, -33.9),
    "antimeridian": (179.9999, 60.0), "near a pole": (30.0, -89.0),
}  # fmt: skip
FORMATS: dict[str, tuple[str, WriteOptions]] = {
    "ROS": (".yaml", WriteOptions()),
    "MovingAI": (".map", WriteOptions()),
    "image": (".png", WriteOptions()),
    "SVG": (".svg", WriteOptions()),
    "WKT": (".wkt", WriteOptions()),
    "meters": (".geojson", WriteOptions()),
    **{place: (".geojson", WriteOptions(origin=at)) for place, at in PLACES.items()},
}
MAPS = [
    *list_bundled_maps(),
    *(f"generated {kind}" for kind in ("blocks", "caves", "mazes", "polygons", "rooms")),
]
QUICK = ("rooms", "campus", "generated polygons")


@functools.cache
def get_map(name: str) -> Environment:
    kind = name.removeprefix("generated ")
    return load_map(name) if kind == name else generate_map(1, kind=kind)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in MAPS]
)
@pytest.mark.parametrize("format_name", FORMATS)
def test_exported_maps_can_be_imported_again(tmp_path: Path, name: str, format_name: str) -> None:
    environment = get_map(name)
    suffix, options = FORMATS[format_name]
    path = tmp_path / f"map{suffix}"
    read_options = ReadOptions()
    if "cell" in choose_exporter(path).options:
        # Generated blocks are aligned to a grid: with coarser cells, all rounding errors have the same sign.
        cell = 0.02 if name == "generated blocks" else 0.05
        options = replace(options, cell=cell)
        if suffix == ".map":
            read_options = ReadOptions(cell=cell)
    report = export_map(environment, path, options=options)
    imported, _, _ = import_map(path, options=read_options)
    assert imported.free.is_valid
    assert imported.free_area == pytest.approx(environment.free_area, rel=0.005)
    assert len(find_center_regions(imported.free, DEFAULT_RADIUS_M)) == len(
        find_center_regions(environment.free, DEFAULT_RADIUS_M)
    )
    obstacles = [shape.polygon for shape in imported.obstacles]
    shapes = [imported.boundary_polygon, *obstacles, *imported.free.geoms]
    for ring in shapely.get_rings(shapes):
        edges = np.diff(shapely.get_coordinates(ring), axis=0)
        assert np.linalg.norm(edges, axis=1).min() >= 1e-3
    assert report.warnings == ()


def test_a_map_around_a_pole_is_rejected(tmp_path: Path) -> None:
    size = 130_000.0
    corners = ((-size, -size), (size, -size), (size, size), (-size, size))
    with pytest.raises(ParameterError, match=r"origin: \(0, 89\): the map would span half of all longitudes"):
        export_map(
            Environment("arctic", corners), tmp_path / "a.geojson", options=WriteOptions(origin=(0, 89))
        )
    assert list(tmp_path.iterdir()) == []


def test_dropped_paths_of_obstacles_are_reported(tmp_path: Path) -> None:
    forklifts = load_map("forklifts")
    report = export_map(forklifts, tmp_path / "forklifts.geojson")
    assert "motion of 2 obstacles (written at their positions at 0 s)" in report.dropped
    moving = [shape for shape in forklifts.obstacles if shape.path is not None]
    others = [shape for shape in forklifts.obstacles if shape.path is None]
    single = replace(forklifts, obstacles=(*others, moving[0]))
    report = export_map(single, tmp_path / "forklift.geojson")
    assert "motion of 1 obstacle (written at its position at 0 s)" in report.dropped
    without_paths = export_map(load_map("rooms"), tmp_path / "rooms.geojson")
    assert not any("motion" in line for line in without_paths.dropped)
