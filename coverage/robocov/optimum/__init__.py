"""The centralised reference: the best places for a team that knows the whole map."""

from __future__ import annotations

from robocov.optimum.search import MOST_RESTARTS, MOST_ROBOTS, Optimum, optimum

__all__ = ["MOST_RESTARTS", "MOST_ROBOTS", "Optimum", "optimum"]
