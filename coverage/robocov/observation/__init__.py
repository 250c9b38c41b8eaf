"""What the robots know, and what they decide: the types between the world and the controllers."""

from __future__ import annotations

from robocov.observation.observations import Decision, Observations, Snapshot

__all__ = ["Decision", "Observations", "Snapshot"]
