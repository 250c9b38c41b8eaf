"""Teams whose cells change a lot, and the hues of their cells in the data of a replay."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from reported_results import build_record

from robocov import load_map
from robocov.environment import UniformStart
from robocov.record import Record


def build_moving_record(robots: int, seconds: float = 6.0) -> Record:
    """Build a record of robots that cross the map "rooms" between random positions."""
    environment = load_map("rooms")
    starts = {**environment.starts, "spread": UniformStart()}
    return build_record(replace(environment, starts=starts), robots=robots, seconds=seconds)


def list_hues(hues: dict[str, Any], steps: Iterable[int]) -> list[list[int]]:
    """Return the hue of each robot at some steps, from the content of `embed_hues`."""
    hues_by_step = []
    for step in steps:
        current = list(hues["first"])
        for since, robot, hue in hues["changes"]:
            if since <= step:
                current[robot] = hue
        hues_by_step.append(current)
    return hues_by_step
