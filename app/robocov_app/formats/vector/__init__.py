"""Formats of drawings and lists of polygons: SVG, DXF, well-known text, HouseExpo plans and rings."""
