"""OpenStreetMap: `parsing` of files to `data`, and the map (`reading`) of the `outdoors` or `indoors`."""

from robocov_app.formats.geodata.osm.reading import read, sniff

__all__ = ["read", "sniff"]
