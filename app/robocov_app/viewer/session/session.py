"""The session: what is going on in the window, and every way to touch it. Knows no pygame."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError
from robocov_app.viewer.session.pane import Wanted
from robocov_app.viewer.session.scenario import MOST_PANES, gain_words
from robocov_app.viewer.session.touches import Touches
from robocov_app.viewer.session.undo import Edit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.environment import Environment
    from robocov_app.viewer.session.pane import Lane
    from robocov_app.viewer.session.scenario import Law, Limits

PUSHED = 5e-3
"""Metres from which on a robot counts as pushed out of the way: who leans on something moves in any case."""


class Session(Touches):
    """What is going on in the window: scenario, controllers and map can be touched, and the robots."""

    # scenario

    def restart(self, **changes: object) -> None:
        """Begin anew, with changes of the scenario if there are any.

        Raises
        ------
        StartError, ParameterError
            When that cannot be; the run then goes on as it is.
        """
        scenario = self.scenario
        if "environment" in changes or "robots" in changes or "start" in changes or "seed" in changes:
            changes.setdefault("given", None)
        if "environment" in changes:
            changes.setdefault("start", None)
        elif scenario.start not in {None, "uniform", *scenario.environment.starts}:
            # an obstacle has covered it
            changes.setdefault("start", None)
        self._begin(replace(scenario, **changes))  # type: ignore[arg-type]

    def set_law(self, lane: Lane, law: Law) -> None:
        """Let another controller, or other gains, take over in a lane.

        Raises
        ------
        ParameterError
            When the controller cannot be made, or cannot begin; nothing has changed then.
        """
        if law == self.circumstances(lane).law:
            return
        law.made()
        with self._touching():
            before, circumstances = lane.law, replace(lane.circumstances, law=law)
            lane.take(circumstances, lane.changed(Wanted(circumstances)))
            self.scenario = replace(self.scenario, laws=tuple(each.law for each in self.lanes))
            takes_over = law.name != before.name
            words = f"{law.label} takes over" if takes_over else f"{law.label}: {gain_words(before, law)}"
            self._changed("law", words)

    def set_limits(self, limits: Limits) -> None:
        """Change what all robots are and can do.

        Raises
        ------
        ParameterError, StartError
            When a value is out of range, or the robots do not fit; nothing has changed then.
        """
        if limits == self.circumstances(self.lanes[0]).limits:
            return
        limits.team(1)
        with self._touching():
            self._change_all(lambda lane: Wanted(replace(lane.circumstances, limits=limits)))
            self.scenario = replace(self.scenario, limits=limits)
            self._changed("limits", "limits changed")

    def add_pane(self, law: Law) -> None:
        """Compare with one controller more; all begin anew, from the same starts.

        Raises
        ------
        ParameterError
            When there are as many as there is room for.
        """
        if len(self.lanes) >= MOST_PANES:
            raise ParameterError(f"there is room for {MOST_PANES} controllers side by side")
        self.restart(laws=(*self.scenario.laws, law))

    def remove_pane(self, lane: Lane) -> None:
        """Leave a lane out from now on; the others go on.

        Raises
        ------
        ParameterError
            When it is the only one.
        """
        if len(self.lanes) == 1:
            raise ParameterError("the last pane stays")
        self.lanes.remove(lane)
        self.scenario = replace(self.scenario, laws=tuple(each.law for each in self.lanes))

    # map

    def edit(self, environment: Environment, words: str) -> int:
        """Go on with another map of the same place; return how many robots had to be pushed out of the way.

        Raises
        ------
        StartError
            When there is no room for a robot any more; nothing has changed then.
        """
        with self._touching():
            before = self.environment
            pushed = self._put(environment, words)
            self.undo.add(
                Edit(
                    words,
                    lambda: self._put(before, f"{words}: undone"),
                    lambda: self._put(environment, words),
                    of_map=True,
                )
            )
        return pushed

    def show_density(self, environment: Environment) -> None:
        """Go on with the same place by another density, as while it is painted; there is no way back."""
        with self._touching():
            self._weigh(environment)
            self._amend()

    def painted(self, before: Environment, environment: Environment, words: str) -> None:
        """Go on with a density that has been painted, from what it was before."""
        with self._touching():
            self._repaint(environment, words)
            self.undo.add(
                Edit(
                    words,
                    lambda: self._repaint(before, f"{words}: undone"),
                    lambda: self._repaint(environment, words),
                    of_map=True,
                )
            )

    def _repaint(self, environment: Environment, words: str) -> None:
        self._weigh(environment)
        self._changed("density", words)

    def _weigh(self, environment: Environment) -> None:
        """Let the map as it is now have the density of another one, and be that one if they are alike."""
        now = self.environment
        if not environment.same_place(now) or environment.starts != now.starts:
            environment = now.with_density(environment.density)
        self._change_all(lambda lane: Wanted(replace(lane.circumstances, environment=environment)))
        self.scenario = replace(self.scenario, environment=environment)

    def _put(self, environment: Environment, words: str) -> int:
        places = [lane.simulation.positions for lane in self.lanes]
        self._change_all(lambda lane: Wanted(replace(lane.circumstances, environment=environment)))
        moved = [
            int((np.hypot(*(lane.simulation.positions - before).T) > PUSHED).sum())
            for lane, before in zip(self.lanes, places, strict=True)
        ]
        self.scenario = replace(self.scenario, environment=environment)
        self._changed("obstacle", words)
        return max(moved)

    def summary(self) -> Mapping[int, float]:
        """Return the newest mean distance of each lane, m, by its number."""
        return {lane.number: lane.curve.at(self.time) for lane in self.lanes}
