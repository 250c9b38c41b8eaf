"""The viewer: what every key, button and typed command does, and what is to be shown. Knows no pygame."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import Value
from robocov.environment import Point
from robocov.errors import InputError, ParameterError, RobocovError
from robocov.mapfile import list_bundled_maps, load_map, save_map
from robocov_app.storage.autosave import Draft
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.faults import describe_os_error
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.parameters import Parameter, Pick, gain_parameters, limit_parameters, with_limit
from robocov_app.viewer.session.clock import SPEEDS, find_speed_index, format_speed
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.file import SUFFIX, load_session
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.session import Session, toggle_failure
from robocov_app.viewer.session.workspace import (
    SessionWorkspace,
    describe_draft,
    find_recoverable_drafts,
    recover_draft,
)
from robocov_app.viewer.tools import Brush, Hand, Tool, toolbox

SAID_FOR = 5.0  # seconds for which a message stays
_RECENT = 9  # sessions that are offered again
FADE = 12.0  # seconds of path that trajectories show where they fade


class Presenter:
    """The user's actions in terms of the session, and what of it is shown."""

    def __init__(
        self,
        session: Session,
        costs: Costs,
        shown: set[str],  # names of layers
        folder: Path,  # where things are saved
        map_name: str = "",  # a bundled name or a path
        laws: Iterable[str] = (),  # names of controllers to choose from beside the built-in ones
        kept_in: Path | None = None,  # the folder for unsaved work
        file: Path | None = None,  # of the session
    ) -> None:
        self.session, self.costs, self.shown, self.folder = session, costs, shown, folder
        self._map_names, self._kept_in = {session.displayed.environment.name: map_name}, kept_in
        self.laws, self.tools = list(dict.fromkeys([*CONTROLLERS, *laws])), toolbox()
        self.hand = cast(Hand, self.tools["hand"])
        self.tool: Tool = self.hand
        self.active = 0  # the pane that gains and controllers are chosen for
        self.version = 0  # grows whenever panel and canvas have to look again at what there is
        self.theme = "light"
        self.panel, self.fade, self.suggests, self.filming = True, False, True, False
        self.recent: list[str] = []
        self.message, self.trouble, self._said = "", False, 0.0
        self.now = 0.0  # seconds since the start
        self.cursor: Point | None = None
        self.cursor_pane = 0
        self._mapped: object = None
        self.rested: object = None  # the touch after which the team has settled, though it may sway again
        self.workspace = SessionWorkspace(session, kept_in, file)
        self.look_at_map()

    @property
    def map_name(self) -> str:
        """Bundled name or path of the map of the present, also where undo has led to another one."""
        name = self.session.displayed.environment.name
        return self._map_names.get(name, name)

    @map_name.setter
    def map_name(self, name: str) -> None:
        self._map_names[self.session.displayed.environment.name] = name

    @property
    def numbers(self) -> list[int]:
        return self.session.displayed.get_setup(self.pane).all_numbers

    @property
    def selected(self) -> int | None:
        return self.hand.selected if self.hand.selected in self.numbers else None

    @property
    def pane(self) -> Pane:
        self.active = min(self.active, len(self.session.timeline.panes) - 1)
        return self.session.timeline.panes[self.active]

    def parameters(self) -> list[Parameter | Pick]:
        setup = self.session.displayed.get_setup(self.pane)
        return [*gain_parameters(setup.controller), *limit_parameters(setup.properties)]

    def maps(self) -> list[str]:
        return list(dict.fromkeys([*list_bundled_maps(), *([self.map_name] if self.map_name else [])]))

    def say(self, words: str, *, trouble: bool = False) -> None:
        if words:
            self.message, self.trouble, self._said = words, trouble, self.now

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        if self.message and self.now - self._said > SAID_FOR:
            self.message = ""

    def attempt(self, action: Callable[[], object]) -> None:
        """Do something; say what it returns, or in a sentence why it cannot be done."""
        try:
            words = action()
        except RobocovError as error:
            self.say(plain(str(error)), trouble=True)
        except OSError as error:
            self.say(describe_os_error(error), trouble=True)
        else:
            if isinstance(words, str):
                self.say(words)
        self.version += 1
        self.look_at_map()

    def look_at_map(self) -> None:
        environment = self.session.displayed.environment
        # while it is painted the cost would never be ready
        if environment is not self._mapped and not self.tool.painting:
            self._mapped = environment
            self.costs.environment(environment)

    def take_tool(self, name: str) -> None:
        self.tool.cancel(self.session)
        self.tool = self.tools[name]
        self.say(f"{self.tool.title}: {self.tool.hint}")

    def pause(self) -> None:
        self.session.playback.is_playing, self.session.playback.stop_when_settled = (
            not self.session.playback.is_playing,
            False,
        )

    def settle(self) -> None:
        session = self.session
        session.playback.stop_when_settled = not session.playback.stop_when_settled
        if session.playback.stop_when_settled:
            session.playback.is_playing, session.timeline.is_settled = True, False
            self.say("plays until the team has settled")

    def restart(
        self, *, robots: int | None = None, start: str | None = None, seed: int | None = None
    ) -> None:
        """Start again at time 0, with other robots, starts or seed if they are given."""
        self.session.restart(robots=robots, start=start, seed=seed)

    def change_speed(self, by: int) -> None:
        self.set_speed(
            SPEEDS[min(max(find_speed_index(self.session.playback.clock.speed) + by, 0), len(SPEEDS) - 1)]
        )

    def set_speed(self, speed: float) -> None:
        self.session.playback.clock.speed = speed
        self.say(f"speed {format_speed(speed)}")

    def next_start(self) -> None:
        # an obstacle may have covered the start since
        self.restart(start=_after(self.starts(), self.session.timeline.scenario.start_name))

    def starts(self) -> list[str]:
        return list(dict.fromkeys([*self.session.displayed.environment.starts, "uniform"]))

    def next_map(self, by: int) -> None:
        maps = self.maps()
        now = maps.index(self.map_name) if self.map_name in maps else 0
        passed: list[str] = []
        for k in range(1, len(maps) + 1):
            name = maps[(now + by * k) % len(maps)]
            with suppress(InputError):
                self.open_map(name)
                if passed:
                    self.say(
                        f"no room for {self.session.timeline.scenario.robots} robots: {', '.join(passed)}"
                    )
                return
            passed.append(name)

    def open_map(self, name: str) -> None:
        """Begin on another map; MapError or StartError where that cannot be."""
        self.session.restart(environment=load_map(name))
        self.map_name = name

    def look_by(self, moments: int) -> None:
        self.session.playback.is_playing = False
        self.session.show_offset(moments)

    def look_at(self, time: float) -> None:
        self.session.playback.is_playing = False
        self.session.show_time(time)

    def branch(self) -> None:
        words = "this is the present: go back first (←, or drag the time line)"
        if self.session.branch():
            self.session.playback.is_playing, words = (
                True,
                "goes on from here; what came after stays as a ghost curve",
            )
        self.say(words)

    def next_law(self) -> None:
        name = _after(self.laws, self.session.displayed.get_setup(self.pane).controller.name)
        self.session.set_controller(self.pane, ControllerChoice(name))

    def add_pane(self) -> None:
        there = {pane.controller.name for pane in self.session.timeline.panes}
        self.session.add_pane(ControllerChoice(next((n for n in self.laws if n not in there), self.laws[0])))
        self.active = len(self.session.timeline.panes) - 1
        self.say("all begin anew, from the same starts")

    def remove_pane(self) -> None:
        self.session.remove_pane(self.pane)

    def next_pane(self) -> None:
        self.active = (self.active + 1) % len(self.session.timeline.panes)

    def undo(self) -> None:
        other = "; Alt ← leads to other branches" if self.session.timeline.document.nodes[1:] else ""
        nothing, words = f"nothing to undo{other}", self.session.undo()
        self.say(f"undone: {words}; back at {self.session.displayed.time:.1f} s" if words else nothing)

    def redo(self) -> None:
        words = self.session.redo()
        self.say(f"done again: {words}" if words else "nothing to redo")

    def ask_next(self, by: int) -> None:
        numbers, now = self.numbers, self.selected
        k = (-1 if by > 0 else 0) if now is None else numbers.index(now)
        self.hand.selected = numbers[(k + by) % len(numbers)]

    def fail_or_revive(self) -> None:
        toggle_failure(self.session, self._asked())

    def remove_robot(self) -> None:
        self.session.remove_robot(self._asked())

    def _asked(self) -> int:
        if self.selected is None:
            raise ParameterError("no robot is chosen: click one first, or press Tab")
        return self.selected

    def finish(self) -> str | None:
        return self.tool.finish(self.session)

    def cancel(self) -> None:
        if not self.tool.cancel(self.session) and self.tool is not self.hand:
            self.tool = self.hand

    def widen(self, factor: float) -> None:
        tool = self.tool if isinstance(self.tool, Brush) else self.tools["wall"]
        self.say(tool.widen(self.session, factor))

    def switch_theme(self) -> None:
        self.theme = "dark" if self.theme == "light" else "light"

    def switch_fade(self) -> str:
        self.fade = not self.fade
        return f"trajectories show the last {FADE:g} s" if self.fade else "trajectories stay"

    def switch_suggestions(self) -> str:
        self.suggests = not self.suggests
        return f"suggestions {'on' if self.suggests else 'off'}"

    def switch_panel(self) -> None:
        self.panel = not self.panel

    def save_map(self) -> None:
        target = find_free_path(self.folder, Path(self.map_name).stem or "map", ".json")
        save_map(self.session.displayed.environment, target)
        self.map_name = str(target)
        self.say(f"map saved: {target}")

    @property
    def view(self) -> dict[str, object]:
        return {"shown": sorted(self.shown), "theme": self.theme, "map": self.map_name}

    def save_session(self, path: Path | None = None) -> None:
        saved = self.workspace.save(self.folder, self.view, path)
        self._note_recent(saved)
        self.say(f"session saved: {saved}")

    def open_file(self, path: Path) -> None:
        require_regular_file(path)
        if path.suffix == SUFFIX:
            self.open_session(path)
        else:
            self.open_map(str(path))
            self.say(f"map opened: {path}")

    def _note_recent(self, path: Path) -> None:
        name = str(path.absolute())
        self.recent = [name, *(each for each in self.recent if each != name)][:_RECENT]

    def open_session(self, path: Path) -> None:
        saved = load_session(path, self.laws)
        self._take(SessionWorkspace(Session.open(saved), self._kept_in, path), saved.view)
        self._note_recent(path)
        self.say(f"session opened: {path}")

    def recover(self, work: Draft | None = None) -> str:
        """Go on with a session that was left behind, by default the newest."""
        found = find_recoverable_drafts(self._kept_in) if work is None else (work,)
        if not found:
            return "nothing was left behind"
        self._take(*recover_draft(found[0], self.laws, self._kept_in))
        return f"recovered: {describe_draft(found[0])}"

    def _take(self, workspace: SessionWorkspace, view: Mapping[str, Any]) -> None:
        self.workspace.close()
        self.workspace, self.hand.selected = workspace, None
        self.show_session(workspace.session)
        self.map_name = str(view.get("map") or self.session.displayed.environment.name)
        if isinstance(shown := view.get("shown"), list):
            self.shown = set(map(str, shown))

    def show_session(self, session: Session) -> None:
        session.playback.clock.budget = self.session.playback.clock.budget
        session.timeline.past_version, self.session = (
            max(session.timeline.past_version, self.session.timeline.past_version) + 1,
            session,
        )
        self.version += 1
        self.look_at_map()

    def enter_branch(self, by: int) -> None:
        ends, head = (
            [each.node for each in self.session.timeline.document.list_branches()],
            self.session.timeline.head,
        )
        now = ends.index(head) if head in ends else -1
        self.enter(ends[(now + by) % len(ends)].number)

    def enter(self, node: int) -> None:
        branches = self.session.timeline.document.list_branches()
        k = [each.node.number for each in branches].index(node)
        self.session.seek(branches[k].node)
        self.say(f"branch {k + 1} of {len(branches)}: {branches[k].description}")

    def set_parameter(self, name: str, value: Value) -> None:
        setup = self.session.displayed.get_setup(self.pane)
        if name.startswith("team."):
            self.session.set_properties(with_limit(setup.properties, name, value))
        else:
            self.session.set_controller(self.pane, setup.controller.with_gain(name, value))

    def set_law(self, number: int, name: str) -> None:
        pane = self.session.timeline.panes[number]
        if self.session.displayed.get_setup(pane).controller.name != name:
            self.session.set_controller(pane, ControllerChoice(name))
        self.active = number

    def use_law(self, name: str) -> None:
        ControllerChoice(name).build()
        if name not in self.laws:
            self.laws.append(name)
        self.set_law(self.active, name)

    def ask(self, number: int) -> None:
        if number not in self.numbers:
            raise ParameterError(f"there is no robot {number}")
        self.hand.selected = number


def _after(names: list[str], now: str) -> str:
    return names[(names.index(now) + 1) % len(names)] if now in names else names[0]


def plain(message: str) -> str:
    """Return a message without the places in files that mean nothing in a window.

    >>> plain("team.max_speed: expected a number, got 0 m/s")
    'max_speed: expected a number, got 0 m/s'
    """
    return message.removeprefix("team.").removeprefix("obstacles: ")
