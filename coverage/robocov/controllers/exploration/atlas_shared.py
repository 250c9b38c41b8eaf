"""`Atlas` with maps that robots in range of each other share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from robocov.controllers.exploration.atlas import Atlas
from robocov.controllers.exploration.atlas_memory import AtlasMemory
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.teammates import TeammateReport, Teammates, receive_reports
from robocov.observation import Message, Observations
from robocov.planning.discovered_map import DiscoveredMap
from robocov.team import Team


@dataclass(frozen=True)
class AtlasShared(Atlas):
    """`Atlas` with shared maps: robots send each other their scans, and the positions of other robots.

    If all robots receive each other's messages, they have the same map, and make the same plan for the whole
    team, however large it is. Relocations are then final, no robot plans for itself alone, and all robots
    learn from each viewpoint. A robot with some robots out of range behaves as with `Atlas`. It assumes that
    these robots are where one of its neighbors last received a message from them.

    Messages are those of the module `scan_exchange`, twice a second: 542 bytes for a scan, and with six
    robots 81 bytes for a digest of the scans that a robot has. A robot with a neighbor that is not in range
    of all others also sends a report with each plan: 28 bytes for each robot that it knows of.

    Parameters
    ----------
    period, threshold, nearby, rest, stake, patience, settling, clearance, k_prop, response_time
        See `Atlas`.

    See Also
    --------
    Atlas : The same controller without shared maps.

    Notes
    -----
    A robot that is stuck away from its goal for several plans is in a jam. It moves away from the robots
    around it for a while, each robot for a different time.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.run("square", rc.AtlasShared(), robots=2, duration=1.0)
    <Record atlas-shared on Square, 2 robots, 1.0 s>
    """

    name = "atlas-shared"
    label = "Atlas, shared maps"
    summary = "Atlas, with maps that robots within communication range share"
    information = "shared map"
    is_staggered = False

    def _build_exchange(self, unknown_map: DiscoveredMap, team: Team) -> ScanExchange:
        return ScanExchange.build_empty(unknown_map, len(team), robot_radii=team.radius.tolist())

    def _update_maps(self, seen: Observations, memory: AtlasMemory) -> AtlasMemory:
        """Return the memory with the scans and reports that have arrived. Plans update the maps later."""
        assert memory.exchange is not None
        exchange = memory.exchange.receive(seen)
        reports = memory.reports
        if seen.messages:
            reports = tuple(
                {**known_reports, **receive_reports(seen, robot)}
                for robot, known_reports in enumerate(memory.reports)
            )
        return replace(memory, exchange=exchange, reports=reports)

    def _list_due_robots(
        self, seen: Observations, memory: AtlasMemory, *, earliest_plan_time: float
    ) -> list[int]:
        assert memory.exchange is not None
        if not memory.exchange.has_scans:
            return []
        return super()._list_due_robots(seen, memory, earliest_plan_time=earliest_plan_time)

    def _plan_routes(self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]) -> AtlasMemory:
        assert memory.exchange is not None
        exchange = memory.exchange.update_maps(due_robots)
        states = list(memory.states)
        for robot in due_robots:
            states[robot] = replace(states[robot], known_map=exchange.maps[robot])
        memory = replace(memory, states=tuple(states), exchange=exchange)
        planned = super()._plan_routes(seen, memory, due_robots)
        # A plan uses the reports that have arrived since the last one.
        reports = list(memory.reports)
        for robot in due_robots:
            reports[robot] = {}
        return replace(planned, reports=tuple(reports))

    def _list_reports(self, seen: Observations, memory: AtlasMemory, robot: int) -> list[TeammateReport]:
        is_in_range_of_all = len(seen.neighbors.list_neighbors(robot)) == len(memory.states) - 1
        if is_in_range_of_all:
            return []
        return [report for _, report in sorted(memory.reports[robot].items())]

    def _send_messages(
        self, seen: Observations, memory: AtlasMemory, due_robots: Sequence[int]
    ) -> tuple[AtlasMemory, tuple[tuple[Message, ...], ...]]:
        exchange = memory.exchange
        assert exchange is not None
        for robot in due_robots:
            neighbors = seen.neighbors.list_neighbors(robot).tolist()
            teammates = memory.states[robot].knowledge.teammates
            # Robots in range of all others need no reports.
            if len(teammates.robots) > 0 and not exchange.neighbors_reach_all(robot, neighbors):
                report = teammates.build_report()
                exchange = exchange.add_message(robot, Message(report, report.size))
        if seen.scans is not None:
            exchange = exchange.add_scans(seen, seen.scans)
        exchange, messages = exchange.send(seen)
        return replace(memory, exchange=exchange), messages

    def _is_agreed(self, teammates: Teammates, seen: Observations, memory: AtlasMemory, robot: int) -> bool:
        # A robot in range of all others that it knows of has the same scans as they have.
        return bool((teammates.message_times == seen.time).all())
