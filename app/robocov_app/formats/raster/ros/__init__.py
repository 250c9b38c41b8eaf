"""ROS maps: `metadata` of the YAML, `classification` of pixels, `reading` and `writing`."""

from robocov_app.formats.raster.ros.reading import read, sniff
from robocov_app.formats.raster.ros.writing import list_files, write

__all__ = ["list_files", "read", "sniff", "write"]
