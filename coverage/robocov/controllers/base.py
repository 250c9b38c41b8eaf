"""What a controller is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robocov.observation import Decision, Observations
    from robocov.region import Region
    from robocov.robots import Team


@runtime_checkable
class Controller(Protocol):
    """A control law: a frozen dataclass of gains, without state of its own.

    Row i of a decision may depend only on what robot i knows (see `robocov.observation`).
    Whatever the robots remember goes through `Decision.memory`; a run can therefore be copied,
    rewound and branched. A class that states `name`, `label` and `summary` as class variables
    satisfies the protocol.
    """

    @property
    def name(self) -> str:
        """As it is given on the command line."""
        ...

    @property
    def label(self) -> str:
        """As it is shown to people."""
        ...

    @property
    def summary(self) -> str:
        """One line."""
        ...

    def begin(self, region: Region, team: Team) -> Any:
        """Return what the robots remember before the first decision."""
        ...

    def decide(self, seen: Observations, memory: Any) -> Decision:
        """Return the forces for all robots, from what each of them knows."""
        ...
