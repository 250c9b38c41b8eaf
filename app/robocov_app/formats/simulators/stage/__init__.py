"""Worlds of Stage: words and includes (`tokens`), models and macros (`entities`), `placement`, `reading`."""

from robocov_app.formats.simulators.stage.reading import read, sniff

__all__ = ["read", "sniff"]
