"""Formats of coordinates on the globe: GeoJSON, OpenStreetMap and IMDF, and their common parts."""
