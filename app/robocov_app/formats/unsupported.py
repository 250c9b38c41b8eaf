"""Kinds of files that no importer reads, and how to convert each of them to a file that can be read."""

import re
import shlex
from pathlib import Path

from robocov.errors import quote

_XML = r"(?:\xef\xbb\xbf)?(?>\s+|<\?.*?\?>|<!--.*?-->|<![^>]*>)*+<(?:\w+:)?"
_OGR = "ogr2ogr -f GeoJSON out.geojson {name}"
_SLICE = "cut it at the height of the robots' sensors and save the outline as DXF or SVG"
_ROS_MAP = "drive a robot through it, or open it in RViz, and save a map with map_saver"
_UNPACK = "unpack it first"
_PNG = "save it as a PNG"
_FORMAT = r"\s*\{[^{}\[\]]*\"format\"\s*:\s*\"robocov-"
# Pattern of the first bytes of a file, its kind, and how to get a map from it. The first match counts.
_KINDS = [
    (r"\Z", "empty", "is it the right file?"),
    (_FORMAT + r"map\"", "a map of robocov already", "use it directly with robocov check, run and edit"),
    (_FORMAT + r"(?:run|comparison)\"", "a robocov result", "use robocov replay with its folder"),
    (_FORMAT, "a file of robocov, but not a map", "use robocov report for folders of results"),
    (r"\0\0'\x0a", "a shapefile", _OGR),
    (r"SQLite format 3\0.{52}GP", "a GeoPackage", _OGR),
    (r"SQLite format 3\0", "an SQLite database", "play a ROS 2 bag and save its map with map_saver"),
    (_XML + r"kml\b", "KML", _OGR),
    (_XML + r"gpx\b", "GPX", _OGR),
    (_XML + r"(?:FeatureCollection|CityModel)\b", "GML", _OGR),
    (r".{4,16}OSMHeader", "OpenStreetMap in PBF format", "osmium cat {name} -o out.osm"),
    (_XML + r"(?:sdf|gazebo|world)\b", "a Gazebo world (SDF)", _ROS_MAP),
    (_XML + r"(?:robot|mujoco|Webots\w*)\b", "a 3D model of a robot or a world", _ROS_MAP),
    (r"#VRML|#VRML_SIM|#X3D", "a 3D world (VRML, Webots)", _ROS_MAP),
    (_XML + r"COLLADA\b", "a mesh (COLLADA)", _SLICE),
    (r"solid\s.*?\bfacet\b", "a mesh (STL)", _SLICE),
    (r"(?>\s+|#[^\n]*|mtllib[^\n]*|[og] [^\n]*)*+v(?:\s+[-+\d.eE]+){3,}\s*\n", "a mesh (OBJ)", _SLICE),
    (r"ply\r?\n|glTF", "a mesh (PLY, glTF)", _SLICE),
    (r"# \.PCD|LASF", "a point cloud", "convert it to a ROS map"),
    (r"# Octomap OcTree", "an OctoMap octree", "octomap_server converts it to a ROS map"),
    (r"#ROSBAG|\x89MCAP", "a ROS bag", "play it and save its map with map_saver"),
    (r"ISO-10303-21;.{0,4000}?IFC", "a building model (IFC)", "IfcConvert {name} out.svg"),
    (r"ISO-10303-21;", "a 3D model (STEP)", _SLICE),
    (r"AC1[0-9.][0-9.]\d|AC2\.\d", "a DWG", "save it as DXF, or dwg2dxf {name}"),
    (r"%PDF-", "a PDF", "pdftocairo -svg {name} out.svg, or pdftoppm -png for a scan"),
    (r"%!PS", "PostScript", "ps2pdf {name}, then pdftocairo -svg"),
    (r"GIF8|RIFF.{4}WEBP|\0\0\0.jP  |.{4}ftyp(?:heic|avif|mif1)|8BPS|gimp xcf", "an image", _PNG),
    (r"\x80[\x02-\x05][\x95\x8c\]}(cK]", "a Python pickle", "save its polygons as GeoJSON or WKT"),
    (r"\x93NUMPY", "a NumPy array", "save it as an image"),
    (r"version https://git-lfs", "a Git LFS pointer, not the file itself", "git lfs pull"),
    (_XML + r"html\b", "a web page, not the file itself", "download the raw file"),
    # except for IMDF, which `robocov_app.formats.geodata.imdf` reads
    (r"PK\x03\x04(?!.*?(?:unit|level|opening|venue)\.geojson)", "a zip archive", _UNPACK),
    (r"\x1f\x8b|BZh\d|\xfd7zXZ|7z\xbc\xaf|\x28\xb5\x2f\xfd|.{257}ustar", "a compressed file", _UNPACK),
]  # fmt: skip
_FLAGS = re.DOTALL | re.IGNORECASE
_TABLE = [(re.compile(start.encode("latin-1"), _FLAGS), kind, advice) for start, kind, advice in _KINDS]
_SHAPEFILE_SUFFIXES = (".dbf", ".shx", ".prj", ".cpg")
_STL_HEADER_BYTES = 84
"""Size of the header of a binary STL: 80 arbitrary bytes and the number of triangles."""


def describe_unsupported_file(path: Path, head: bytes) -> str | None:
    """Return the kind of an unsupported file, and a way to convert it.

    Parameters
    ----------
    path : Path
    head : bytes
        First bytes of the file.

    Returns
    -------
    str or None
        None if the kind is unknown here, in which case an importer may be able to read the file.
    """
    name = shlex.quote(path.name)
    suffix = path.suffix.lower()
    for start, kind, advice in _TABLE:
        if start.match(head):
            return _format_advice(kind, advice, name)
    if suffix == ".stl" and len(head) > _STL_HEADER_BYTES:
        return _format_advice("a mesh (STL)", _SLICE, name)
    if suffix in _SHAPEFILE_SUFFIXES:
        return _format_advice("a part of a shapefile", _OGR, shlex.quote(path.with_suffix(".shp").name))
    return None


def _format_advice(kind: str, advice: str, name: str) -> str:
    """Return the message about a file: its kind, and how to convert the file called `name`."""
    remark = "" if "robocov" in kind else ", which cannot be imported"
    return f"{kind}{remark}: {advice.format(name=name)}"


def describe_head(head: bytes) -> str:
    """Describe a file of unknown kind for a message, by its first characters or bytes."""
    text = head[:1000].decode(errors="replace")
    is_binary = "\0" in text or text.count("\ufffd") > 1
    if is_binary:
        return f"binary data that begins with {quote(head[:20])}"
    return f"text that begins with {quote(text[:20])}"
