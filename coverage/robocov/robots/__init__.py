"""The team: what the robots are and what they can do; files that say so."""

from __future__ import annotations

from robocov.robots.team import DEFAULT_RADIUS, UNITS, Team

__all__ = ["DEFAULT_RADIUS", "UNITS", "Team"]
