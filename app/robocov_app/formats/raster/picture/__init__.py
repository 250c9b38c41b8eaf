"""Pictures: `decoding` of files, `classification` of pixels as cells, `reading` of maps, and `writing`."""

from robocov_app.formats.raster.picture.brightness import Brightness, describe_transparency
from robocov_app.formats.raster.picture.decoding import is_picture, read_picture
from robocov_app.formats.raster.picture.reading import GEOREFERENCE_CHUNK, TITLE_CHUNK, read, sniff
from robocov_app.formats.raster.picture.writing import write

__all__ = [
    "GEOREFERENCE_CHUNK",
    "TITLE_CHUNK",
    "Brightness",
    "describe_transparency",
    "is_picture",
    "read",
    "read_picture",
    "sniff",
    "write",
]
