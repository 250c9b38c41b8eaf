"""How robots are touched: dragged, placed, added, taken out, made fail and revived, in all panes alike."""

from __future__ import annotations

from bisect import bisect
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.conditions import SOON
from robocov.errors import ParameterError
from robocov.world.relocation import nearest_free
from robocov_app.viewer.session.pane import Wanted
from robocov_app.viewer.session.scenario import MOST_ROBOTS
from robocov_app.viewer.session.timeline import Timeline
from robocov_app.viewer.session.undo import Edit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.arrays import Array
    from robocov_app.viewer.session.history import Circumstances
    from robocov_app.viewer.session.pane import Lane
    from robocov_app.viewer.tool import Point


class Touches(Timeline):
    """A run whose robots can be touched.

    All panes have the same robots under the same numbers, ascending row by row. A touch that cannot be
    raises an error, and nothing has changed then.
    """

    def grab(self, number: int, point: Point) -> None:
        """Drag a robot towards a point: by a spring while the run goes on, at once while it is paused.

        One that failed comes at once.

        Raises
        ------
        ParameterError
            When there is no such robot.
        StartError
            When there is no room for it anywhere.
        """
        if not self.playing or number not in self.numbers:
            self.place(number, point)
            self.hand = None
            return
        with self._touching():
            self.hand = number, point
            self.settled = False

    def place(self, number: int, point: Point) -> None:
        """Put a robot, or one that failed, at a point or as near as it fits.

        Raises
        ------
        ParameterError
            When there is no such robot.
        StartError
            When there is no room for it anywhere.
        """

        def placed(lane: Lane) -> Wanted:
            circumstances, row = lane.circumstances, lane.row(number)
            if row is None:
                others, radii = lane.simulation.positions, lane.simulation.team.radius
                place = _fitting(_without_wreck(circumstances, number), number, others, radii, point)
                return Wanted(replace(circumstances, failed={**circumstances.failed, number: place}))
            positions = np.array(lane.simulation.positions)
            velocities = np.array(lane.simulation.velocities)
            others, radii = np.delete(positions, row, axis=0), np.delete(circumstances.team.radius, row)
            positions[row] = _fitting(circumstances, number, others, radii, point)
            velocities[row] = 0.0
            return Wanted(circumstances, positions, velocities)

        with self._touching():
            self._need(number)
            self._change_all(placed)
            self._amend()

    def add_robot(self, point: Point, number: int | None = None) -> int:
        """Let one robot more join at a point, or as near as it fits; return its number.

        Raises
        ------
        StartError
            When there is no room.
        ParameterError
            When there are as many as there may be, or there is one of that number.
        """
        with self._touching():
            present = self._present()
            if len(present) >= MOST_ROBOTS:
                raise ParameterError(f"there are {MOST_ROBOTS} robots already")
            new = max(present) + 1 if number is None else number
            if new in present:
                raise ParameterError(f"there is a robot {new} already")
            places = {lane.number: point for lane in self.lanes}
            self._join(new, places)
            self.undo.add(Edit(f"robot {new}", lambda: self._leave(new), lambda: self._join(new, places)))
        return new

    def remove_robot(self, number: int) -> None:
        """Take a robot out, whether it works or not.

        Raises
        ------
        ParameterError
            When there is no such robot, or it is the last one that works.
        """
        with self._touching():
            self._need(number)
            failed = number not in self.lanes[0].numbers
            places = {lane.number: _place_of(lane, number) for lane in self.lanes}
            self._leave(number)
            self.undo.add(
                Edit(
                    f"robot {number} taken out",
                    lambda: self._join(number, places, failed=failed),
                    lambda: self._leave(number),
                )
            )

    def fail_robot(self, number: int) -> None:
        """Let a robot fail: it stays where it is, stops, and is not heard any more.

        Raises
        ------
        ParameterError
            When there is no such robot, it has failed already, or it is the last one that works.
        """
        with self._touching():
            self._fail(number)
            self.undo.add(
                Edit(
                    f"failure of robot {number}",
                    lambda: self._revive(number),
                    lambda: self._fail(number),
                )
            )

    def revive_robot(self, number: int) -> None:
        """Let a robot that failed work again, where it stands or as near as it fits.

        Raises
        ------
        ParameterError
            When there is no such robot, or it works.
        """
        with self._touching():
            self._revive(number)
            self.undo.add(
                Edit(
                    f"revival of robot {number}",
                    lambda: self._fail(number),
                    lambda: self._revive(number),
                )
            )

    # how it is done, without a way back

    def _join(self, number: int, places: Mapping[int, Point], *, failed: bool = False) -> None:
        """Let a robot come in, at a place in each pane, as one that works or one that failed."""

        def joined(lane: Lane) -> Wanted:
            if not failed:
                return _with_robot(lane, lane.circumstances, number, places[lane.number])
            circumstances = lane.circumstances
            others, radii = lane.simulation.positions, lane.simulation.team.radius
            place = _fitting(circumstances, number, others, radii, places[lane.number])
            return Wanted(replace(circumstances, failed={**circumstances.failed, number: place}))

        self._change_all(joined)
        self._changed("robot", f"robot {number} joined")

    def _leave(self, number: int) -> None:
        self._need_another(number)
        self._change_all(lambda lane: _without_robot(lane, number))
        self._let_go_of(number)
        self._changed("robot", f"robot {number} taken out")

    def _fail(self, number: int) -> None:
        self._need(number)
        if number not in self.lanes[0].numbers:
            raise ParameterError(f"robot {number} has failed already")
        self._need_another(number)

        def failing(lane: Lane) -> Wanted:
            wanted = _without_robot(lane, number)
            failed = {**wanted.circumstances.failed, number: _place_of(lane, number)}
            return wanted._replace(circumstances=replace(wanted.circumstances, failed=failed))

        self._change_all(failing)
        self._let_go_of(number)
        self._changed("failure", f"robot {number} failed")

    def _revive(self, number: int) -> None:
        self._need(number)
        if number in self.lanes[0].numbers:
            raise ParameterError(f"robot {number} works")
        self._change_all(
            lambda lane: _with_robot(
                lane, _without_wreck(lane.circumstances, number), number, _place_of(lane, number)
            )
        )
        self._changed("robot", f"robot {number} works again")

    def _come_and_go(self) -> None:
        """Let robots fail and join whose time has come; the last one that works goes on."""
        conditions = self.scenario.conditions
        if conditions is None or not conditions.team_changes:
            return
        begins, ends = conditions.lives(self.scenario.robots)
        now, before = self.end + SOON, self.end - self.scenario.dt + SOON
        for number in (np.flatnonzero((begins > before) & (begins <= now)) + 1).tolist():
            if number not in self._present():
                place = next(join.place for join in conditions.joins if join.robot == number)
                x, y = self.scenario.positions()[number - 1].tolist() if place is None else place
                self._join(number, {lane.number: (x, y) for lane in self.lanes})
        for number in (np.flatnonzero((ends > before) & (ends <= now)) + 1).tolist():
            if number in self.lanes[0].numbers and len(self.lanes[0].numbers) > 1:
                self._fail(number)

    def _present(self) -> set[int]:
        """Return the numbers of all robots, whether they work or not."""
        return {*self.lanes[0].numbers, *self.lanes[0].circumstances.failed}

    def _need(self, number: int) -> None:
        if number not in self._present():
            raise ParameterError(f"there is no robot {number}")

    def _need_another(self, number: int) -> None:
        if not set(self.lanes[0].numbers) - {number}:
            raise ParameterError("the last robot that works stays")

    def _let_go_of(self, number: int) -> None:
        if self.hand is not None and self.hand[0] == number:
            self.hand = None


def _fitting(circumstances: Circumstances, number: int, others: Array, radii: Array, point: Point) -> Point:
    """Return the place nearest to a point where a robot fits beside the others and those that failed."""
    radius = circumstances.limits.radius_of(number)
    return nearest_free(circumstances.solid, radius, others, point, radii)


def _place_of(lane: Lane, number: int) -> Point:
    row = lane.row(number)
    if row is None:
        return lane.circumstances.failed[number]
    x, y = lane.simulation.positions[row].tolist()
    return x, y


def _without_wreck(circumstances: Circumstances, number: int) -> Circumstances:
    failed = {key: place for key, place in circumstances.failed.items() if key != number}
    return replace(circumstances, failed=failed)


def _without_robot(lane: Lane, number: int) -> Wanted:
    circumstances, row = _without_wreck(lane.circumstances, number), lane.row(number)
    if row is None:
        return Wanted(circumstances)
    numbers = tuple(each for each in circumstances.numbers if each != number)
    return Wanted(
        replace(circumstances, numbers=numbers),
        np.delete(lane.simulation.positions, row, axis=0),
        np.delete(lane.simulation.velocities, row, axis=0),
    )


def _with_robot(lane: Lane, circumstances: Circumstances, number: int, point: Point) -> Wanted:
    """Return a lane's robots and one more, at rest at a point or as near as it fits."""
    numbers, positions = circumstances.numbers, lane.simulation.positions
    place = _fitting(circumstances, number, positions, lane.simulation.team.radius, point)
    row = bisect(numbers, number)
    return Wanted(
        replace(circumstances, numbers=(*numbers[:row], number, *numbers[row:])),
        np.insert(positions, row, place, axis=0),
        np.insert(lane.simulation.velocities, row, 0.0, axis=0),
    )
