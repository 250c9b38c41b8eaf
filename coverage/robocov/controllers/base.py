"""What a controller is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, cast, get_args, runtime_checkable

from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from robocov.environment import Environment
    from robocov.observation import Decision, Observations
    from robocov.observation.region import Region
    from robocov.robots import Team

Information: TypeAlias = Literal["own", "shared map", "whole map"]
"""What a law goes by: what the robot itself senses and hears, maps that neighbours tell each other as
well, or the whole map from the beginning."""


@runtime_checkable
class Controller(Protocol):
    """A control law: a frozen dataclass of gains, without state of its own.

    Row i of a decision may depend only on what robot i knows (see `robocov.observation`).
    Whatever the robots remember goes through `Decision.memory`; a run can therefore be copied,
    rewound and branched. A class that states `name`, `label` and `summary` as class variables
    satisfies the protocol.

    Optional are

    - the class variable ``information``, one of `Information`, "own" where it is not stated,
    - the attribute ``scanning``, a `robocov.observation.scans.Scanning`, of laws that want ray scans, and
    - the method ``informed(environment) -> Controller``, which only laws with the whole map have: it
      returns the law that knows that map, with the same gains. `Simulation` asks for it.
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
    stated = getattr(getattr(controller, "law", controller), "information", "own")
    if stated not in get_args(Information):
        name, words = getattr(controller, "name", "?"), ", ".join(get_args(Information))
        wanted = f"information: {shown(stated)}, but one of {words} was wanted"
        raise ParameterError(f"controller {name!r}: {wanted}")
    return cast(Information, stated)


def informed(controller: Controller, environment: Environment) -> Controller:
    """Return the controller as it decides on one map: one that goes by the whole map gets to know it.

    A ParameterError tells of a law that asks for the map and does not say so.
    """
    information = information_of(controller)
    tell = getattr(controller, "informed", None)
    if tell is None:
        return controller
    if information != "whole map":
        raise ParameterError(
            f"controller {controller.name!r}: it has a method informed(environment), but its information "
            f"is {information!r}; 'whole map' was wanted"
        )
    return cast(Controller, tell(environment))
