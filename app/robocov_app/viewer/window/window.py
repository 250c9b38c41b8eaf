"""The viewer's window, which handles events, advances time and draws frames."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import pygame

from robocov_app.look.theme import get_theme
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.commands.command import Command, CommandTable
from robocov_app.toolkit.dialogs import Dialogs
from robocov_app.toolkit.keyboard_focus import FocusGroup, KeyboardFocus
from robocov_app.toolkit.tool_rail import ToolRail
from robocov_app.toolkit.tools.pointer import LEFT_BUTTON
from robocov_app.toolkit.window.command_window import CommandWindow
from robocov_app.toolkit.window.display import set_title
from robocov_app.toolkit.window.input import SCROLL_PX_PER_NOTCH, get_key_name, get_wheel_notches
from robocov_app.toolkit.window.layout import is_inside
from robocov_app.toolkit.window.map_pictures import MapPictures
from robocov_app.toolkit.window.page_view import PageAppearance, WindowControls
from robocov_app.toolkit.window.window import FPS
from robocov_app.toolkit.window.window_display import WindowDisplay
from robocov_app.toolkit.window_part import WindowPart
from robocov_app.viewer.canvas.canvas import ViewerCanvas
from robocov_app.viewer.canvas.layer_bar import LayerBar
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.chart.chart_focus import ChartFocus
from robocov_app.viewer.commands.viewer_commands import GROUPS, list_parameter_commands, list_viewer_commands
from robocov_app.viewer.commands.window_commands import ViewerWindowActions, list_window_commands
from robocov_app.viewer.costs.cost_curves import CostCurves
from robocov_app.viewer.lessons.guide import LessonGuide
from robocov_app.viewer.lessons.player import LessonPlayer, LessonState
from robocov_app.viewer.panel.panel import ViewerPanel
from robocov_app.viewer.panel.robot_inspector import RobotInspector
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.files.run_saver import RunSaver
from robocov_app.viewer.sharing.share import ShareActions
from robocov_app.viewer.window.arrangement import Arrangement
from robocov_app.viewer.window.dialogs import build_branch_dialog, build_comparison_dialog, build_file_dialog
from robocov_app.viewer.window.map_picture import PictureSources, ViewerMapPicture
from robocov_app.viewer.window.menus import COMMANDS_OF_SHARE_MENU, WindowMenus
from robocov_app.viewer.window.pointer import PointerActions, PointerTargets, ViewerPointer
from robocov_app.viewer.window.session_runner import SessionRunner
from robocov_app.viewer.window.status import HINT, list_facts
from robocov_app.viewer.window.status_display import StatusDisplay
from robocov_app.viewer.window.top_bar import TopBar
from robocov_app.viewer.window.video_recorder import VideoRecorder
from robocov_app.viewer.window.window_controls import WindowControlsReader

KEYS_HINT = "Wheel: zoom at the cursor · drag the floor or the right button: pan · F1 or Esc closes"
PALETTE_HINT = "Type a command, or  k_rep 0.5 · robots 12 · map office · speed 4"
_FOCUS_KEYS = ("tab", "shift+tab")


class ViewerWindow(CommandWindow):
    """The window that shows a session and lets the user change it.

    Parameters
    ----------
    viewer : Presenter
        State of the window, and actions on it.
    size : tuple of int
        Width and height, px.
    scale : float or None
        Size of texts and widgets; None for one that suits the size of the window.
    is_unattended : bool
        Whether there is no user. Then videos wait for their encoder instead of dropping frames, and lessons
        answer their own questions.
    display : WindowDisplay, optional
        Display of another window, which this one temporarily replaces; by default a new window is opened.

    Attributes
    ----------
    viewer : Presenter
        State of the window, and actions on it.
    canvas : ViewerCanvas
        The panes.
    layer_bar : LayerBar
        The legend, which shows and hides layers.
    chart : Chart
        The chart and the time slider.
    panel : ViewerPanel
        The panel.
    top_bar : TopBar
        The bar at the top.
    tool_rail : ToolRail
        The tools, to the left of the panes.
    dialogs : Dialogs
        Shows the open dialog.
    commands : CommandTable
        All commands.
    lesson : LessonGuide
        The lesson, if there is one.
    video_recorder : VideoRecorder
        Records videos of the window.
    run_saver : RunSaver
        Saves runs in other processes.
    focus : KeyboardFocus
        Moves the keyboard focus through all controls.
    chart_focus : ChartFocus
        The keyboard focus in the chart.
    share : ShareActions
        Shares the session as text, as a file or as a link.
    help_page : HelpPage
        The page with the keys of all commands.
    top_bar_class : type of TopBar
        Class of the top bar.
    """

    groups = GROUPS
    keys_hint = KEYS_HINT
    palette_hint = PALETTE_HINT
    hint = HINT
    top_bar_class: type[TopBar] = TopBar

    panel: ViewerPanel
    pointer: ViewerPointer
    map_pictures: MapPictures

    def __init__(
        self,
        viewer: Presenter,
        size: tuple[int, int],
        scale: float | None,
        *,
        is_unattended: bool = False,
        display: WindowDisplay | None = None,
    ) -> None:
        """Build all parts of the window, and draw the first frame."""
        super().__init__(viewer, Dialogs(), size, scale, display)
        self.viewer = viewer
        set_title(viewer.files.title)
        self.is_unattended = is_unattended
        self.video_recorder = VideoRecorder(viewer, waits=is_unattended)
        self.run_saver = RunSaver(viewer.costs.lattice)
        self.canvas = ViewerCanvas(viewer, get_theme(viewer.view.theme))
        self.canvas.camera.is_animated = not is_unattended
        self.chart = Chart(viewer)
        self.lesson = LessonGuide(viewer, self.canvas.camera.fit, is_unattended=is_unattended)
        viewer.files.before_opening = self.lesson.end
        titles = {layer.name: layer.title for layer in build_standard_layers()}
        self.share = ShareActions(viewer, lambda: self.remote)
        window_commands = list_window_commands(self.canvas, self.chart, self.share, self._build_actions())
        listed = [*list_viewer_commands(viewer, titles), *window_commands, *self.list_more_commands()]
        self.commands = CommandTable(listed, viewer.attempt, lambda: list_parameter_commands(viewer))
        self._menus = WindowMenus(viewer, self.share, self.commands, self.dialogs, self.run_command)
        self.panel = ViewerPanel(viewer, titles, self.commands, self.run_command)
        self.layer_bar = LayerBar(viewer.view, self.commands, self.run_command)
        self.top_bar = self.top_bar_class(viewer, self.commands, self.run_command)
        self.tool_rail = ToolRail(viewer.toolbox, self.commands, self.run_command)
        self.chart_focus = ChartFocus(self.chart)
        self.focus = KeyboardFocus(self._list_focus_groups)
        targets = PointerTargets(self.canvas, self.chart, self.layer_bar, self.parts)
        actions = PointerActions(
            leave_lesson=self.lesson.leave,
            open_menu=self._menus.open_context_menu,
            show_robot_page=lambda: self.panel.show_tab("robot"),
        )
        self.pointer = ViewerPointer(viewer, targets, actions)
        self._cost_curves = CostCurves(viewer)
        self._runner = SessionRunner(viewer)
        self._status = StatusDisplay(viewer, self.lesson, self.hint, can_suggest=not is_unattended)
        sources = PictureSources(self.canvas, self.chart, self.lesson, self._status)
        self.map_pictures = MapPictures(self, lambda: ViewerMapPicture(viewer, sources))
        self._inspector = RobotInspector(viewer, self.panel)
        self._controls_reader = WindowControlsReader(viewer, self.lesson, self.dialogs, self.parts)
        self._arrangement = Arrangement(viewer, self.lesson, self.canvas, self.chart, self.parts)
        self._arrange()
        self.draw()

    def list_more_commands(self) -> list[Command]:
        """Return further commands of a subclass."""
        return []

    def _build_actions(self) -> ViewerWindowActions:
        """Return the functions of this window that commands call."""
        viewer = self.viewer
        return ViewerWindowActions(
            zoom=lambda factor: self.pointer.zoom(factor),
            show_next_tab=lambda: self.panel.show_next_tab(),
            toggle_fullscreen=self.toggle_fullscreen,
            save_screenshot=lambda: self.display.save_screenshot(viewer.files.folder),
            toggle_recording=lambda: self.video_recorder.toggle(self.screen),
            describe_recording=self.video_recorder.describe_toggle,
            save_run=lambda: self.run_saver.save(viewer.session, viewer.files.folder, viewer.files.map_name),
            open_file=lambda: self.dialogs.ask(build_file_dialog(viewer)),
            list_branches=lambda: self.dialogs.ask(build_branch_dialog(viewer)),
            compare=lambda: self.dialogs.ask(build_comparison_dialog(viewer)),
            toggle_help=self.toggle_help,
            open_palette=self.open_palette,
            toggle_layer_menu=lambda: self.layer_bar.toggle_menu(),
            open_preset_menu=lambda: self._menus.open_preset_menu(self.layer_bar.find_preset_position()),
            focus_next=lambda: self.focus.step(1),
            focus_previous=lambda: self.focus.step(-1),
            open_share_menu=lambda: self._menus.open_share_menu(self.top_bar.find_menu_position("share")),
            toggle_lesson=self.lesson.toggle,
            quit=self.handle_quit,
        )

    @property
    def parts(self) -> Sequence[WindowPart]:
        """Top bar, tool rail and panel."""
        return (self.top_bar, self.tool_rail, self.panel)

    def _list_focus_groups(self) -> list[FocusGroup]:
        """Return the visible parts that Tab visits, among top bar, tool rail, chips, panel and chart."""
        groups: list[FocusGroup] = []
        if not self.top_bar.hidden:
            groups.append(self.top_bar.ui)
        if not self.tool_rail.hidden:
            groups.append(self.tool_rail.ui)
        groups.append(self.layer_bar)
        if not self.panel.hidden and not self.panel.is_covered:
            groups.append(self.panel.ui)
        groups.append(self.chart_focus)
        return groups

    def show_result(self, message: str) -> None:
        """Show the message of a command of the palette, and update the report on the robot."""
        super().show_result(message)
        self.panel.report = None

    def create_save_point(self) -> Callable[[], None]:
        """Return a function that reverts all later changes."""
        viewer = self.viewer
        session = viewer.session
        point = session.build_save_point()

        def roll_back() -> None:
            if viewer.session is session:
                session.restore(point)
            viewer.tool.cancel(viewer.session)
            viewer.revision += 1

        return roll_back

    def dismiss_message(self) -> None:
        """Remove the status message or the suggestion."""
        super().dismiss_message()
        self._status.dismiss_suggestion()

    def restore_view(self) -> None:
        """Close everything that may have caused an exception while drawing."""
        super().restore_view()
        self.lesson.end()
        self.layer_bar.is_open = False
        self.canvas.camera.fit()

    def close(self) -> None:
        """Save a draft of unsaved work, and end the lesson, the video and the cost computation."""
        files = self.viewer.files
        files.workspace.save_draft(files.view, at_once=True)
        # This restores the session and the layers from before the lesson, which are those to be saved.
        self.lesson.end()
        self.video_recorder.close()
        self._cost_curves.close()
        self.viewer.costs.close()

    def set_appearance(self, appearance: PageAppearance) -> None:
        """Adopt the appearance that suits the browser page that shows the window; see `BaseWindow`."""
        self.scale = appearance.scale
        view = self.viewer.view
        view.theme = appearance.theme
        if appearance.shows_panel is not None:
            view.has_panel = appearance.shows_panel
        view.is_compact = appearance.is_compact
        view.is_motion_reduced = appearance.is_motion_reduced
        self.dialogs.set_appearance(appearance)
        # If a phone controls the window, its picture sets the reach again.
        self.canvas.finger_reach = 0.0
        self.layer_bar.max_menu_width = appearance.max_dialog_width
        self.viewer.revision += 1

    @property
    def controls(self) -> WindowControls:
        """State that the buttons of a phone's page show."""
        is_covered = self.find_cover() is not None
        return self._controls_reader.read(self.screen.get_size(), self.layout, is_covered=is_covered)

    def find_cover(self) -> pygame.Rect | None:
        """Return the box of the dialog, menu or help page that covers the map; None if nothing does."""
        cover = super().find_cover()
        if cover is None and self.layer_bar.is_open:
            return self.layer_bar.menu_box
        return cover

    def close_sheet(self) -> None:
        """Close the panel of a narrow window, or leave the lesson in its place."""
        self.run_command("panel" if self.lesson.shown is None else "tour")

    def update(self, seconds: float) -> None:
        """Advance everything by a time, s."""
        self.video_recorder.pass_time(seconds)
        self._pass_time(seconds)
        set_title(self.viewer.files.title)
        self.canvas.camera.update(seconds)
        self._cost_curves.update()
        self._arrange()
        self.canvas.follow_robot()
        self._inspector.update(self.viewer.now)
        self.panel.is_covered = self.lesson.shown is not None
        self.panel.update(seconds)
        self.top_bar.update()
        self.tool_rail.update()
        self.pointer.show_action(self.cursor)

    def build_frame_key(self) -> object:
        """Return all values that the frame depends on, to detect changes; None while something moves."""
        viewer = self.viewer
        session = viewer.session
        is_at_rest = (
            session.timeline.is_settled
            and session.timeline.is_live
            and not session.displayed.environment.has_moving_obstacles
        )
        if (
            self.video_recorder.video is not None
            or self.canvas.camera.is_moving
            or (session.playback.is_playing and not session.playback.is_suspended and not is_at_rest)
        ):
            return None
        return (
            viewer.revision,
            viewer.message,
            viewer.has_error_message,
            session.displayed.time,
            session.timeline.past_version,
            session.playback.is_playing,
            self._cost_curves.answer_count,
            self._status.seek_progress,
            viewer.costs.state,
            self._arrangement.key,
            any(part.ui.needs_redraw for part in self.parts),
            self.lesson.frame_key,
            self.layer_bar.frame_key,
            self.chart_focus.focus,
        )

    def _pass_time(self, seconds: float) -> None:
        """Advance the message, drafts, saved runs, the lesson and the simulation by real time, s."""
        viewer = self.viewer
        viewer.pass_time(seconds)
        viewer.files.workspace.save_draft(viewer.files.view)
        for message, is_error in self.run_saver.poll():
            viewer.show_message(message, is_error=is_error)
        is_map_covered = self.dialogs.is_open or self.help_page.is_open
        viewer.session.playback.is_suspended = is_map_covered
        if not is_map_covered:
            self.lesson.advance(seconds)
        viewer.view.has_branches = not _has_open_question(self.lesson.shown)
        # After a wait for events, the elapsed time is simulated in slices of one frame each, because the
        # clock limits the time of a single frame.
        slices = max(round(seconds * FPS), 1) if self.is_idle else 1
        self._runner.advance(seconds, slices)

    def _arrange(self) -> None:
        """Lay out the window if its size, or the number or shape of panes has changed."""
        self._arrangement.update(self.screen.get_size(), self.suitable_scale)
        self.layout = self._arrangement.layout
        self.theme = self._arrangement.theme

    def draw(self) -> None:
        """Draw all parts of the window, show the frame, and add it to the video."""
        layout = self.layout
        if len(layout.panes) > 1:
            self.screen.fill(self.theme.background, pygame.Rect(layout.arena))
        self.canvas.draw(self.screen)
        self.chart.draw(self.screen)
        self.chart_focus.draw(self.screen)
        facts = list_facts(self.viewer, self.frame_rate, self._runner.step_rate, self.video_recorder.duration)
        if layout.status.height:
            has_hint = self.has_status_hint
            self._status.draw_status_line(self.screen, layout, self.theme, facts, has_hint=has_hint)
        has_lesson = self.lesson.draw(self.screen, layout, self.theme)
        if not has_lesson and layout.has_panel:
            self.panel.draw(self.screen)
        self.sheet_handle.draw(self.screen, layout, self.theme)
        find_strip_texts = partial(self.canvas.find_strip_texts, self.screen)
        self.message_box = self._status.draw_message(self.screen, layout, self.theme, find_strip_texts)
        # A preset would replace the layers of a chapter, and leave the lesson.
        self.layer_bar.has_presets = self.lesson.shown is None
        self.layer_bar.draw(self.screen, layout, self.theme, self.canvas.layers, self.canvas.scenes)
        if not layout.is_compact:
            self.tool_rail.draw(self.screen)
            self.top_bar.draw(self.screen)
        self.layer_bar.draw_tool_tip(self.screen)
        self.draw_above_map()
        self.video_recorder.add_frame(self.screen)

    def run_command(self, name: str) -> None:
        """Run the command with this name, unless the lesson or the help page handles it."""
        if name == "cancel" and self.layer_bar.is_open:
            self.layer_bar.toggle_menu()
            return
        closes_help = name == "cancel" and self.help_page.is_open
        is_for_window = closes_help or name in COMMANDS_OF_SHARE_MENU
        if not is_for_window and self.lesson.handle_command(name):
            return
        super().run_command(name)
        self.panel.report = None
        if name in ("robot:next", "robot:previous"):
            self.panel.show_tab("robot")

    def open_file(self, path: Path) -> None:
        """Open a session or a map that was dropped on the window."""
        self.viewer.files.open_file(path)

    def use_key(self, event: pygame.event.Event) -> bool:
        """Offer a key to the lesson, the layer bar, the chart, the focused control and the selection.

        Returns
        -------
        bool
            Whether the key was used. Tab never is: its command moves the focus.
        """
        name = get_key_name(event)
        if name in _FOCUS_KEYS:
            return False
        return (
            self.lesson.handle_key(event.unicode)
            or self.layer_bar.handle_key(name)
            or self.chart_focus.handle_key(name)
            or super().use_key(event)
            or self.viewer.selection.nudge_by_key(name)
        )

    def handle_mouse(self, event: pygame.event.Event) -> None:
        """Pass a mouse event to the page of the lesson, or else to the panel, the chart or the panes."""
        if event.type == pygame.MOUSEBUTTONDOWN:
            self.layer_bar.clear_focus()
            self.chart_focus.clear_focus()
        if event.type == pygame.MOUSEWHEEL and is_inside(self.layout.panel, self.pointer.pixel):
            distance = -SCROLL_PX_PER_NOTCH * self.layout.scale * get_wheel_notches(event)
            if self.lesson.scroll(distance):
                return
        is_left_press = event.type == pygame.MOUSEBUTTONDOWN and event.button == LEFT_BUTTON
        if not (is_left_press and self.lesson.click(event.pos)):
            super().handle_mouse(event)


def _has_open_question(lesson: LessonPlayer | None) -> bool:
    """Return whether the chapter of a lesson has a question whose answer it has not shown yet."""
    if lesson is None or lesson.chapter.question is None:
        return False
    return lesson.state in (LessonState.ASKING, LessonState.PLAYING)
