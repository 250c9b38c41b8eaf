"""The options of what goes wrong during a run, and what is added to a summary because of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from robocov.errors import ParameterError

if TYPE_CHECKING:
    from robocov.conditions import Conditions


@dataclass
class ConditionOptions:
    """What goes wrong, or changes, during the run; the same for every controller."""

    loss: float = 0.0
    """Probability with which a message between two robots is lost."""
    delay: float = 0.0
    """Seconds that a message is on its way."""
    message_rate: float | None = None
    """Messages per second with which each robot tells where it is; at every step by default."""
    forget_after: float = 3.0
    """Seconds of silence after which a robot is taken to be gone."""
    position_noise: float = 0.0
    """Standard deviation in metres of what a robot takes its own position to be, in x and in y."""
    sensing_noise: float = 0.0
    """Standard deviation in metres of what the range sensor measures."""
    failure_rate: float = 0.0
    """Failures per second of each robot; 0.01 is a mean life of 100 s."""
    fail: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S ...")] = ()
    """Robots that fail, and when: --fail 3@20 5@40. They stand still then, as obstacles."""
    join: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S[:X,Y] ...")] = ()
    """Robots that join late, and when and where: --join 6@30:2.5,1; else at their start."""

    def conditions(self, seed: int, robots: int) -> Conditions | None:
        """Return the conditions for a team; None where they are ideal.

        Raises
        ------
        ParameterError
            When they cannot be.
        """
        if self == ConditionOptions():
            return None
        from robocov.conditions import Conditions, Failure, Join, parsed_entry

        option = "--fail"
        try:
            failures = tuple(parsed_entry(Failure, text) for text in self.fail)
            option = "--join"
            joins = tuple(parsed_entry(Join, text) for text in self.join)
        except ParameterError as error:
            raise ParameterError(f"{option}: {error}") from None
        conditions = Conditions(
            loss=self.loss,
            delay=self.delay,
            message_rate=self.message_rate,
            forget_after=self.forget_after,
            position_noise=self.position_noise,
            sensing_noise=self.sensing_noise,
            failure_rate=self.failure_rate,
            failures=failures,
            joins=joins,
            seed=seed,
        )
        conditions.check_team(robots)
        return None if conditions.ideal else conditions
