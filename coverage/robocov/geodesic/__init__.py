"""Exact shortest distances in the free space of a map: d~ of equation (22)."""

from __future__ import annotations

from robocov.geodesic.distances import Geodesics

__all__ = ["Geodesics"]
