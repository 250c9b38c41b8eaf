"""The panel on the right: frequently used settings are always visible, the others are on tabbed pages."""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import chain, zip_longest
from pathlib import Path

import numpy as np
from pygame import Rect

from robocov.controllers import get_controller_label, load_controller_class
from robocov.errors import ParameterError
from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.look.theme import Theme
from robocov_app.render.dashes import cut_into_dashes
from robocov_app.render.fonts import shorten_to_width
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.overlay import create_flat_canvas
from robocov_app.toolkit.panel import CommandPanel, PanelButton, PanelPage
from robocov_app.toolkit.sentence_case import to_sentence_case
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX, draw_box
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import PANEL_WIDTH_PX, Layout
from robocov_app.viewer.explanation.explain import RobotReport
from robocov_app.viewer.explanation.quantities import MIN_FORCE_N
from robocov_app.viewer.explanation.sentences import ReportLine
from robocov_app.viewer.panel.parameter_drawings import get_parameter_drawing
from robocov_app.viewer.panel.parameters import NumberParameter, OptionParameter, Parameter
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.setup.scenario import MAX_PANES

LAYERS_WITHOUT_CHECK_BOX = frozenset({"obstacles", "boundary", "robots", "failed", "selection", "caption"})
"""Layers that are nearly always visible. They can still be toggled by keys."""

_FILE_BUTTONS = (
    PanelButton("Screenshot", "screenshot"),
    PanelButton("Record video", "video"),
    PanelButton("Save session", "save:session"),
    PanelButton("Recover…", "recover"),
    PanelButton("Save run", "save:run"),
    PanelButton("Save map", "save:map"),
    PanelButton("◀ Branch", "branch:previous"),
    PanelButton("Branch ▶", "branch:next"),
    PanelButton("Undo", "undo"),
    PanelButton("Redo", "redo"),
    PanelButton("Keys", "help"),
    PanelButton("Commands…", "palette"),
    PanelButton("Lesson", "tour"),
    PanelButton("Full screen", "fullscreen"),
)
_REDRAW_INTERVAL_S = 0.25  # while the simulation runs
_NO_ROBOT_TEXT = "Click a robot, or press I, to see why it is or is not moving."
_SLIDER_TIP = "Hold Shift while dragging for fine steps"
_TAB_TITLES = {"show": "Layers"}
_NO_ROBOT_REASON = "no robot is selected: click one first, or press I"

# Lengths in pixels at scale 1.
_ARROW_PX = 13.0
_MIN_ARROW_FRACTION = 0.35
_ARROW_CENTER_PX = (14, 8)
_REPORT_INDENT_PX = 34.0
_LABEL_PX = 116
_RESET_PX = 22
_PARAMETER_GAP_PX = 3
_BUTTON_MARGIN_PX = 3  # on each side of the text of a small button
_NUMBER_PX = (58, 42)  # the value and its unit
_UNLIMITED_PX = (103,)  # the word "unlimited" instead of value and unit
_ROW_PX = 24
_HIGH_ROW_PX = 28
_MAP_PX = (28, 0, 34, 104)  # menus of the map and of its starts, each with its label
_LABEL_GAP_PX = 4
# Label and number of robots, minus, plus, a gap, label and value of the seed, next seed.
_ROBOTS_AND_SEED_PX = (49, 44, 24, 24, 8, 36, 60, 26)
_SLIDER_ROW_PX = 20
_FINGER_SLIDER_ROW_PX = 30
_FINGER_SCALE = 1.2
"""Factor of the size of widgets on a phone."""
_MARK_PX = 4  # bar next to the controller of the active pane
_SAMPLE_PX = 24
_SAMPLE_LINE_PX = 3.0
_CLOSE_PX = 28
_COMPARE_PX = 96


class ViewerPanel(CommandPanel):
    """Shows the session's settings and lets the user change them.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    layer_titles : dict of str to str
        Title of each layer, by its name.
    commands : CommandTable
        The window's commands.
    run_command : callable
        Runs a command by its name.

    Attributes
    ----------
    commands : CommandTable
        The window's commands.
    report : RobotReport or None
        Explanation of the selected robot.
    is_in_sheet : bool
        Whether the panel is below the handle of a sheet.
    """

    tabs = ("parameters", "show", "robot", "file")
    tab_widths = (86, 64, 64, 64)

    def __init__(
        self,
        viewer: Presenter,
        layer_titles: dict[str, str],
        commands: CommandTable,
        run_command: Callable[[str], object],
    ) -> None:
        """Build the panel without a report."""
        super().__init__(commands, run_command)
        self.viewer = viewer
        self.titles = layer_titles
        self.report: RobotReport | None = None
        self.is_in_sheet = False
        self._age_s = 0.0  # time since the panel was drawn

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adopt a layout and a theme; on a phone, widgets are larger if the width allows."""
        scale = layout.scale
        if layout.is_compact and layout.has_panel:
            scale = min(_FINGER_SCALE * scale, max(layout.panel.width / PANEL_WIDTH_PX, scale))
        self.is_in_sheet = layout.handle.height > 0
        super().arrange(layout._replace(scale=scale), theme)

    def list_pages(self) -> dict[str, PanelPage]:
        """Return the pages by the names of their tabs."""
        return {
            "parameters": self._show_parameters,
            "show": self._show_layers,
            "robot": self._show_robot,
            "file": self._show_files,
        }

    def update(self, seconds: float) -> None:
        """Request a redraw of the panel if its content has changed; called once per frame."""
        self._age_s += seconds
        if self.is_covered and self.ui.is_busy:
            self.ui.clear_focus()
        viewer = self.viewer
        session = viewer.session
        setups = tuple(session.displayed.get_setup(pane) for pane in session.timeline.panes)
        content = (
            viewer.revision,
            self.tab,
            viewer.view.theme,
            session.playback.is_playing,
            id(self.report),
            # Changes when a seek ends, which may be some frames after the command that started it.
            session.timeline.past_version,
            setups,
        )
        is_running = session.playback.is_playing and not session.timeline.is_settled
        is_old = is_running and self._age_s >= _REDRAW_INTERVAL_S
        if content != self.drawn_state or is_old:
            self.drawn_state = content
            self._age_s = 0.0
            self.ui.needs_redraw = True

    def show_content(self, ui: Ui) -> None:
        """Show the settings that are always visible, and the page of the open tab."""
        ui.inset(12, 0 if self.is_in_sheet else 8, 12)
        self._show_environment(ui)
        self._show_controllers(ui)
        self.show_pages(ui, _TAB_TITLES)

    def _show_environment(self, ui: Ui) -> None:
        """Show the map, the start, the number of robots and the seed."""
        viewer = self.viewer
        scenario = viewer.session.timeline.scenario
        files = viewer.files
        labels = shorten_names(files.list_maps())
        maps = {label: name for name, label in labels.items()}
        ui.header("Map and team")
        ui.row(*_MAP_PX, height=_HIGH_ROW_PX, gap=_LABEL_GAP_PX, below=5)
        ui.label("Map")
        label = ui.dropdown("map", list(maps), labels.get(files.map_name, files.map_name), tip="Map")
        if label is not None:
            viewer.attempt(partial(files.open_map, maps[label]))
        ui.label("Start")
        starts = viewer.playback.list_starts()
        start = ui.dropdown("start", starts, scenario.start_name, tip="Where the robots start")
        if start is not None:
            viewer.attempt(partial(viewer.playback.restart, start=start))
        ui.row(*_ROBOTS_AND_SEED_PX, gap=3.5, below=8)
        ui.label("Robots")
        robots = ui.text_field("robots", str(len(viewer.robot_numbers)))
        if robots is not None:
            viewer.attempt(partial(self.commands.run_text, f"robots {robots}"))
        self.show_button(ui, "−", "fewer")
        self.show_button(ui, "+", "more")
        ui.cell()
        ui.label("Seed", tip="Number from which random starting positions are drawn")
        seed = ui.text_field("seed", str(scenario.seed))
        if seed is not None:
            viewer.attempt(partial(self.commands.run_text, f"seed {seed}"))
        self.show_button(ui, "↻", "seed:next")

    def _show_controllers(self, ui: Ui) -> None:
        """Show a row for the controller of each pane, and a button that adds a pane."""
        viewer = self.viewer
        session = viewer.session
        choices = [session.displayed.get_setup(pane).controller for pane in session.timeline.panes]
        labels = label_controllers(viewer.controllers, {choice.name: choice.label for choice in choices})
        count = len(choices)
        ui.row(0, _COMPARE_PX, height=_ROW_PX, below=4)
        ui.label("Controller" if count == 1 else "Controllers, side by side", style="header")
        if count < MAX_PANES:
            self.show_button(ui, "+ Compare", "pane:add", small=True)
        styles = choose_curve_styles([choice.name for choice in choices])
        for k, choice in enumerate(choices):
            self._show_controller(ui, k, labels, labels[choice.name], styles[k])
        ui.space(4)

    def _show_controller(
        self, ui: Ui, pane: int, labels: Mapping[str, str], label: str, style: CurveStyle
    ) -> None:
        """Show the row of a pane: a sample of its curve, and the menu of controllers.

        With several panes, it also has a mark for the active pane, and a button that removes the pane.

        Parameters
        ----------
        ui : Ui
            The page of the panel.
        pane : int
            Index of the pane.
        labels : mapping of str to str
            Label of each controller, by its name.
        label : str
            Label of the controller of the pane.
        style : CurveStyle
            Style of the pane's curve.
        """
        viewer = self.viewer
        is_single = len(viewer.session.timeline.panes) == 1
        columns = (_SAMPLE_PX, 0) if is_single else (_MARK_PX, _SAMPLE_PX, 0, _CLOSE_PX)
        ui.row(*columns, height=_HIGH_ROW_PX, gap=4, below=4)
        if not is_single:
            mark = ui.cell()
            if pane == viewer.active_pane:
                draw_box(ui, mark, ui.theme.accent, radius=_MARK_PX / 2)
        draw_curve_sample(ui, ui.cell(), style)
        names = {text: name for name, text in labels.items()}
        chosen = ui.dropdown(f"controller:{pane}", list(names), label, tip="Controller of this pane")
        if chosen is not None:
            viewer.attempt(partial(viewer.comparison.set_controller, pane, names[chosen]))
        if not is_single and ui.icon_button("close", "Remove", key=f"close:{pane}", tip="Remove this pane"):
            # The command removes the active pane.
            viewer.inspection.active_pane = pane
            self._run_command("pane:remove")

    def _show_parameters(self, ui: Ui) -> None:
        """Show the frequently used gains and limits, and below them the advanced ones."""
        controller = self.viewer.session.displayed.get_setup(self.viewer.pane).controller
        parameters = self.viewer.comparison.list_parameters()
        basic = [parameter for parameter in parameters if not parameter.is_advanced]
        advanced = [parameter for parameter in parameters if parameter.is_advanced]
        gains = [parameter for parameter in basic if not parameter.name.startswith("team.")]
        limits = [parameter for parameter in basic if parameter.name.startswith("team.")]
        heading = controller.label
        if len(self.viewer.session.timeline.panes) > 1:
            heading = f"Parameters of {controller.label}"
        with ui.scroll(f"parameters:{controller.name}"):
            if ui.section(heading, key="gains"):
                self._show_parameter_group(ui, gains)
            if ui.section("Robots", key="robots"):
                self._show_parameter_group(ui, limits)
            if ui.section("Advanced", key="advanced", starts_open=False):
                self._show_parameter_group(ui, advanced)

    def _show_parameter_group(self, ui: Ui, parameters: list[Parameter]) -> None:
        if not parameters:
            ui.label("This controller has no parameters", style="unit")
        for parameter in parameters:
            if isinstance(parameter, OptionParameter):
                self._show_options(ui, parameter)
            else:
                self._show_number(ui, parameter)
        ui.space(4)

    def _set(self, name: str, value: float | str | None) -> None:
        self.viewer.attempt(partial(self.viewer.comparison.set_parameter, name, value))

    def _show_number(self, ui: Ui, parameter: NumberParameter) -> None:
        """Show two rows for a numeric parameter: name, text field and unit; slider and reset button."""
        name = parameter.name
        unit = parameter.unit
        columns: tuple[float, ...] = _NUMBER_PX
        if parameter.is_unlimited:
            columns = _UNLIMITED_PX
        ui.row(0, *columns, height=_ROW_PX, gap=_PARAMETER_GAP_PX, below=0)
        ui.label(
            parameter.label,
            tip=_build_tip(parameter, unit),
            note=choose_note(parameter),
            drawing=get_parameter_drawing(name),
        )
        text = ui.text_field(name, parameter.format())
        if text is not None:
            self.viewer.attempt(lambda: self.viewer.comparison.set_parameter(name, parameter.parse(text)))
        if not parameter.is_unlimited:
            ui.label(unit, key=f"unit:{name}", style="unit")
        slider_row = _FINGER_SLIDER_ROW_PX if self.viewer.view.is_compact else _SLIDER_ROW_PX
        ui.row(0, _RESET_PX, height=slider_row, gap=_PARAMETER_GAP_PX, below=5)
        step = parameter.slider_step
        tip = "" if step else _SLIDER_TIP
        position = ui.slider(name, parameter.compute_position(), 0.0, 1.0, step=step, tip=tip)
        if position is not None:
            self._set(name, parameter.compute_value(position))
        default = "unlimited" if parameter.default is None else f"{parameter.default:g} {unit}".rstrip()
        self._show_reset(ui, parameter, default)

    def _show_options(self, ui: Ui, parameter: OptionParameter) -> None:
        """Show a row for a parameter with choices: as buttons if they fit side by side, else as a menu."""
        name = parameter.name
        choices = parameter.choices
        free = ui.width - _LABEL_PX - _RESET_PX - 2 * _PARAMETER_GAP_PX
        width = (free - _PARAMETER_GAP_PX * (len(choices) - 1)) / len(choices)
        text_width = width - 2 * _BUTTON_MARGIN_PX
        fits = all(shorten_to_width(choice, round(SMALL_TEXT_PX), text_width) == choice for choice in choices)
        columns = [0.0] * (len(choices) if fits else 1)
        ui.row(_LABEL_PX, *columns, _RESET_PX, height=_ROW_PX, gap=_PARAMETER_GAP_PX, below=3)
        ui.label(parameter.label, tip=_build_tip(parameter))
        if fits:
            for choice in choices:
                is_on = choice == parameter.value
                key = f"{name}:{choice}"
                if ui.button(choice, key=key, tip=parameter.meaning, selected=is_on, small=True):
                    self._set(name, choice)
        else:
            picked = ui.dropdown(name, choices, parameter.value, tip=parameter.meaning)
            if picked is not None:
                self._set(name, picked)
        self._show_reset(ui, parameter, parameter.default)

    def _show_reset(self, ui: Ui, parameter: Parameter, default: str) -> None:
        """Show a button that restores the default, if the value differs from it."""
        if parameter.value == parameter.default:
            ui.cell()
            return
        tip = f"Back to the default: {default}"
        if ui.icon_button("reset", "Reset", key=f"reset:{parameter.name}", tip=tip):
            self._set(parameter.name, parameter.default)

    def _show_layers(self, ui: Ui) -> None:
        """Show a check box for each layer, in two columns, and buttons for the appearance."""
        view = self.viewer.view
        names = [name for name in self.titles if name not in LAYERS_WITHOUT_CHECK_BOX]
        rows = math.ceil(len(names) / 2)
        with ui.scroll("show"):
            ui.row(0, 0, height=21, below=3)
            # The list of names runs down the first column, and continues at the top of the second.
            for name in chain.from_iterable(zip_longest(names[:rows], names[rows:])):
                if name is None:
                    ui.cell()
                    continue
                tip = self.commands[f"layer:{name}"].tip
                if ui.check_box(self.titles[name], key=name, value=name in view.layers, tip=tip) is not None:
                    self._run_command(f"layer:{name}")
            ui.space(5)
            ui.row(0, 0, 0)
            self.show_button(ui, "Fading", "fade", selected=view.fades_trajectories)
            self.show_button(ui, "Dark" if view.theme == "light" else "Light", "theme")
            self.show_button(ui, "Whole map", "fit")

    def _show_robot(self, ui: Ui) -> None:
        """Show buttons that select and change a robot, and the report on it."""
        viewer = self.viewer
        number = viewer.selected_robot
        reason = "" if number is not None else _NO_ROBOT_REASON
        has_failed = number in viewer.session.displayed.get_setup(viewer.pane).failed
        ui.row(0, 0, 0, 0, below=8)
        self.show_button(ui, "◀", "robot:previous")
        self.show_button(ui, "▶", "robot:next")
        self.show_button(ui, "Revive" if has_failed else "Fail", "robot:fail", disabled_reason=reason)
        self.show_button(ui, "Remove", "robot:remove", disabled_reason=reason)
        with ui.scroll(f"robot:{number}"):
            if self.report is None:
                ui.paragraph(_NO_ROBOT_TEXT, color=ui.theme.faint)
            else:
                show_report(ui, self.report)

    def _show_files(self, ui: Ui) -> None:
        ui.row(0, 0, height=_HIGH_ROW_PX, below=5)
        for label, command in _FILE_BUTTONS:
            is_recording = command == "video" and self.viewer.view.is_recording
            text = "Stop video" if is_recording else label
            self.show_button(ui, text, command, selected=is_recording)


def draw_curve_sample(ui: Ui, cell: Rect, style: CurveStyle) -> None:
    """Draw a short line in the style of a curve."""
    if ui.surface is None:
        return
    canvas = create_flat_canvas(ui.surface, ui.theme, ui.scale)
    width = canvas.scale_width(_SAMPLE_LINE_PX)
    dashes = [width * length for length in style.list_dash_lengths()]
    points = np.array([cell.midleft, cell.midright], dtype=float)
    canvas.draw_segments(cut_into_dashes(points, dashes), style.get_color(ui.theme), width)


def choose_note(parameter: Parameter) -> str:
    """Return the symbol of a parameter for display after its label; empty if the label contains it."""
    if parameter.symbol.replace("_", " ") in parameter.label.lower():
        return ""
    return parameter.symbol


def show_report(ui: Ui, report: RobotReport) -> None:
    """Show the explanation of a robot, with an arrow for each force."""
    ui.paragraph(report.title, size=14, bold=True)
    ui.space(3)
    ui.paragraph(to_sentence_case(report.verdict), size=12.5, bold=True, color=ui.theme.accent)
    ui.space(4)
    sizes = [float(np.hypot(*line.vector)) for line in report.lines if line.vector is not None]
    largest = max(sizes, default=1.0)
    for line in report.lines:
        _draw_force(ui, line, largest)
        indent = 0.0 if line.vector is None else _REPORT_INDENT_PX
        ui.paragraph(to_sentence_case(line.text), size=11.5, indent=indent)
        ui.space(3)


def _draw_force(ui: Ui, line: ReportLine, max_force: float) -> None:
    """Draw an arrow to the left of the text of a force; its length increases with the force.

    Parameters
    ----------
    ui : Ui
        The page of the panel.
    line : ReportLine
        The sentence about the force.
    max_force : float
        Magnitude of the largest force in the report, N.
    """
    if ui.surface is None or line.vector is None:
        return
    size = float(np.hypot(*line.vector))
    if size < MIN_FORCE_N:
        return
    fraction = _MIN_ARROW_FRACTION + (1 - _MIN_ARROW_FRACTION) * size / max(max_force, MIN_FORCE_N)
    length = _ARROW_PX * ui.scale * fraction
    # On the screen, y points down.
    half = np.array(line.vector) / size * (length, -length)
    center = np.array(ui.rest.topleft) + np.array(_ARROW_CENTER_PX) * ui.scale
    canvas = create_flat_canvas(ui.surface, ui.theme, ui.scale)
    color = ui.theme.forces.get(line.kind, ui.theme.ink)
    canvas.draw_arrow((center - half).tolist(), (center + half).tolist(), color, 2 * ui.scale)


def shorten_names(files: list[str]) -> dict[str, str]:
    """Return the label of each map in the menu: the file name without its folder, if that is unique.

    >>> shorten_names(["rooms", "/tmp/a/rooms-1.json", "a/x.json", "b/x.json"])
    {'rooms': 'rooms', '/tmp/a/rooms-1.json': 'rooms-1.json', 'a/x.json': 'a/x.json', 'b/x.json': 'b/x.json'}
    """
    names = [Path(file).name for file in files]
    labels: dict[str, str] = {}
    for file, name in zip(files, names, strict=True):
        labels[file] = name if names.count(name) == 1 else file
    return labels


def label_controllers(names: Iterable[str], shown: Mapping[str, str]) -> dict[str, str]:
    """Return unique labels of controllers for the menu.

    Parameters
    ----------
    names : iterable of str
        Names of the offered controllers. Controllers in users' files are loaded to find their labels.
    shown : mapping of str to str
        Label of each controller in use, by name. These are not loaded: they may come from a saved run.

    Returns
    -------
    dict of str to str
        Label of each controller, by name.

    Examples
    --------
    >>> label_controllers(["rapf", "lloyd"], {"theirs.py:Mine": "Mine"})
    {'rapf': 'RAPF', 'lloyd': 'Lloyd', 'theirs.py:Mine': 'Mine'}
    """
    labels: dict[str, str] = {}
    for name in dict.fromkeys([*names, *shown]):
        label = shown[name] if name in shown else _load_label(name)
        file = Path(name.rpartition(":")[0]).name
        candidates = [label, f"{label} ({name})"]
        if file:
            candidates.insert(1, f"{label} ({file})")
        labels[name] = next(candidate for candidate in candidates if candidate not in labels.values())
    return labels


def describe_controllers(names: Iterable[str], shown: Iterable[str]) -> dict[str, str]:
    """Return a line about each controller, by name; empty for those in use, which are not loaded.

    See `label_controllers` for the parameters.

    Examples
    --------
    >>> describe_controllers(["lloyd", "rapf"], ["rapf"])["lloyd"]
    "Lloyd's algorithm: each robot moves to the centroid of its cell and ignores obstacles"
    """
    shown_names = set(shown)
    descriptions: dict[str, str] = {}
    for name in names:
        summary = "" if name in shown_names else _load_summary(name)
        descriptions[name] = to_sentence_case(summary)
    return descriptions


def _load_summary(name: str) -> str:
    try:
        return str(getattr(load_controller_class(name), "summary", ""))
    except ParameterError:  # its file has been changed in the meantime
        return ""


def _load_label(name: str) -> str:
    try:
        return str(load_controller_class(name).label)
    except ParameterError:  # its file has been changed in the meantime
        return get_controller_label(name)


def _build_tip(parameter: Parameter, unit: str = "") -> str:
    """Return the tooltip of a parameter: its name and symbol as the title, its meaning and its unit."""
    meaning = f"{parameter.meaning} ({unit})" if unit else parameter.meaning
    return f"{parameter.label} ({parameter.symbol})\n{meaning[:1].upper()}{meaning[1:]}"
