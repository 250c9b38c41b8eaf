"""Calls to controllers: checks of the returned values, and one-line messages for errors in users' code."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

from robocov.controllers import CONTROLLERS, inform_controller
from robocov.controllers.base import Controller
from robocov.controllers.individual import (
    IndividualController,
    IndividualControllerAdapter,
    require_controller,
)
from robocov.controllers.user_modules import explain_fault, format_location
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, quote
from robocov.observation import Decision, Observations, Scanning, check_decision, copy_decision
from robocov.observation.region import Region
from robocov.team import Team


class ControllerCaller:
    """Calls a controller and checks its decisions.

    A built-in controller is trusted. A user's controller may change its arguments, return arrays that it
    changes later, or raise anything. Therefore it receives copies of the observations and of its memory, its
    decisions are copied, and its errors are reported in one line with the file and line of its code.

    Parameters
    ----------
    controller : Controller or IndividualController
        The controller to call. A controller for one robot is called for every robot in turn.
    environment : Environment
        The map, for a controller with the information "whole map".
    time : float, s
        Simulation time, for messages.

    Attributes
    ----------
    controller : Controller
        The controller of the whole team, as it was before it received the map.
    scanning : Scanning or None
        Settings of the range scans that the controller needs; None if it needs none.

    Raises
    ------
    ParameterError
        If `controller` is not a controller, or its code raises an error.
    """

    def __init__(
        self, controller: Controller | IndividualController, environment: Environment, time: float
    ) -> None:
        team_controller = require_controller(controller)
        self.controller: Controller = team_controller
        self._is_built_in = type(team_controller) in CONTROLLERS.values()
        self._informed_controller: Controller = self._call(
            time, inform_controller, team_controller, environment
        )
        if isinstance(team_controller, IndividualControllerAdapter):
            self._reject_unused_scanning(team_controller, time)
        # In a user's controller, `scanning` may be a property that fails.
        self.scanning: Scanning | None = self._call(time, getattr, team_controller, "scanning", None)
        if not isinstance(self.scanning, Scanning | None):
            raise ParameterError(
                f"controller {team_controller.name!r}: scanning: expected a Scanning, "
                f"got {quote(self.scanning)}"
            )

    def _reject_unused_scanning(self, adapter: IndividualControllerAdapter, time: float) -> None:
        """Raise an error if an individual controller requests range scans, which it would never receive."""
        if self._call(time, getattr, adapter.controller, "scanning", None) is not None:
            raise ParameterError(
                f"controller {adapter.name!r}: scanning: expected none in a controller with force(own), "
                "which receives no range scans. Write decide(observations, memory) to use observations.scans."
            )

    def begin(self, region: Region, team: Team, time: float) -> Any:
        """Return the memory of the robots before their first decision.

        Parameters
        ----------
        region : Region
            The convex region, which all robots know.
        team : Team
            The robots.
        time : float, s
            Simulation time, for messages.

        Returns
        -------
        object
            The memory, in whatever form the controller uses.
        """
        return self._call(time, self._informed_controller.begin, region, team)

    def decide(self, observations: Observations, memory: Any) -> Decision:
        """Return the decision of the controller.

        Parameters
        ----------
        observations : Observations
            The observations of the robots in this step.
        memory : object
            The memory of the previous decision, or the result of `begin` before the first decision.

        Returns
        -------
        Decision

        Raises
        ------
        ParameterError
            If a user's controller fails, or a controller returns anything but a decision for each robot.
            Exceptions of built-in controllers are not caught.
        """
        robot_count = len(observations.positions)
        name = self.controller.name
        decide = self._informed_controller.decide
        if self._is_built_in:
            return check_decision(decide(observations, memory), robot_count, name, observations.time)
        # A shallow copy is enough: arrays that outlive the step are read-only, and the others belong to this
        # step only.
        returned = self._call(observations.time, decide, replace(observations), _copy_memory(memory))
        # `decide` of the adapter is part of robocov; its location would not help the user.
        source = ""
        if not isinstance(self._informed_controller, IndividualControllerAdapter):
            source = format_location(decide)
        decision = check_decision(returned, robot_count, name, observations.time, source)
        return copy_decision(decision, name, source)

    def _call(self, time: float, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function of the controller; an error in a user's code is explained in one line."""
        try:
            return function(*arguments)
        except (RobocovError, KeyboardInterrupt):
            raise
        except BaseException as error:
            if self._is_built_in:
                raise
            raise explain_fault(f"controller {self.controller.name!r}", error, f" at {time:.3f} s") from error


def _copy_memory(memory: Any) -> Any:
    """Return a copy of a memory, or the memory itself if it cannot be copied."""
    try:
        return deepcopy(memory)
    except Exception:
        return memory
