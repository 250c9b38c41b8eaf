"""How a format to write is chosen; and out and in again changes less than a row of cells."""

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


def test_every_format_says_what_it_is() -> None:
    known = {field.name for field in fields(WriteOptions)}
    for name, one in EXPORTERS.items():
        assert one.name == name
        assert one.title and one.suffixes
        assert one.options <= known
        path = Path(f"a{one.suffixes[0]}")
        assert one.list_files(path, WriteOptions())[0] == path
        assert choose_exporter(path) is one
        assert choose_exporter("anything", name) is one


def test_what_is_not_known(tmp_path: Path) -> None:
    with pytest.raises(
        ParameterError, match=r"a\.xyz: unknown format, expected a file ending in one of \.yaml, .*\.png"
    ):
        export_map(ROOM, "a.xyz")
    with pytest.raises(ParameterError, match="unknown format 'rosy': did you mean 'ros'"):
        export_map(ROOM, "a.yaml", format="rosy")
    with pytest.raises(
        ParameterError, match="--mode: no option of the format image, whose options are: --cell"
    ):
        export_map(ROOM, tmp_path / "a.png", options=WriteOptions(mode="raw"))
    for options, expected in (
        ({"cell": 0.0}, "cell: expected a number from 1e-06 to 10000 m, got 0.0"),
        ({"mode": "binary"}, "mode: expected one of trinary, scale, raw"),
        ({"image": "bmp"}, "image: expected one of pgm, png, got 'bmp'"),
        ({"digits": 99}, "digits: expected a number from 0 to 12, got 99"),
        ({"scale": float("nan")}, "scale: expected a number from"),
    ):
        with pytest.raises(ParameterError, match=expected):
            WriteOptions(**options)  # type: ignore[arg-type]


places = st.tuples(st.floats(0.3, 7.7), st.floats(0.3, 5.7))
obstacles: st.SearchStrategy[Obstacle] = st.one_of(
    st.builds(CircleObstacle, places, st.floats(0.15, 0.9)),
    st.builds(
        lambda at, size, turn: PolygonObstacle(
            tuple(shapely.get_coordinates(
                shapely.affinity.rotate(shapely.box(*at, at[0] + size[0], at[1] + size[1]), turn)
            )[:-1].tolist())  # type: ignore[arg-type]
        ),
        places, st.tuples(st.floats(0.15, 2), st.floats(0.15, 2)), st.floats(0, 90),
    ),
    st.builds(
        lambda ends, width: WallObstacle(tuple(ends), width),
        st.lists(places, min_size=2, max_size=2, unique=True), st.floats(0.1, 0.3),
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
def test_out_and_in_again_changes_less_than_a_row_of_cells(
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
    form = {"scale": "ros", "raw": "ros", "png-of-ros": "ros"}.get(format_name, format_name)
    options = WriteOptions(
        cell=cell,
        mode=format_name if format_name in ("scale", "raw") else None,  # type: ignore[arg-type]
        image="png" if format_name == "png-of-ros" else None,
    )
    path = folder / f"drawn{EXPORTERS[form].suffixes[0]}"
    written = export_map(environment, path, options=options)
    read = ReadOptions(cell=cell) if form == "movingai" else ReadOptions()
    try:
        back, _, foreign = import_map(path, options=read, shaping=Shaping(keep="all", specks=0.0))
    except MapError as error:
        assert "no position has enough clearance" in str(error)
        return
    row = cell * environment.free.length
    assert abs(written.area_written - environment.free_area) < 0.5 * row
    assert abs(foreign.free.area - environment.free_area) < 0.5 * row
    assert abs(back.free_area - environment.free_area) < row
    if form != "movingai":
        assert back.free.symmetric_difference(environment.free).area < row
    # what comes back once comes back the same, to half a cell of its walls
    again = folder / f"again{EXPORTERS[form].suffixes[0]}"
    export_map(back, again, options=options)
    twice, _, _ = import_map(again, options=read, shaping=Shaping(keep="all", specks=0.0))
    assert abs(twice.free_area - back.free_area) < row


PLACES = {
    "the equator": (-78.5, 0.0), "the north": (8.4, 49.0), "the south": (151.2, -33.9),
    "the antimeridian": (179.9999, 60.0), "a pole": (30.0, -89.0),
}  # fmt: skip
FORMATS: dict[str, tuple[str, WriteOptions]] = {
    "ROS": (".yaml", WriteOptions()),
    "MovingAI": (".map", WriteOptions()),
    "a picture": (".png", WriteOptions()),
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
def test_maps_go_out_and_in(tmp_path: Path, name: str, format_name: str) -> None:
    environment = get_map(name)
    (suffix, options) = FORMATS[format_name]
    path = tmp_path / f"map{suffix}"
    read = ReadOptions()
    if "cell" in choose_exporter(path).options:
        # blocks stand a whole number of their own cells apart: coarser ones all err to the same side
        options = replace(options, cell=0.02 if name == "generated blocks" else 0.05)
        read = ReadOptions(cell=options.cell) if suffix == ".map" else read
    report = export_map(environment, path, options=options)
    back, _, _ = import_map(path, options=read)
    assert back.free.is_valid
    assert back.free_area == pytest.approx(environment.free_area, rel=0.005)
    assert len(find_center_regions(back.free, DEFAULT_RADIUS_M)) == len(
        find_center_regions(environment.free, DEFAULT_RADIUS_M)
    )
    drawn = [back.boundary_polygon, *(shape.polygon for shape in back.obstacles), *back.free.geoms]
    for ring in shapely.get_rings(drawn):
        assert np.hypot(*np.diff(shapely.get_coordinates(ring), axis=0).T).min() >= 1e-3
    assert report.warnings == ()


def test_a_map_around_a_pole_is_refused(tmp_path: Path) -> None:
    size = 130_000.0
    corners = ((-size, -size), (size, -size), (size, size), (-size, size))
    with pytest.raises(ParameterError, match=r"origin: \(0, 89\): the map would span half of all longitudes"):
        export_map(
            Environment("arctic", corners), tmp_path / "a.geojson", options=WriteOptions(origin=(0, 89))
        )
    assert list(tmp_path.iterdir()) == []


def test_paths_of_obstacles_are_told_to_be_dropped(tmp_path: Path) -> None:
    report = export_map(load_map("forklifts"), tmp_path / "forklifts.geojson")
    assert "the 2 paths of obstacles, which stand where they are at time zero" in report.dropped
    standing = export_map(load_map("rooms"), tmp_path / "rooms.geojson")
    assert not any("path" in line for line in standing.dropped)
