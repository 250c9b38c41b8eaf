"""The exchange of scans by messages, from which each robot builds its map.

Robots send three kinds of messages, each to all robots in communication range:

- *Scans* (`NumberedScan`). A robot sends each of its own scans once, when it takes it: 542 bytes for 240
  rays.
- *Digests* (`Digest`). With each scan, a robot sends a list of the scans that it has, and a list of its
  neighbors: 8 bytes, plus 12 bytes and 1 bit for each robot of the team.
- *Repairs*. If a digest shows that a neighbor lacks scans that a robot has, its own or received ones, the
  robot sends these again: at most `MAX_REPAIRS` for each scan that it takes.

In this way, lost scans are sent again, scans reach robots out of range over several hops, and robots that
meet again exchange the scans that they have missed. A robot never sends more than the conditions allow.
Messages that cannot be sent before the next scan are dropped; their scans are sent later as repairs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from robocov.controllers.base import TIME_TOLERANCE_S
from robocov.observation import Message, Observations, Scans
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.scan_log import Inventory, NumberedScan, ScanLog, number_scans
from robocov.typing import BoolArray

MAX_REPAIRS = 16
"""Maximum number of scans that a robot sends again for each scan that it takes."""

_TIME_BYTES = 8
"""Size of the time of a digest."""
_INVENTORY_BYTES = 12
"""Size of the inventory of one robot's scans: 4 bytes for the first missing one, 8 for 64 later ones."""
_MAX_REPAIR_MEMORY_S = 30.0
"""Time for which a robot remembers which scans it has sent again."""


@dataclass(frozen=True, slots=True, eq=False)
class Digest:
    """Report of a robot about the scans that it has. Immutable.

    Attributes
    ----------
    time : float, s
        Time at which the digest was sent.
    inventory : Inventory
        The scans that the robot has.
    is_neighbor : (n,) bool array
        Whether each robot is a neighbor, from which messages arrive.
    """

    time: float
    inventory: Inventory
    is_neighbor: BoolArray

    @property
    def size(self) -> int:
        """Size of a message with the digest, bytes.

        Examples
        --------
        >>> inventory = Inventory(np.zeros(6, dtype=np.intp), np.zeros((6, 64), dtype=bool))
        >>> Digest(0.0, inventory, np.ones(6, dtype=bool)).size
        81
        """
        robot_count = len(self.is_neighbor)
        return _TIME_BYTES + _INVENTORY_BYTES * robot_count + math.ceil(robot_count / 8)


class ReceivedDigest(NamedTuple):
    """The newest digest of another robot."""

    digest: Digest
    delay: float
    """Time between sending and arrival, s."""


@dataclass(frozen=True, eq=False)
class RobotExchange:
    """State of the exchange of one robot. Immutable."""

    log: ScanLog
    own_scan: NumberedScan | None = None
    """Newest scan of the robot. It enters the log in the next step, when scans of others arrive at the
    earliest."""
    own_inventory: Inventory | None = None
    """The inventory in the robot's newest digest."""
    digests: Mapping[int, ReceivedDigest] = field(default_factory=dict)
    """The newest digest that has arrived from each robot, by its index. Never changed in place."""
    repair_times: Mapping[tuple[int, int], float] = field(default_factory=dict)
    """Times at which the robot last sent scans again, s, by owner and round of the scan. Never changed in
    place."""
    outgoing: tuple[Message, ...] = ()
    """Messages that the robot has not been able to send yet."""

    def __deepcopy__(self, memo: object) -> RobotExchange:
        # Copies share the object, because it never changes.
        return self


@dataclass(frozen=True, eq=False)
class ScanExchange:
    """The exchange of scans in a team. Immutable.

    Attributes
    ----------
    robots : tuple of RobotExchange
        State of each robot. Entry i depends only on what robot i knows.
    round_count : int
        Number of scans that each robot has taken.
    """

    robots: tuple[RobotExchange, ...]
    round_count: int = 0

    @classmethod
    def build_empty(
        cls, unknown_map: DiscoveredMap, robot_count: int, robot_radii: Sequence[float | None]
    ) -> ScanExchange:
        """Build the exchange of robots that have no scans yet.

        Parameters
        ----------
        unknown_map : DiscoveredMap
        robot_count : int
            Number of robots n.
        robot_radii : sequence of float or None, m
            Radius around the position of each scan within which robot i marks the cells of its map as free.
            None: it marks only the cells that rays pass through.

        Returns
        -------
        ScanExchange
        """
        logs = {radius: ScanLog.build_empty(robot_count, unknown_map, radius) for radius in set(robot_radii)}
        return cls(tuple(RobotExchange(logs[radius]) for radius in robot_radii))

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map of each robot after its last update."""
        return tuple(state.log.known_map for state in self.robots)

    @property
    def has_scans(self) -> bool:
        """Whether the robots have at least the first scan of their own."""
        return all(len(state.log.rounds) > 0 for state in self.robots)

    def receive(self, seen: Observations) -> ScanExchange:
        """Return the exchange after the messages of a step have arrived.

        Parameters
        ----------
        seen : Observations

        Returns
        -------
        ScanExchange
        """
        has_own_scans = any(state.own_scan is not None for state in self.robots)
        if not (seen.messages or has_own_scans):
            return self
        states = []
        logs: dict[tuple[int, ...], ScanLog] = {}
        for robot, state in enumerate(self.robots):
            payloads = [message.payload for message in seen.get_messages(robot)]
            scans = [payload for payload in payloads if isinstance(payload, NumberedScan)]
            if state.own_scan is not None:
                scans.append(state.own_scan)
            if scans:
                # Robots with the same log that receive the same scans share the next log.
                scans.sort(key=attrgetter("round_number", "robot"))
                key = (id(state.log), *map(id, scans))
                if key not in logs:
                    logs[key] = state.log.add(scans)
                state = replace(state, log=logs[key], own_scan=None)
            states.append(_add_digests(state, seen, robot))
        return replace(self, robots=tuple(states))

    def update_maps(self, robots: Sequence[int]) -> ScanExchange:
        """Return the exchange in which the maps of some robots contain all scans that these robots have.

        Robots with equal maps share one map object, so that results computed from it can be shared as well.

        Parameters
        ----------
        robots : sequence of int
            Indices of the robots.

        Returns
        -------
        ScanExchange
        """
        states = list(self.robots)
        updated_logs: dict[int, ScanLog] = {}
        maps_by_content: dict[bytes, DiscoveredMap] = {}
        for robot in robots:
            log = states[robot].log
            if id(log) not in updated_logs:
                updated = log.update_map()
                if updated.known_map is not log.known_map:
                    content = updated.known_map.state.tobytes()
                    shared_map = maps_by_content.setdefault(content, updated.known_map)
                    updated = updated.share_map(shared_map)
                updated_logs[id(log)] = updated
            states[robot] = replace(states[robot], log=updated_logs[id(log)])
        return replace(self, robots=tuple(states))

    def add_scans(self, seen: Observations, scans: Scans) -> ScanExchange:
        """Return the exchange with a new scan of each robot, and with the messages to send after it.

        Parameters
        ----------
        seen : Observations
        scans : Scans
            The scans in these observations.

        Returns
        -------
        ScanExchange
        """
        own_scans = number_scans(
            scans, seen.positions, seen.region, round_number=self.round_count, time=seen.time
        )
        robot_count = len(own_scans)
        states = []
        for robot, own_scan in enumerate(own_scans):
            state = replace(self.robots[robot], own_scan=own_scan)
            if robot_count > 1:
                state = _prepare_messages(state, seen, robot, own_scan)
            states.append(state)
        return ScanExchange(tuple(states), self.round_count + 1)

    def add_message(self, robot: int, message: Message) -> ScanExchange:
        """Return the exchange with a message of another kind, which a robot sends before all others.

        Parameters
        ----------
        robot : int
        message : Message
            It replaces an earlier message of the same kind that has not been sent yet.

        Returns
        -------
        ScanExchange
        """
        kind = type(message.payload)
        state = self.robots[robot]
        others = [waiting for waiting in state.outgoing if not isinstance(waiting.payload, kind)]
        states = list(self.robots)
        states[robot] = replace(state, outgoing=(message, *others))
        return replace(self, robots=tuple(states))

    def neighbors_reach_all(self, robot: int, neighbors: Sequence[int]) -> bool:
        """Return whether each neighbor of a robot has all others as neighbors, as its newest digest says.

        Parameters
        ----------
        robot : int
        neighbors : sequence of int

        Returns
        -------
        bool
        """
        digests = self.robots[robot].digests
        other_count = len(self.robots) - 1
        return all(
            neighbor in digests and np.count_nonzero(digests[neighbor].digest.is_neighbor) == other_count
            for neighbor in neighbors
        )

    def send(self, seen: Observations) -> tuple[ScanExchange, tuple[tuple[Message, ...], ...]]:
        """Return the outgoing messages that the robots can send in this step, and the exchange without them.

        Parameters
        ----------
        seen : Observations

        Returns
        -------
        exchange : ScanExchange
            The exchange without these messages.
        messages : tuple of tuple of Message
            The messages of each robot; empty if no robot sends any.
        """
        if not any(state.outgoing for state in self.robots):
            return self, ()
        states = []
        messages = []
        for robot, state in enumerate(self.robots):
            limit = np.inf if seen.send_limits is None else float(seen.send_limits[robot])
            count = _count_sendable(state.outgoing, limit)
            messages.append(state.outgoing[:count])
            states.append(replace(state, outgoing=state.outgoing[count:]))
        return replace(self, robots=tuple(states)), tuple(messages)


def _add_digests(state: RobotExchange, seen: Observations, robot: int) -> RobotExchange:
    """Return the state of a robot with the digests that have arrived in a step."""
    digests = {
        message.sender: ReceivedDigest(message.payload, seen.time - message.payload.time)
        for message in seen.get_messages(robot)
        if isinstance(message.payload, Digest)
    }
    if not digests:
        return state
    return replace(state, digests={**state.digests, **digests})


def _prepare_messages(
    state: RobotExchange, seen: Observations, robot: int, own_scan: NumberedScan
) -> RobotExchange:
    """Return the state of a robot with the messages to send after a new scan: scan, digest and repairs.

    They replace the messages of these kinds that have not been sent yet.
    """
    neighbors = seen.neighbors.list_neighbors(robot).tolist()
    is_neighbor = np.zeros(len(seen.positions), dtype=bool)
    is_neighbor[neighbors] = True
    digest = Digest(seen.time, state.log.inventory, is_neighbor)
    repairs = _choose_repairs(state, robot, neighbors)
    repair_times = state.repair_times
    if repairs:
        min_time = seen.time - _MAX_REPAIR_MEMORY_S
        remembered_times = {key: time for key, time in repair_times.items() if time >= min_time}
        for scan in repairs:
            remembered_times[scan.robot, scan.round_number] = seen.time
        repair_times = remembered_times
    others = [message for message in state.outgoing if not isinstance(message.payload, NumberedScan | Digest)]
    outgoing = [*others, Message(own_scan, own_scan.size), Message(digest, digest.size)]
    outgoing += [Message(scan, scan.size) for scan in repairs]
    return replace(state, own_inventory=digest.inventory, outgoing=tuple(outgoing), repair_times=repair_times)


def _choose_repairs(state: RobotExchange, robot: int, neighbors: Sequence[int]) -> list[NumberedScan]:
    """Choose the scans that a robot sends again because neighbors lack them: the oldest ones first."""
    log = state.log
    chosen: dict[tuple[int, int], NumberedScan] = {}
    for neighbor in neighbors:
        received = state.digests.get(neighbor)
        if received is None or state.own_inventory is None:
            continue
        inventory = received.digest.inventory
        if inventory.equals(state.own_inventory):
            # The neighbor had the same scans. Those that this robot has received since then are too new for
            # the digest.
            continue
        is_missing = inventory.find_missing(log.is_present)
        for number, owner in np.argwhere(is_missing).tolist():
            scan = log.get_scan(owner, number)
            if _needs_repair(scan, state, received) and _is_responsible(scan, state, robot, received):
                chosen[number, owner] = scan
    return [chosen[key] for key in sorted(chosen)[:MAX_REPAIRS]]


def _needs_repair(scan: NumberedScan, state: RobotExchange, received: ReceivedDigest) -> bool:
    """Return whether a scan that is missing in a digest was lost.

    If it was sent too late to be in the digest, it may still arrive.
    """
    sent_time = state.repair_times.get((scan.robot, scan.round_number), scan.time)
    return sent_time + received.delay <= received.digest.time + TIME_TOLERANCE_S


def _is_responsible(scan: NumberedScan, state: RobotExchange, robot: int, received: ReceivedDigest) -> bool:
    """Return whether it is up to a robot to send a scan again to the sender of a digest.

    Only one robot should do so. Candidates are the neighbors of the sender that have the scan, as far as
    `robot` knows. The owner of the scan comes first, then the robots with the next higher indices, and then
    those from 0 on.
    """
    robot_count = len(received.digest.is_neighbor)
    for step in range(robot_count):
        candidate = (scan.robot + step) % robot_count
        if candidate == robot:
            return True
        if received.digest.is_neighbor[candidate] and _has_scan(candidate, scan, state):
            return False
    return False


def _has_scan(candidate: int, scan: NumberedScan, state: RobotExchange) -> bool:
    """Return whether a candidate is known to have a scan: its own, or one in its newest digest."""
    if candidate == scan.robot:
        return True
    received = state.digests.get(candidate)
    return received is not None and received.digest.inventory.contains(scan)


def _count_sendable(messages: Sequence[Message], limit: float) -> int:
    """Return how many of the first messages fit into a limit, in bytes.

    A first message that is larger than the limit can be sent alone.
    """
    if limit <= 0.0:
        return 0
    total = 0
    for count, message in enumerate(messages):
        total += message.size
        if total > limit:
            return max(count, 1)
    return len(messages)
