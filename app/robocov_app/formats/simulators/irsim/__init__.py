"""Worlds of IR-SIM: YAML values (`node`), the map (`reading`), its picture and the shapes of obstacles."""

from robocov_app.formats.simulators.irsim.reading import read, sniff

__all__ = ["read", "sniff"]
