"""Actions on time: playing, speed, restarting, looking back, branches."""

from robocov.errors import StartError
from robocov_app.viewer.model import ViewerModel
from robocov_app.viewer.session.clock import SPEEDS, find_speed_index, format_speed

UNIFORM = "uniform"
"""Name of the start that every map has: anywhere in the free space."""


class PlaybackActions:
    """Actions that play the session, restart it and go to other times.

    Parameters
    ----------
    viewer : ViewerModel
        The viewer.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self._viewer = viewer

    def toggle_pause(self) -> None:
        """Play or pause, and remove the status message, which may have suggested this."""
        self._viewer.clear_message()
        session = self._viewer.session
        session.playback.is_playing = not session.playback.is_playing
        session.playback.stop_when_settled = False

    def step(self) -> None:
        """Simulate a single step."""
        self._viewer.session.playback.step()

    def toggle_settling(self) -> None:
        """Play until the team has settled, then pause; a second call cancels this."""
        session = self._viewer.session
        session.playback.stop_when_settled = not session.playback.stop_when_settled
        if session.playback.stop_when_settled:
            session.playback.is_playing = True
            session.timeline.is_settled = False
            self._viewer.show_message("Playing until the team has settled.")

    def restart(
        self, *, robots: int | None = None, start: str | None = None, seed: int | None = None
    ) -> None:
        """Restart at time 0, optionally with another number of robots, start or seed.

        If there is not enough space for that many robots at the current start, they start at random positions
        anywhere in the free space.
        """
        session = self._viewer.session
        try:
            session.restart(robots=robots, start=start, seed=seed)
        except StartError:
            start_before = session.timeline.scenario.start_name
            if robots is None or start is not None or start_before == UNIFORM:
                raise
            session.restart(robots=robots, start=UNIFORM, seed=seed)
            self._viewer.show_message(
                f"no space for {robots} robots at start “{start_before}”: "
                "they start anywhere in the free space"
            )

    def restart_with_next_seed(self) -> None:
        """Restart from other starting positions, which are sampled with the next seed."""
        self.restart(seed=self._viewer.session.timeline.scenario.seed + 1)

    def restart_with_more_robots(self, count: int) -> None:
        """Restart with more robots, or with fewer if `count` is negative."""
        self.restart(robots=len(self._viewer.robot_numbers) + count)

    def list_starts(self) -> list[str]:
        """Return the names of the starts of the map."""
        return list(dict.fromkeys([*self._viewer.session.displayed.environment.starts, UNIFORM]))

    def restart_at_next_start(self) -> None:
        """Restart from the next start of the map."""
        # If an obstacle has covered the current start, it is not in the list, and the first one follows.
        self.restart(start=find_next(self.list_starts(), self._viewer.session.timeline.scenario.start_name))

    def change_speed(self, steps: int) -> None:
        """Choose a speed from `SPEEDS` that is `steps` places faster, or slower if negative."""
        index = find_speed_index(self._viewer.session.playback.clock.speed) + steps
        self.set_speed(SPEEDS[min(max(index, 0), len(SPEEDS) - 1)])

    def set_speed(self, speed: float) -> None:
        """Set the speed as a multiple of real time; infinite for as fast as possible."""
        self._viewer.session.playback.clock.speed = speed
        self._viewer.show_message(f"speed {format_speed(speed)}")

    def show_offset(self, steps: int) -> None:
        """Pause, and show the recorded state that is `steps` later, or earlier if negative."""
        self._viewer.session.playback.is_playing = False
        self._viewer.session.show_offset(steps)

    def show_time(self, time: float) -> None:
        """Pause, and show a time, s."""
        self._viewer.session.playback.is_playing = False
        self._viewer.session.show_time(time)

    def shift_time(self, seconds: float) -> None:
        """Pause, and show the state that is a time, s, later, or earlier if negative."""
        self.show_time(self._viewer.session.displayed.time + seconds)

    def show_present(self) -> None:
        """Show the present."""
        session = self._viewer.session
        session.show_time(session.timeline.end_time)

    def branch(self) -> None:
        """Continue from the displayed step; the later steps are kept as another branch."""
        session = self._viewer.session
        if session.branch():
            session.playback.is_playing = True
            self._viewer.show_message("Continuing from here. The later steps are kept as another branch.")
        else:
            self._viewer.show_message("Go back in time first (← or the time slider).")

    def list_branch_names(self) -> list[str]:
        """Return the numbers of the branches as strings, starting from 1."""
        count = len(self._viewer.session.timeline.document.list_branches())
        return [str(number) for number in range(1, count + 1)]

    def go_to_branch(self, name: str) -> None:
        """Go to the end of a branch, given by its name or its number as a string."""
        session = self._viewer.session
        session.seek(session.timeline.document.find_branch(name).node)

    def go_to_next_branch(self, steps: int) -> None:
        """Go to the end of the branch that is `steps` places further in the list; the list is cyclic."""
        session = self._viewer.session
        ends = [branch.node for branch in session.timeline.document.list_branches()]
        head, _ = session.timeline.destination
        index = ends.index(head) if head in ends else -1
        self.go_to_node(ends[(index + steps) % len(ends)].number)

    def go_to_node(self, number: int) -> None:
        """Go to the end of the branch whose last node has this number."""
        session = self._viewer.session
        branches = session.timeline.document.list_branches()
        index = [branch.node.number for branch in branches].index(number)
        session.seek(branches[index].node)
        self._viewer.show_message(f"branch {index + 1} of {len(branches)}: {branches[index].description}")

    def undo(self) -> None:
        """Undo the last change."""
        session = self._viewer.session
        description = session.undo()
        if description:
            _, step = session.timeline.destination
            time = step * session.timeline.scenario.dt
            self._viewer.show_message(f"undone: {description}; back at {time:.1f} s")
        elif session.timeline.document.nodes[1:]:
            self._viewer.show_message("nothing to undo; Alt+← leads to other branches")
        else:
            self._viewer.show_message("nothing to undo")

    def redo(self) -> None:
        """Redo the last change that was undone."""
        description = self._viewer.session.redo()
        self._viewer.show_message(f"redone: {description}" if description else "nothing to redo")


def find_next(names: list[str], name: str) -> str:
    """Return the name that follows `name` in a cyclic list; the first one if `name` is not in the list.

    >>> find_next(["a", "b"], "b")
    'a'
    """
    if name not in names:
        return names[0]
    return names[(names.index(name) + 1) % len(names)]
