"""Formats with coordinates on the globe: GeoJSON, OpenStreetMap and IMDF, and their shared code."""
