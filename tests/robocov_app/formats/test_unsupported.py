"""Files of unsupported formats: messages name the format and what to do."""

import gzip
import io
import json
import pickle
import struct
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fuzz_seeds import MAP, SEEDS
from PIL import Image

from robocov.errors import MapError
from robocov_app.formats import detect_format
from robocov_app.formats.unsupported import describe_unsupported_file

XML = b'<?xml version="1.0" encoding="UTF-8"?>\n<!-- a comment -->\n'


def build_zip() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.txt", "a")
    return stream.getvalue()


def build_tar() -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        archive.addfile(tarfile.TarInfo("a"))
    return stream.getvalue()


def build_picture(kind: str) -> bytes:
    stream = io.BytesIO()
    Image.new("L", (2, 2)).save(stream, kind)
    return stream.getvalue()


def build_npy() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.zeros(3))
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.json", b"", "empty"),
        ("a.json", json.dumps(MAP, indent=1).encode(), "a map of robocov already: use it directly"),
        ("run.json", b'{"format": "robocov-run", "version": 1}', "a robocov result: use robocov replay"),
        ("a.json", b'{"format": "robocov-study"}', "a file of robocov, but not a map: "),
        ("a b.shp", struct.pack(">7i", 9994, *[0] * 6), "a shapefile, .*: ogr2ogr .* 'a b.shp'$"),
        ("a.dbf", b"\x03\x5f\x07\x1a", "a part of a shapefile, .* ogr2ogr .* out.geojson a.shp$"),
        ("a.gpkg", b"SQLite format 3\0" + b"\0" * 52 + b"GPKG", "a GeoPackage, .*: ogr2ogr"),
        ("a.db3", b"SQLite format 3\0" + b"\0" * 56, "an SQLite database, .*: play a ROS 2 bag"),
        ("a.kml", XML + b'<kml xmlns="http://www.opengis.net/kml/2.2">', "KML, .*: ogr2ogr"),
        ("a.gpx", b"\xef\xbb\xbf" + XML + b"<gpx>", "GPX, .*: ogr2ogr"),
        ("a.gml", XML + b"<gml:FeatureCollection>", "GML, .*: ogr2ogr"),
        ("a.osm.pbf", b"\0\0\0\x0e\x0a\x09OSMHeader", "OpenStreetMap in PBF format, .*: osmium cat"),
        ("a.world", XML + b'<sdf version="1.6"><world>', "a Gazebo world .SDF., .*map_saver"),
        ("a.urdf", b'<robot name="a">', "a 3D model of a robot .*map_saver"),
        ("a.wbt", b"#VRML_SIM R2023b utf8", "a 3D world .VRML, Webots.,"),
        ("a.pdf", b"%PDF-1.4", "a PDF, .*: pdftocairo -svg a.pdf out.svg"),
        ("a.dwg", b"AC1032\0\0", "a DWG, .*: save it as DXF, or dwg2dxf a.dwg"),
        ("a.dxf", b"AC1.50\0\0", "a DWG"),
        ("a.ifc", b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));", "a building model .IFC., .*IfcConvert"),
        ("a.step", b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AP214'));", "a 3D model .STEP.,"),
        ("a.stl", b"solid a\n facet normal 0 0 1\n", "a mesh .STL., .*: cut it at the height"),
        ("a.stl", bytes(80) + struct.pack("<I", 1) + bytes(50), "a mesh .STL.,"),
        ("a.obj", b"# a\nmtllib a.mtl\no a\nv 1.0 2 3\nv 1 2 3\n", "a mesh .OBJ.,"),
        ("a.dae", XML + b"<COLLADA>", "a mesh .COLLADA.,"),
        ("a.ply", b"ply\nformat ascii 1.0", "a mesh .PLY, glTF.,"),
        ("a.pcd", b"# .PCD v0.7", "a point cloud,"),
        ("a.bt", b"# Octomap OcTree binary file", "an OctoMap octree, .*octomap_server"),
        ("a.bag", b"#ROSBAG V2.0\n", "a ROS bag, .*map_saver"),
        ("a.mcap", b"\x89MCAP0\r\n", "a ROS bag,"),
        ("a.gif", build_picture("GIF"), "an image, .*: save it as a PNG"),
        ("a.webp", build_picture("WEBP"), "an image,"),
        *(("a.pkl", pickle.dumps([1, 2], protocol), "a Python pickle,") for protocol in (2, 3, 4, 5)),
        ("a.npy", build_npy(), "a NumPy array,"),
        ("a.zip", build_zip(), "a zip archive, .*: unpack it first"),
        ("a.svg.gz", gzip.compress(b"<svg/>", mtime=0), "a compressed file, .*: unpack it first"),
        ("a.tar", build_tar(), "a compressed file,"),
        ("plan.svg", b"<!DOCTYPE html>\n<html><svg>", "a web page, not the file itself, .*raw file"),
        ("plan.dxf", b"version https://git-lfs.github.com/spec/v1", "a Git LFS pointer,"),
        ("a.xyz", b"Once upon a time there was a map", "text that begins with 'Once upon a time"),
        ("a.xyz", b"\0\1\2", "binary data that begins with"),
    ],
    ids=lambda value: value if isinstance(value, str) else "-",
)  # fmt: skip
def test_unsupported_formats_are_recognized(tmp_path: Path, name: str, content: bytes, expected: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MapError, match=expected) as caught:
        detect_format(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("target", [name for name in SEEDS if name not in ("map", "check", "study")])
def test_supported_formats_are_not_reported_as_unsupported(target: str) -> None:
    for case in SEEDS[target]:
        assert describe_unsupported_file(Path(case.main), case.files[case.main]) is None


@pytest.mark.parametrize("piece", [b"<!a>", b"<!--", b"<?", b" ", b"#\n", b'{"format"', b"solid ", b"v 1 "])
def test_the_length_of_the_head_does_not_matter(piece: bytes) -> None:
    path = Path("a.txt")
    assert describe_unsupported_file(path, piece * (2**20 // len(piece))) == describe_unsupported_file(
        path, piece * 8
    )
