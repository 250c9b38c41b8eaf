"""The interface of controllers, and the base class of the built-in ones."""

from dataclasses import dataclass, fields, is_dataclass
from typing import Any, ClassVar, Literal, Protocol, Self, TypeAlias, get_args, runtime_checkable

from robocov.controllers.gains import validate_gains
from robocov.controllers.user_modules import format_location
from robocov.environment import Environment
from robocov.errors import ParameterError, describe_unknown_name, quote
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray
from robocov.voronoi.delaunay import Mesh

Information: TypeAlias = Literal["own", "shared map", "whole map"]
"""Information that a controller uses: the measurements of each robot and the positions of its neighbors
("own"); in addition what robots send each other in messages, for example scans, last known positions of
other robots, or estimates of the density ("shared map"); or the whole map from the start ("whole map").

Messages arrive in the next step at the earliest. The conditions delay, lose and limit them, see
`robocov.conditions.communication`. The docstring of a controller describes its messages and their sizes."""

TIME_TOLERANCE_S = 1e-9
"""Tolerance for comparing times: a sum of time steps may be slightly less than their exact multiple."""


def is_plan_due(plan_time: float, period: float, time: float) -> bool:
    """Return whether it is time for a new plan.

    Parameters
    ----------
    plan_time : float, s
        Time of the last plan. If it is later than `time`, the simulation was rewound, and a new plan is due.
    period : float, s
        Time between two plans.
    time : float, s

    Returns
    -------
    bool
    """
    return not plan_time <= time < plan_time + period - TIME_TOLERANCE_S


@runtime_checkable
class Controller(Protocol):
    """A controller of a whole team: a frozen dataclass of gains, without state of its own.

    Row i of a decision may depend only on what robot i knows (see `robocov.observation`). The memory
    of the robots is passed through `Decision.memory`; a run can therefore be copied, rewound and branched.

    Optional members are

    - the class variable ``information``, one of `Information`; "own" by default,
    - the attribute ``scanning``, a `robocov.observation.Scanning`, if the robots need range scans,
    - the method ``inform(environment) -> Controller``, only with the information "whole map": it returns the
      controller that knows that map, with the same gains.

    See Also
    --------
    IndividualController : A controller of a single robot, which is easier to write.
    Observations : The information available to the robots.
    gain : Declare a gain.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import robocov as rc
    >>> @dataclass(frozen=True)
    ... class ToCenter:
    ...     name = label = "to-center"
    ...     summary = "every robot moves to the centroid of the region"
    ...     stiffness: float = rc.gain(1.0, "N/m", "attraction to the centroid", high=10.0)
    ...
    ...     def begin(self, region, team):
    ...         return None
    ...
    ...     def decide(self, seen, memory):
    ...         return rc.Decision(self.stiffness * (seen.region.centroid - seen.positions))
    >>> rc.run("square", ToCenter(stiffness=2.0), robots=3, duration=1.0)
    <Record to-center on Square, 3 robots, 1.0 s>
    """

    @property
    def name(self) -> str:
        """Name on the command line."""

    @property
    def label(self) -> str:
        """Name in figures and in the window."""

    @property
    def summary(self) -> str:
        """Description on one line."""

    def begin(self, region: Region, team: Team) -> Any:
        """Return the memory of the robots before their first decision.

        Parameters
        ----------
        region : Region
            The known outer boundary.
        team : Team
            The robots, which know their own bodies and limits.

        Returns
        -------
        object
            The memory, which the first call of `decide` receives.
        """

    def decide(self, seen: Observations, memory: Any) -> Decision:
        """Compute the forces on all robots in a step. Each must depend only on what that robot knows.

        Parameters
        ----------
        seen : Observations
            What the robots know at this step.
        memory : object
            The result of `begin` in the first step, and later `Decision.memory` of the previous step.

        Returns
        -------
        Decision
            The forces, (n, 2) N, and optionally goals, cells and messages. Its memory is passed to the next
            call.
        """


def get_information(controller: Any) -> Information:
    """Return the information that a controller uses.

    Parameters
    ----------
    controller : Controller or type
        A controller, or a class of controllers.

    Returns
    -------
    str
        "own", "shared map" or "whole map".

    Raises
    ------
    ParameterError
        If its attribute ``information`` is not one of `Information`.

    See Also
    --------
    get_gains : Return the gains of a controller.

    Examples
    --------
    >>> from robocov.controllers import AtlasShared, Rapf
    >>> get_information(Rapf), get_information(AtlasShared())
    ('own', 'shared map')
    """
    information: Information = getattr(controller, "information", "own")
    if information not in get_args(Information):
        name = getattr(controller, "name", "?")
        expected = ", ".join(get_args(Information))
        raise ParameterError(
            f"controller {name!r}: information: expected one of {expected}, got {quote(information)}"
        )
    return information


def inform_controller(controller: Controller, environment: Environment) -> Controller:
    """Inform a controller of the map if it has a method ``inform``; return any other controller unchanged.

    Parameters
    ----------
    controller : Controller
    environment : Environment

    Returns
    -------
    Controller

    Raises
    ------
    ParameterError
        If its attribute ``information`` is not one of `Information`, or not "whole map" although there is a
        method ``inform``; or if that method does not return a controller.
    """
    information = get_information(controller)
    inform = getattr(controller, "inform", None)
    if inform is None:
        return controller
    if information != "whole map":
        raise ParameterError(
            f"controller {controller.name!r}: information: expected 'whole map', because there is a method "
            f"inform(environment), got {information!r}"
        )
    informed_controller: Controller = inform(environment)
    if isinstance(informed_controller, type) or not isinstance(informed_controller, Controller):
        raise ParameterError(
            f"controller {controller.name!r}: inform(environment) returned {quote(informed_controller)}"
            f"{format_location(inform)}, expected a controller"
        )
    return informed_controller


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """Memory of the robots of many built-in controllers."""

    team: Team
    """The robots. Each robot knows only its own body and limits."""
    returns: FloatArray | None = None
    """(n, rays, 2) m, obstacle points in the last scan of each robot; nan for none."""
    triangulation: Mesh | None = None
    """Triangulation of the last cells. It only saves time when the next cells are computed."""


class BaseController:
    """Base class of the built-in controllers: dataclasses whose gains are checked."""

    name: ClassVar[str]
    """Name on the command line."""
    label: ClassVar[str]
    """Name in figures and in the window."""
    summary: ClassVar[str]
    """Description on one line."""
    information: ClassVar[Information] = "own"
    """Information that the controller uses."""
    memory_type: ClassVar[type[Memory]] = Memory
    """Class of the memory that `begin` builds."""

    def __new__(cls, *_: Any, **gains: Any) -> Self:
        """Create the controller; raise ParameterError with the most similar name for an unknown gain."""
        if is_dataclass(cls):
            names = [field.name for field in fields(cls) if field.init]
            for name in gains:
                if name not in names:
                    raise ParameterError(f"{cls.name}: {describe_unknown_name('gain', name, names)}")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        validate_gains(self)

    def begin(self, region: Region, team: Team) -> Any:
        """Return the initial memory of the robots. Each robot knows only its own body and limits.

        Parameters
        ----------
        region : Region
            The known outer boundary.
        team : Team

        Returns
        -------
        Memory
            An object of the class `memory_type`.
        """
        return self.memory_type(team)
