"""Conversion of a foreign map to an `environment`: cleaning, boundary, obstacles and starts."""
