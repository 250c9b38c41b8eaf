"""Controllers of a single robot, and the adapter that calls them for each robot of a team."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import InitVar, dataclass, field
from math import isfinite
from typing import Any, Protocol, runtime_checkable

import numpy as np

from robocov.controllers.base import Controller, Information
from robocov.controllers.gains import check_gains
from robocov.controllers.user_modules import format_location
from robocov.errors import ParameterError, quote
from robocov.observation import Decision, Message, Observations, ReceivedMessage, to_numbers
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray
from robocov.voronoi import VoronoiPartition, partition
from robocov.voronoi.delaunay import Mesh

_CONTROLLER_MEMBERS = ("name", "label", "summary", "begin", "decide")
"""Members that a controller of a team must have."""


@dataclass(eq=False)
class OwnView:
    """Everything that one robot knows.

    Parameters
    ----------
    cells : VoronoiPartition
        Voronoi cells of the team. The view contains only the cell of the robot itself, as `cell` and
        `centroid`.

    Attributes
    ----------
    number : int
        Number of the robot, from 0.
    position : (2,) array, m
        Position of the robot as it knows it, with any localization noise.
    velocity : (2,) array, m/s
        Velocity of the robot.
    neighbors : (k, 2) array, m
        Positions of the robots within communication range, by their last messages.
    obstacle_point : (2,) array or None, m
        The closest obstacle or boundary point within sensing range; None if there is none.
    region : Region
        The known convex outer boundary.
    time : float, s
        Simulation time.
    heading : float or None, rad
        Heading of a unicycle, from +x; None in a team of points.
    memory : object
        Memory of the robot: the result of ``begin``, or the value that the controller assigned last.
    messages : sequence of ReceivedMessage
        Messages of other robots that have arrived in this step.
    sent_messages : list of Message
        Messages that the robot sends at the end of this step; `send` adds to it.

    See Also
    --------
    IndividualController : A controller that gets this view of a robot.
    Observations : The knowledge of all robots.

    Examples
    --------
    >>> import robocov as rc
    >>> class Homing:
    ...     def force(self, own):
    ...         return own.centroid - own.position
    >>> rc.run("square", Homing(), robots=2, duration=0.5)
    <Record Homing on Square, 2 robots, 0.5 s>
    """

    number: int
    position: FloatArray
    velocity: FloatArray
    neighbors: FloatArray
    obstacle_point: FloatArray | None
    region: Region
    time: float
    cells: InitVar[VoronoiPartition]
    heading: float | None = None
    memory: Any = None
    messages: Sequence[ReceivedMessage] = ()
    sent_messages: list[Message] = field(default_factory=list)

    def __post_init__(self, cells: VoronoiPartition) -> None:
        # The polygons of cells are computed when they are first used, which many controllers never do.
        self._cells = cells

    def send(self, payload: Any, size: int) -> None:
        """Send a message to all robots in communication range.

        Parameters
        ----------
        payload : object
            The content. It must not be changed afterwards.
        size : int, bytes
            Size of the payload when encoded.
        """
        self.sent_messages.append(Message(payload, size))

    @property
    def centroid(self) -> FloatArray:
        """Centroid of the robot's Voronoi cell, (2,) m."""
        return np.asarray(self._cells.centroids[self.number])

    @property
    def cell(self) -> FloatArray:
        """The robot's Voronoi cell, (k, 2) m, counter-clockwise."""
        return self._cells.polygons[self.number]


@runtime_checkable
class IndividualController(Protocol):
    """A controller of a single robot, with a method that computes a force from the robot's knowledge.

    An optional method ``begin(number, team)`` returns the initial memory of a robot; numbers start from 0.
    The controller reads the memory from ``own.memory``, and may assign a new value to it in each step.

    See Also
    --------
    OwnView : The knowledge of a single robot.
    IndividualControllerAdapter : Calls the controller for each robot of a team.
    Controller : A controller of a whole team, which is faster.

    Examples
    --------
    A controller with a memory, which counts the steps of each robot:

    >>> import robocov as rc
    >>> class Slowing:
    ...     def begin(self, number, team):
    ...         return 0
    ...
    ...     def force(self, own):
    ...         own.memory += 1
    ...         return (own.centroid - own.position) / own.memory
    >>> isinstance(Slowing(), rc.IndividualController)
    True
    >>> rc.run("square", Slowing(), robots=2, duration=0.5)
    <Record Slowing on Square, 2 robots, 0.5 s>
    """

    def force(self, own: OwnView) -> Sequence[float] | FloatArray:
        """Return the force on the robot, two numbers in newtons.

        Parameters
        ----------
        own : OwnView
            The knowledge of the robot.

        Returns
        -------
        (2,) sequence or array, N
        """


@dataclass(frozen=True, slots=True, eq=False)
class IndividualMemories:
    """Memories of the robots of a team with an individual controller."""

    by_robot: Sequence[Any]
    """Memory of each robot."""
    triangulation: Mesh | None = None
    """Triangulation of the last cells. It only saves time when the next cells are computed."""


class IndividualControllerAdapter:
    """Controller of a team that calls an individual controller for each robot in turn.

    Parameters
    ----------
    controller : IndividualController
        The controller of a single robot.

    Attributes
    ----------
    controller : IndividualController
        The controller of a single robot.
    name, label, summary : str
        Name, label and summary of the individual controller. By default, they are its class name and the
        first line of its docstring.
    information : Information
        Information that the individual controller uses; "own" by default.

    See Also
    --------
    IndividualController : A controller of a single robot.

    Examples
    --------
    >>> from dataclasses import InitVar, dataclass, field
    >>> import robocov as rc
    >>> @dataclass(frozen=True)
    ... class Homing:
    ...     stiffness: float = 0.5
    ...     def force(self, own):
    ...         return self.stiffness * (own.centroid - own.position)
    >>> rc.IndividualControllerAdapter(Homing()).name
    'Homing'
    """

    def __init__(self, controller: IndividualController) -> None:
        kind = type(controller)
        first_line = (kind.__doc__ or "").strip().split("\n")[0]
        self.controller = controller
        self.name = str(getattr(controller, "name", kind.__name__))
        self.label = str(getattr(controller, "label", self.name))
        self.summary = str(getattr(controller, "summary", first_line))
        self.information: Information = getattr(controller, "information", "own")

    def begin(self, region: Region, team: Team) -> IndividualMemories:
        """Return the memories of the robots before their first decision.

        They come from the method `begin` of the individual controller, if it has one, and are None otherwise.

        Parameters
        ----------
        region : Region
            The known outer boundary; not used, since individual controllers do not receive it.
        team : Team

        Returns
        -------
        IndividualMemories
        """
        begin = getattr(self.controller, "begin", None)
        if begin is None:
            return IndividualMemories([None] * len(team))
        return IndividualMemories([begin(robot, team) for robot in range(len(team))])

    def decide(
        self,
        seen: Observations,
        memory: IndividualMemories | None,
        robots: Iterable[int] | None = None,
    ) -> Decision:
        """Compute the forces on all robots by calling the individual controller for each of them.

        Parameters
        ----------
        seen : Observations
        memory : IndividualMemories or None
            None if the robots remember nothing.
        robots : iterable of int or None
            Indices of the robots for which the controller is called; all robots by default. The forces on the
            other robots are 0.

        Returns
        -------
        Decision

        Raises
        ------
        ParameterError
            If a force is not two finite numbers.
        """
        if memory is None:
            memory = IndividualMemories([None] * len(seen.positions))
        cells = partition(
            seen.positions,
            seen.region,
            neighbors=seen.neighbors,
            triangulation=memory.triangulation,
            reported_positions=seen.reported_positions,
            density=seen.density,
        )
        forces = np.zeros_like(seen.positions)
        memories = list(memory.by_robot)
        messages: list[Sequence[Message]] = [()] * len(forces)
        for robot in range(len(forces)) if robots is None else robots:
            own = _build_view(seen, cells, robot, memories[robot])
            forces[robot] = self._call_controller(own)
            memories[robot] = own.memory
            messages[robot] = own.sent_messages
        return Decision(
            forces=forces,
            goals=cells.centroids,
            cells=cells,
            memory=IndividualMemories(memories, cells.triangulation),
            messages=messages if any(messages) else (),
        )

    def _call_controller(self, own: OwnView) -> FloatArray:
        """Return the force on one robot."""
        try:
            result = self.controller.force(own)
        except BaseException as error:
            error.add_note(f"robot {own.number + 1}")  # `explain_fault` adds it to the message.
            raise
        force = to_numbers(result)
        if force is not None and force.shape == (2,) and isfinite(force[0]) and isfinite(force[1]):
            return force
        hint = " (is a return statement missing?)" if result is None else ""
        raise ParameterError(
            f"controller {self.name!r}: force(own) returned {quote(result)}{hint} for robot {own.number + 1} "
            f"at {own.time:.3f} s{format_location(self.controller.force)}, "
            "expected two finite numbers in newtons"
        )


def _build_view(seen: Observations, cells: VoronoiPartition, robot: int, memory: Any) -> OwnView:
    """Return the view of one robot. Its arrays are copies, because the controller may change them."""
    obstacle_point = None
    if not np.isnan(seen.obstacle_points[robot, 0]):
        obstacle_point = seen.obstacle_points[robot].copy()
    return OwnView(
        number=robot,
        position=seen.positions[robot].copy(),
        velocity=seen.velocities[robot].copy(),
        neighbors=seen.get_neighbor_positions(robot).copy(),
        obstacle_point=obstacle_point,
        region=seen.region,
        time=seen.time,
        cells=cells,
        heading=None if seen.steering is None else float(seen.steering[robot, 0]),
        memory=memory,
        messages=seen.get_messages(robot),
    )


def to_team_controller(controller: Any) -> Any:
    """Adapt an individual controller to a team; return any other object unchanged."""
    is_individual = isinstance(controller, IndividualController) and not isinstance(controller, type)
    if is_individual and not hasattr(controller, "decide"):
        return IndividualControllerAdapter(controller)
    return controller


def require_controller(value: Any) -> Controller:
    """Return a controller as one of a team, with gains that are allowed.

    Parameters
    ----------
    value : Controller or IndividualController

    Returns
    -------
    Controller
        An individual controller is adapted to a team.

    Raises
    ------
    ParameterError
        If the value is not a controller, or one of its gains is not allowed.
    """
    team_controller = to_team_controller(value)
    is_class = isinstance(team_controller, type)
    if is_class or not isinstance(team_controller, Controller):
        missing = [member for member in _CONTROLLER_MEMBERS if not hasattr(team_controller, member)]
        if not is_class and "decide" not in missing:
            raise ParameterError(
                f"controller: expected the attributes {', '.join(_CONTROLLER_MEMBERS)}, "
                f"got {quote(team_controller)} without {', '.join(missing)}"
            )
        raise ParameterError(
            "controller: expected a controller, as in Rapf(), with a method decide or force, "
            f"got {quote(team_controller)}"
        )
    check_gains(unwrap_controller(team_controller))
    return team_controller


def unwrap_controller(controller: Controller) -> Controller | IndividualController:
    """Return the individual controller in an adapter, or any other controller unchanged.

    The gains are attributes of the individual controller, not of its adapter.
    """
    if isinstance(controller, IndividualControllerAdapter):
        return controller.controller
    return controller
