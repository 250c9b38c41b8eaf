"""The viewer: what every key, button and typed command does, and what is to be shown. Knows no pygame."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import Value
from robocov.environment import Point
from robocov.errors import InputError, ParameterError, RobocovError
from robocov.mapfile import bundled_maps, load_map, save_map
from robocov_app.terminal.output import free_name
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.parameters import Parameter, Pick, gain_parameters, limit_parameters, with_limit
from robocov_app.viewer.session.clock import SPEEDS, speed_index, speed_words
from robocov_app.viewer.session.file import SUFFIX
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.scenario import ControllerChoice
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.workspace import Recovered, Workspace, opened, recoverable, recovered
from robocov_app.viewer.tools import Brush, Hand, Tool, Wall, toolbox

SAID_FOR = 5.0  # seconds for which a message stays

_RECENT = 9  # sessions that are offered again

FADE = 12.0  # seconds of path that trajectories show where they fade


class Presenter:
    """The user's actions in terms of the session, and what of it is shown.

    `shown`: names of layers. `folder`: where things are saved. `map_name`: a bundled name or a path. `laws`:
    names of controllers to choose from beside the built-in ones. `kept_in`: the folder for unsaved work.
    `file`: of the session. `active`: the pane that gains and controllers are chosen for. `version` grows
    whenever panel and canvas have to look again at what there is. `now`: seconds since the start.
    """

    def __init__(
        self,
        session: Session,
        costs: Costs,
        shown: set[str],
        folder: Path,
        map_name: str = "",
        laws: Iterable[str] = (),
        kept_in: Path | None = None,
        file: Path | None = None,
    ) -> None:
        self.session, self.costs, self.shown, self.folder = session, costs, shown, folder
        self._map_names, self._kept_in = {session.environment.name: map_name}, kept_in
        self.laws = list(dict.fromkeys([*CONTROLLERS, *laws]))
        self.tools = toolbox()
        self.tool: Tool = self.tools["hand"]
        self.active = self.version = 0
        self.theme = "light"
        self.panel, self.fade, self.suggests, self.filming = True, False, True, False
        self.recent: list[str] = []
        self.message, self.trouble, self._said, self.now = "", False, 0.0, 0.0
        self.cursor: Point | None = None
        self.cursor_pane = 0
        self._mapped: object = None
        self.rested: object = None  # the touch after which the team has settled, though it may sway again
        self.workspace = Workspace(session, kept_in, file)
        self.look_at_map()

    # what there is

    @property
    def map_name(self) -> str:
        """Bundled name or path of the map of the present, also where undo has led to another one."""
        name = self.session.environment.name
        return self._map_names.get(name, name)

    @map_name.setter
    def map_name(self, name: str) -> None:
        self._map_names[self.session.environment.name] = name

    @property
    def hand(self) -> Hand:
        """The tool that drags; it knows which robot is asked about."""
        tool = self.tools["hand"]
        assert isinstance(tool, Hand)
        return tool

    @property
    def numbers(self) -> list[int]:
        """The numbers of the robots in the chosen pane, those that failed with them."""
        setup = self.session.setup(self.pane)
        return sorted([*setup.numbers, *setup.failed])

    @property
    def selected(self) -> int | None:
        """The number of the robot that is asked about, if it is there."""
        return self.hand.selected if self.hand.selected in self.numbers else None

    @property
    def pane(self) -> Pane:
        """The pane that is chosen."""
        self.active = min(self.active, len(self.session.panes) - 1)
        return self.session.panes[self.active]

    @property
    def robots(self) -> int:
        """Number of robots in the chosen pane, those that failed with them."""
        return len(self.numbers)

    def parameters(self) -> list[Parameter | Pick]:
        """Return all sliders and words: the chosen controller's gains, then the team's limits."""
        setup = self.session.setup(self.pane)
        return [*gain_parameters(setup.law), *limit_parameters(setup.limits)]

    def maps(self) -> list[str]:
        """Return the maps to choose from: the bundled ones, and the one that is open."""
        return list(dict.fromkeys([*bundled_maps(), *([self.map_name] if self.map_name else [])]))

    # messages

    def say(self, words: str, *, trouble: bool = False) -> None:
        """Tell something for a while."""
        if words:
            self.message, self.trouble, self._said = words, trouble, self.now

    def pass_time(self, seconds: float) -> None:
        """Let the clock go on; old messages go."""
        self.now += seconds
        if self.message and self.now - self._said > SAID_FOR:
            self.message = ""

    def attempt(self, action: Callable[[], object]) -> None:
        """Do something; what cannot be done is told, in a sentence."""
        try:
            words = action()
        except RobocovError as error:
            self.say(plain(str(error)), trouble=True)
        else:
            if isinstance(words, str):
                self.say(words)
        self.version += 1
        self.look_at_map()

    def look_at_map(self) -> None:
        """Let the cost know when there is another map."""
        environment = self.session.environment
        # while it is painted the cost would never be ready
        if environment is not self._mapped and not getattr(self.tool, "painting", False):
            self._mapped = environment
            self.costs.environment(environment)

    # doing

    def switch_layer(self, name: str) -> None:
        """Show a layer, or do not."""
        self.shown ^= {name}

    def take_tool(self, name: str) -> None:
        """Take another tool; what was begun with the one before is given up."""
        self.tool.cancel(self.session)
        self.tool = self.tools[name]
        self.say(f"{self.tool.title}: {self.tool.hint}")

    def pause(self) -> None:
        """Play or pause."""
        self.session.playing = not self.session.playing
        self.session.stop_when_settled = False

    def settle(self) -> None:
        """Play until no robot gets anywhere any more."""
        session = self.session
        session.stop_when_settled = not session.stop_when_settled
        if session.stop_when_settled:
            session.playing = True
            session.settled = False
            self.say("plays until the team has settled")

    def restart(self, **changes: object) -> None:
        """Begin anew, with changes of the scenario if there are any."""
        self.session.restart(**changes)

    def change_robots(self, by: int) -> None:
        """Begin anew with more robots or fewer."""
        self.restart(robots=self.robots + by)

    def change_speed(self, by: int) -> None:
        """Play faster or slower."""
        k = speed_index(self.session.clock.speed) + by
        self.set_speed(SPEEDS[min(max(k, 0), len(SPEEDS) - 1)])

    def set_speed(self, speed: float) -> None:
        """Play so many simulated seconds per second."""
        self.session.clock.speed = speed
        self.say(f"speed {speed_words(speed)}")

    def next_start(self) -> None:
        """Begin anew at the next start of the map."""
        names = self.starts()
        now = self.session.scenario.start_name
        # an obstacle may have covered the start since
        k = names.index(now) if now in names else -1
        self.restart(start=names[(k + 1) % len(names)])

    def starts(self) -> list[str]:
        """Return the names of the map's starts."""
        return list(dict.fromkeys([*self.session.environment.starts, "uniform"]))

    def next_map(self, by: int) -> None:
        """Open the next map that has room for the team."""
        maps = self.maps()
        now = maps.index(self.map_name) if self.map_name in maps else 0
        passed: list[str] = []
        for k in range(1, len(maps) + 1):
            name = maps[(now + by * k) % len(maps)]
            with suppress(InputError):
                self.open_map(name)
                if passed:
                    self.say(f"no room for {self.session.scenario.robots} robots: {', '.join(passed)}")
                return
            passed.append(name)

    def open_map(self, name: str) -> None:
        """Begin anew on another map; MapError or StartError where that cannot be."""
        self.session.restart(environment=load_map(name))
        self.map_name = name

    def look_by(self, moments: int) -> None:
        """Look a few moments back or on; playing stops."""
        self.session.playing = False
        self.session.look_by(moments)

    def look_at(self, time: float) -> None:
        """Look at a moment; playing stops."""
        self.session.playing = False
        self.session.look_at(time)

    def branch(self) -> None:
        """Go on from the moment that is shown."""
        if self.session.branch():
            self.session.playing = True
            self.say("goes on from here; what came after stays as a ghost curve")
        else:
            self.say("this is the present: go back first (←, or drag the time line)")

    def next_law(self) -> None:
        """Let the next controller take over in the chosen pane."""
        now = self.session.setup(self.pane).law.name
        k = self.laws.index(now) if now in self.laws else -1
        self.session.set_law(self.pane, ControllerChoice(self.laws[(k + 1) % len(self.laws)]))

    def add_pane(self) -> None:
        """Compare with a controller that is not there yet."""
        there = {pane.law.name for pane in self.session.panes}
        name = next((name for name in self.laws if name not in there), self.laws[0])
        self.session.add_pane(ControllerChoice(name))
        self.active = len(self.session.panes) - 1
        self.say("all begin anew, from the same starts")

    def next_pane(self) -> None:
        """Choose the next pane."""
        self.active = (self.active + 1) % len(self.session.panes)

    def undo(self) -> None:
        """Take the last edit back."""
        nothing = "nothing to undo" + (
            "; Alt ← leads to other branches" if self.session.document.nodes[1:] else ""
        )
        words = self.session.undo()
        self.say(f"undone: {words}; back at {self.session.time:.1f} s" if words else nothing)

    def redo(self) -> None:
        """Do again what was taken back."""
        words = self.session.redo()
        self.say(f"done again: {words}" if words else "nothing to redo")

    def ask_next(self, by: int) -> None:
        """Ask the next robot."""
        numbers, now = self.numbers, self.selected
        k = (-1 if by > 0 else 0) if now is None else numbers.index(now)
        self.hand.selected = numbers[(k + by) % len(numbers)]

    def fail_or_revive(self) -> None:
        """Let the robot that is asked fail, or work again."""
        number = self._asked()
        if number in self.session.setup(self.pane).failed:
            self.session.revive_robot(number)
        else:
            self.session.fail_robot(number)

    def remove_robot(self) -> None:
        """Take the robot that is asked out."""
        self.session.remove_robot(self._asked())

    def _asked(self) -> int:
        if self.selected is None:
            raise ParameterError("no robot is chosen: click one first, or press Tab")
        return self.selected

    def cancel(self) -> None:
        """Give up what is being drawn, else put the tool away."""
        if not self.tool.cancel(self.session) and self.tool is not self.hand:
            self.tool = self.hand

    def widen(self, factor: float) -> None:
        """Draw wider walls, or narrower ones; with the brush in hand, take a larger or smaller one."""
        if isinstance(self.tool, Brush):
            self.say(self.tool.widen(self.session, factor))
            return
        wall = self.tools["wall"]
        assert isinstance(wall, Wall)
        wall.widen(factor)
        self.say(f"walls are {wall.width:g} m wide")

    def switch_theme(self) -> None:
        """Light or dark."""
        self.theme = "dark" if self.theme == "light" else "light"

    def switch_fade(self) -> None:
        """Let trajectories fade, or not."""
        self.fade = not self.fade
        self.say(f"trajectories show the last {FADE:g} s" if self.fade else "trajectories stay")

    def switch_suggestions(self) -> None:
        """Say what can be tried once the team has settled, or do not."""
        self.suggests = not self.suggests
        self.say(f"suggestions {'on' if self.suggests else 'off'}")

    def switch_panel(self) -> None:
        """Hide the panel, or show it."""
        self.panel = not self.panel

    def save_map(self) -> None:
        """Write the map as it is now to a file that is not there yet."""
        stem = Path(self.map_name).stem or "map"
        target = free_name(self.folder, stem, ".json")
        save_map(self.session.environment, target)
        self.map_name = str(target)
        self.say(f"map saved: {target}")

    @property
    def view(self) -> dict[str, object]:
        """View settings for the session's file."""
        return {"shown": sorted(self.shown), "theme": self.theme, "map": self.map_name}

    def save_session(self, path: Path | None = None) -> None:
        """Write the session to its file, or to another."""
        saved = self.workspace.save(self.folder, self.view, path)
        self._note_recent(saved)
        self.say(f"session saved: {saved}")

    def open_file(self, path: Path) -> None:
        """Open a session or a map, by the ending of its name."""
        if path.suffix == SUFFIX:
            self.open_session(path)
        else:
            self.open_map(str(path))
            self.say(f"map opened: {path}")

    def _note_recent(self, path: Path) -> None:
        name = str(path.absolute())
        self.recent = [name, *(each for each in self.recent if each != name)][:_RECENT]

    def open_session(self, path: Path) -> None:
        """Go on with a session from its file; what was not saved of this one stays aside."""
        self._take(*opened(path, self.laws, self._kept_in))
        self._note_recent(path)
        self.say(f"session opened: {path}")

    def recover(self, work: Recovered | None = None) -> None:
        """Go on with a session that was left behind, by default the newest."""
        found = recoverable(self._kept_in) if work is None else (work,)
        if not found:
            self.say("nothing was left behind")
            return
        self._take(*recovered(found[0], self.laws, self._kept_in))
        self.say(f"recovered: {found[0].words}")

    def _take(self, workspace: Workspace, view: Mapping[str, Any]) -> None:
        self.workspace.close()
        self.workspace = workspace
        self.show_session(workspace.session)
        self.map_name = str(view.get("map") or self.session.environment.name)
        if isinstance(shown := view.get("shown"), list):
            self.shown = set(map(str, shown))
        self.hand.selected = None

    def show_session(self, session: Session) -> None:
        """Go on with another session."""
        session.clock.budget = self.session.clock.budget
        session.serial = max(session.serial, self.session.serial) + 1
        self.session = session
        self.version += 1
        self.look_at_map()

    def enter_branch(self, by: int) -> None:
        """Go to the end of the next branch, or of the one before."""
        session = self.session
        branches = session.branches
        now = next((k for k, each in enumerate(branches) if each.node is session.head), -1)
        self.enter(branches[(now + by) % len(branches)].node.number)

    def enter(self, node: int) -> None:
        """Go to the end of the branch that ends with a node of the document."""
        branches = self.session.branches
        k = [each.node.number for each in branches].index(node)
        self.session.enter(branches[k].node)
        self.say(f"branch {k + 1} of {len(branches)}: {branches[k].words}")

    def set_parameter(self, name: str, value: Value) -> None:
        """Give a gain of the chosen controller, or with ``team.`` a limit of the team, another value."""
        setup = self.session.setup(self.pane)
        if name.startswith("team."):
            self.session.set_limits(with_limit(setup.limits, name, value))
        else:
            self.session.set_law(self.pane, setup.law.with_gain(name, value))

    def set_law(self, number: int, name: str) -> None:
        """Let a controller take over in a pane."""
        pane = self.session.panes[number]
        if self.session.setup(pane).law.name != name:
            self.session.set_law(pane, ControllerChoice(name))
        self.active = number

    def use_law(self, name: str) -> None:
        """Let a controller take over in the chosen pane; it may be new to the list."""
        ControllerChoice(name).made()
        if name not in self.laws:
            self.laws.append(name)
        self.set_law(self.active, name)

    def ask(self, number: int) -> None:
        """Ask a robot by its number."""
        if number not in self.numbers:
            raise ParameterError(f"there is no robot {number}")
        self.hand.selected = number

    def enter_named_branch(self, name: str) -> None:
        """Go to the end of a branch, by its number or name."""
        self.session.enter(self.session.document.branch(name).node)


def plain(message: str) -> str:
    """Return a message without the places in files that mean nothing in a window.

    >>> plain("team.max_speed: 0 m/s, but a number was wanted")
    'max_speed: 0 m/s, but a number was wanted'
    """
    return message.removeprefix("team.").removeprefix("obstacles: ")
