"""The controller interface: a law for the whole team, or one called for each robot in turn."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite
from typing import Any, ClassVar, Literal, Protocol, Self, TypeAlias, get_args, runtime_checkable

import numpy as np

from robocov.arrays import Array
from robocov.controllers.gains import choice, validate_gains
from robocov.controllers.user_modules import location_of
from robocov.environment import Environment
from robocov.errors import ParameterError, describe_unknown_name, quote
from robocov.observation import Decision, Observations, to_numbers
from robocov.observation.region import Region
from robocov.team import Team
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time
from robocov.voronoi.delaunay import Mesh

Information: TypeAlias = Literal["own", "shared map", "whole map"]
"""Information class of a law: what the robot itself senses and hears; maps, and where they last heard others,
that neighbours tell each other as well; or the whole map from the beginning."""


@runtime_checkable
class Controller(Protocol):
    """A control law: a frozen dataclass of gains, without state of its own.

    Row i of a decision may depend only on what robot i knows (see `robocov.observation`). Whatever the robots
    remember goes through `Decision.memory`; a run can therefore be copied, rewound and branched.

    Optional are

    - the class variable ``information``, one of `Information`, "own" where it is not stated,
    - the attribute ``scanning``, a `robocov.observation.Scanning`, of laws that want ray scans, and
    - the method ``informed(environment) -> Controller``, which only laws with the whole map have: it
      returns the law that knows that map, with the same gains.
    """

    @property
    def name(self) -> str:
        """As it is given on the command line."""

    @property
    def label(self) -> str:
        """As it is shown to people."""

    @property
    def summary(self) -> str:
        """One line."""

    def begin(self, region: Region, team: Team) -> Any:
        """Return what the robots remember before the first decision."""

    def decide(self, seen: Observations, memory: Any) -> Decision:
        """Return the forces for all robots, from what each of them knows."""


def information_of(controller: Any) -> Information:
    """Return what a controller, or a class of controllers, goes by, or raise a ParameterError."""
    # a law for one robot stands in an adapter
    stated: Information = getattr(getattr(controller, "law", controller), "information", "own")
    if stated not in get_args(Information):
        name, words = getattr(controller, "name", "?"), ", ".join(get_args(Information))
        told = f"information: {quote(stated)}, but one of {words} was wanted"
        raise ParameterError(f"controller {name!r}: {told}")
    return stated


def informed(controller: Controller, environment: Environment) -> Controller:
    """Return the controller, told the map if it goes by it; a ParameterError if it asks without saying so."""
    information, tell = information_of(controller), getattr(controller, "informed", None)
    if tell is None:
        return controller
    if information != "whole map":
        told = f"it has a method informed(environment), but its information is {information!r}"
        raise ParameterError(f"controller {controller.name!r}: {told}; 'whole map' was wanted")
    known: Controller = tell(environment)
    if isinstance(known, type) or not isinstance(known, Controller):
        got = f"returned {quote(known)}{location_of(tell)}, expected a controller"
        raise ParameterError(f"controller {controller.name!r}: informed(environment) {got}")
    return known


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """Memory of the robots."""

    team: Team  # a robot knows its own body and limits
    returns: Array | None = None  # (n, rays, 2) m, what the last scan of each met
    triangulation: Mesh | None = None  # from which the next cells start


class Law:
    """Base class of the built-in controllers, which are dataclasses: their gains are checked."""

    name: ClassVar[str]
    label: ClassVar[str]
    summary: ClassVar[str]
    information: ClassVar[Information] = "own"
    memory: ClassVar[type[Memory]] = Memory

    def __new__(cls, *_: Any, **gains: Any) -> Self:
        """Return it; a ParameterError on a gain that it has not, with the nearest name."""
        known = [each.name for each in fields(cls) if each.init] if is_dataclass(cls) else gains
        for name in gains:
            if name not in known:
                raise ParameterError(f"{cls.name}: {describe_unknown_name('gain', name, known)}")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        validate_gains(self)

    def begin(self, region: Region, team: Team) -> Any:
        """Return what the robots know of themselves."""
        return self.memory(team)


def choice_of_cells() -> Any:
    """Declare the gain that says by what the cells of a law are divided, as a dataclass field."""
    what = "whose a place is: the nearest robot's, or the one's that is there first at its own largest speed"
    return choice("distance", ("distance", "time"), what)


def cells_seen(seen: Observations, measure: str, warm: Mesh | None) -> VoronoiPartition | WeightedCells:
    """Return each robot's cell as it knows it, by "distance" or "time", starting from a triangulation.

    By time the cells are multiplicatively weighted, with the speeds that robots tell each other; where all
    are equally fast, or no speed is told, they are the same as by distance, bit for bit.
    """
    known = seen.region, seen.neighbours, warm, seen.reported_positions, seen.density
    if measure == "time" and seen.max_speeds is not None:
        return partition_by_travel_time(seen.positions, seen.max_speeds, *known)
    return partition(seen.positions, *known)


@dataclass(eq=False)
class OwnView:
    """All that one robot knows: what it senses and hears, and the convex outer boundary."""

    number: int  # its own, from 0
    position: Array  # (2,) m
    velocity: Array  # (2,) m/s
    neighbours: Array  # (k, 2) m, of the robots that it hears, as the last message of each has it
    obstacle_point: Array | None  # (2,) m, the closest obstacle or boundary point in sensing range
    region: Region
    time: float  # s
    _cells: VoronoiPartition
    heading: float | None = None  # rad from +x, of a unicycle; None in a team of points
    memory: Any = None
    """Memory of the robot: what the law's ``begin`` returned, or what it assigned here in the last step."""

    @property
    def centroid(self) -> Array:
        """Centroid of the robot's Voronoi cell, (2,) m."""
        return np.asarray(self._cells.centroid[self.number])

    @property
    def cell(self) -> Array:
        """The robot's Voronoi cell, (k, 2) m counter-clockwise."""
        return self._cells.polygons[self.number]


@runtime_checkable
class IndividualController(Protocol):
    """A law for one robot: one method from what it knows to the force that it wants.

    Optional is ``begin(number, team)``: it returns what the robot of that number, from 0, remembers at the
    start. The law finds it in ``own.memory``, and may assign there what is to be remembered next.
    """

    def force(self, own: OwnView) -> Sequence[float] | Array:
        """Return the force in newtons, two numbers."""


def for_team(law: Any) -> Any:
    """Return a law for one robot as a controller for the team, and any other as it is."""
    one = isinstance(law, IndividualController) and not isinstance(law, type) and not hasattr(law, "decide")
    return Individually(law) if one else law


@dataclass(frozen=True, slots=True, eq=False)
class Memories:
    """Memories of the robots of an individual law."""

    own: Sequence[Any]
    triangulation: Mesh | None = None  # from which the next cells start


class Individually:
    """Makes a controller for the team of a law for one robot: it is asked for every robot in turn.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Home:
    ...     stiffness: float = 0.5
    ...     def force(self, own):
    ...         return self.stiffness * (own.centroid - own.position)
    >>> Individually(Home()).name
    'Home'
    """

    def __init__(self, law: IndividualController) -> None:
        self.law, kind = law, type(law)
        self.name = str(getattr(law, "name", kind.__name__))
        self.label = str(getattr(law, "label", self.name))
        self.summary = str(getattr(law, "summary", (kind.__doc__ or "").strip().split("\n")[0]))

    def begin(self, region: Region, team: Team) -> "Memories":
        """Return what each robot remembers at the start, by the law's own ``begin`` if it has one."""
        begin = getattr(self.law, "begin", None)
        return Memories([None if begin is None else begin(i, team) for i in range(len(team))])

    def decide(self, seen: Observations, memory: "Memories | None") -> Decision:
        """Ask the law for each robot's force; without memory for the first time."""
        memory = memory or Memories([None] * len(seen.positions))
        known = seen.region, seen.neighbours, memory.triangulation, seen.reported_positions, seen.density
        cells = partition(seen.positions, *known)
        forces, memories = np.empty_like(seen.positions), []
        for i in range(len(forces)):
            place, velocity = seen.positions[i].copy(), seen.velocities[i].copy()
            point = None if np.isnan(seen.obstacle_points[i, 0]) else seen.obstacle_points[i].copy()
            heard = seen.get_neighbour_positions(i)
            heading = None if seen.steering is None else float(seen.steering[i, 0])
            known_now = i, place, velocity, heard, point, seen.region, seen.time, cells
            own = OwnView(*known_now, heading=heading, memory=memory.own[i])
            try:
                returned = self.law.force(own)
            except BaseException as error:
                error.add_note(f"robot {i + 1}")  # for the message, see `fault_of`
                raise
            forces[i] = self._check_force(returned, i, seen.time)
            memories.append(own.memory)
        memory = Memories(memories, cells.triangulation)
        return Decision(forces=forces, goals=cells.centroid, cells=cells, memory=memory)

    def _check_force(self, returned: object, robot: int, time: float) -> Array:
        """Return the force on a robot, counted from 0; raises ParameterError unless it is one."""
        force = to_numbers(returned)
        if force is not None and force.shape == (2,) and isfinite(force[0]) and isfinite(force[1]):
            return force
        missing = " (is a return statement missing?)" if returned is None else ""
        raise ParameterError(
            f"controller {self.name!r}: force(own) returned {quote(returned)}{missing} for robot {robot + 1} "
            f"at {time:.3f} s{location_of(self.law.force)}, expected two finite numbers in newtons"
        )
