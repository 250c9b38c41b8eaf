"""The window of the editor, which handles events and draws frames."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import pygame

from robocov.environment import Point
from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.team import Team
from robocov_app.editor.tools.tool import EditorTool
from robocov_app.editor.ui.commands import GROUPS, PALETTE_HINT, EditorWindowActions, list_commands
from robocov_app.editor.ui.context_menu import list_menu_commands, select_for_menu
from robocov_app.editor.ui.field_focus import FieldFocus
from robocov_app.editor.ui.file_commands import FileCommands
from robocov_app.editor.ui.importing.dialog import ImportDialog
from robocov_app.editor.ui.map_facts import list_status
from robocov_app.editor.ui.map_picture import EditorMapPicture
from robocov_app.editor.ui.panel import EditorPanel
from robocov_app.editor.ui.play_mode.mode import PlayMode
from robocov_app.editor.ui.pointer import EditorPointer
from robocov_app.editor.ui.team_preview import TeamPreview
from robocov_app.editor.ui.top_bar import EditorTopBar
from robocov_app.editor.ui.typed_commands import list_typed_commands
from robocov_app.editor.ui.typed_values import edit_typed_value
from robocov_app.editor.ui.window_controls import read_window_controls
from robocov_app.look.theme import get_theme
from robocov_app.render.camera import Camera
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.overlay import draw_message, draw_status
from robocov_app.toolkit.tool_rail import ToolRail
from robocov_app.toolkit.tools.tool import CursorShape
from robocov_app.toolkit.window.command_window import CommandWindow
from robocov_app.toolkit.window.display import set_title
from robocov_app.toolkit.window.input import MOUSE_EVENTS
from robocov_app.toolkit.window.layout import build_layout
from robocov_app.toolkit.window.map_pictures import MapPictures
from robocov_app.toolkit.window.page_view import PageAppearance, WindowControls
from robocov_app.toolkit.window_part import WindowPart

STATUS_HINT = "F5: try it · F1: keys"
KEYS_HINT = "Wheel: zoom · right button: pan, or menu · Alt-drag: copy · Ctrl: no snapping · F1 or Esc closes"


class FrameState(NamedTuple):
    """Everything that can change the frame without an event; a frame with an equal state is not redrawn."""

    revision: int
    message: str
    has_error_message: bool
    typed: str
    is_measuring: bool
    problem: Problem | None
    sketch: Sketch
    selection: Selection
    measurement: Measurement | None
    tool: EditorTool
    cursor: Point | None
    shown: frozenset[str]
    grid: float
    snaps: frozenset[str]
    team: Team | None
    camera: Camera
    hovered: Problem | None
    help_page: object
    dialog_id: int
    layout_key: tuple[object, ...] | None
    caption: tuple[str, ...]


class EditorWindow(CommandWindow):
    """The window of the editor.

    Parameters
    ----------
    editor : Editor
        The editor.
    size : tuple of int
        Width and height, px.
    scale : float or None
        Size of text and widgets; None for one that suits the size of the window.
    draft_folder : Path or None
        Folder for drafts; None to save no drafts.
    waits_for_workers : bool
        Whether to wait for computations instead of running them in the background.

    Attributes
    ----------
    editor : Editor
        The editor.
    canvas : EditorCanvas
        The view of the map.
    file_commands : FileCommands
        Commands on files.
    commands : CommandTable
        All commands.
    top_bar : EditorTopBar
        The bar at the top.
    tool_rail : ToolRail
        The tools, to the left of the map.
    panel : EditorPanel
        The panel.
    pointer : EditorPointer
        The mouse over the map.
    play_mode : PlayMode
        Shows the viewer in this window to test the map.
    team_preview : TeamPreview
        Shows the team at a start.
    field_focus : FieldFocus
        Puts the text cursor into fields of the panel.
    map_pictures : MapPictures
        Draws the map for the pages of phones.
    """

    groups = GROUPS
    keys_hint = KEYS_HINT
    palette_hint = PALETTE_HINT

    panel: EditorPanel
    pointer: EditorPointer
    map_pictures: MapPictures

    def __init__(
        self,
        editor: Editor,
        size: tuple[int, int],
        scale: float | None,
        draft_folder: Path | None,
        *,
        waits_for_workers: bool = False,
    ) -> None:
        super().__init__(editor, editor.dialogs, size, scale)
        self.editor = editor
        self.play_mode = PlayMode(editor, self, self._arrange, waits_for_workers=waits_for_workers)
        self.canvas = EditorCanvas(editor)
        self.file_commands = FileCommands(
            editor, draft_folder, self.canvas.fit, waits_for_workers=waits_for_workers
        )
        commands = list_commands(editor, self.canvas, self.file_commands, self._build_actions())
        self.commands = CommandTable(commands, self._attempt, lambda: list_typed_commands(editor))
        self.panel = EditorPanel(editor, self.commands, self.run_command, self._show_problem)
        self.top_bar = EditorTopBar(editor, self.commands, self.run_command)
        self.tool_rail = ToolRail(editor.toolbox, self.commands, self.run_command)
        self.pointer = EditorPointer(editor, self.canvas, self.parts, self.open_menu)
        self.team_preview = TeamPreview(editor, self.canvas)
        self.field_focus = FieldFocus(editor, self.panel, self._arrange)
        editor.snapper.waits_for_targets = waits_for_workers
        self.map_pictures = MapPictures(self, lambda: EditorMapPicture(editor, self.canvas))
        self._layout_key: tuple[object, ...] | None = None
        self._shown_draft_problem = ""
        self._arrange()
        self.canvas.fit()
        editor.request_measurement()
        self.draw()

    def _build_actions(self) -> EditorWindowActions:
        """Build the actions of the window for the commands that run them."""
        # Lambdas, because the panel, the pointer and the field focus are created after the commands.
        return EditorWindowActions(
            start_play_mode=self.play_mode.start,
            save_screenshot=lambda: self.display.save_screenshot(self.editor.folder),
            edit_name=lambda: self.field_focus.edit_name(),
            edit_width=lambda: self.field_focus.edit_width(),
            open_menu=lambda: self.open_menu(self.pointer.pixel),
            hold_pan=lambda: self.pointer.hold_pan(),
            show_next_tab=lambda: self.panel.show_next_tab(),
            toggle_fullscreen=self.toggle_fullscreen,
            toggle_help=self.toggle_help,
            open_palette=self.open_palette,
        )

    @property
    def parts(self) -> Sequence[WindowPart]:
        """Top bar, tool rail and panel."""
        return (self.top_bar, self.tool_rail, self.panel)

    @property
    def controls(self) -> WindowControls:
        """State that the buttons of a phone's page show."""
        size = self.screen.get_size()
        is_covered = self.find_cover() is not None
        return read_window_controls(self.editor, size, self.layout, self.parts, is_covered=is_covered)

    def create_save_point(self) -> Callable[[], None]:
        """Return a function that restores the current state of the document after an unexpected error."""
        editor = self.editor
        document = editor.document
        restore_history = document.history.build_save_point()

        def restore() -> None:
            self.pointer.reset()
            editor.typed = ""
            if editor.document is document:
                restore_history()
            try:
                editor.tool.cancel(editor)
            except Exception:
                # If the tool cannot be canceled, the selection tool replaces it.
                editor.toolbox.current = editor.toolbox.selector
                raise
            finally:
                editor.revision += 1
                document.update_draft()

        return restore

    def restore_view(self) -> None:
        """Close everything that may have caused an error while drawing."""
        super().restore_view()
        self.editor.problem = None
        self.canvas.fit()

    def close(self) -> None:
        """End play mode and all background work."""
        self.play_mode.close()
        self.team_preview.close()
        self.dialogs.close()
        self.editor.snapper.close()

    def build_frame_key(self) -> object:
        """Return everything that can change the frame without an event; None to redraw it always."""
        editor = self.editor
        canvas = self.canvas
        dialog = editor.dialogs.current
        is_importing = isinstance(dialog, ImportDialog) and dialog.is_busy
        needs_redraw = any(part.ui.needs_redraw for part in self.parts)
        if needs_redraw or editor.motion_start_s is not None or is_importing:
            return None
        return FrameState(
            revision=editor.revision,
            message=editor.message,
            has_error_message=editor.has_error_message,
            typed=editor.typed,
            is_measuring=editor.measurement_worker.is_busy,
            problem=editor.problem,
            sketch=editor.sketch,
            selection=editor.selection,
            measurement=editor.measurement,
            tool=editor.tool,
            cursor=editor.cursor,
            shown=frozenset(editor.shown),
            grid=editor.grid,
            snaps=frozenset(editor.snaps),
            team=canvas.team,
            camera=canvas.camera,
            hovered=canvas.hovered,
            help_page=self.help_page.frame_key,
            dialog_id=id(dialog),
            layout_key=self._layout_key,
            caption=pygame.display.get_caption(),
        )

    def set_appearance(self, appearance: PageAppearance) -> None:
        """Adopt the appearance that suits the browser page that shows the window; see `BaseWindow`."""
        self.scale = appearance.scale
        self.editor.theme = appearance.theme
        self.editor.is_compact = appearance.is_compact
        self.dialogs.set_appearance(appearance)
        if appearance.shows_panel is not None:
            self.editor.shows_panel = appearance.shows_panel
        self.editor.revision += 1
        self.play_mode.set_appearance(appearance)

    def update(self, seconds: float) -> None:
        """Advance the clock, poll files and workers, and update layout, parts, cursor and title."""
        if self.play_mode.window is not None:
            self.play_mode.update(seconds)
            return
        if self.file_commands.may_close:
            self.closed = True
            return
        editor = self.editor
        editor.pass_time(seconds)
        if not self.pointer.is_busy:
            self.file_commands.poll()
            self.team_preview.update()
        if not (self.pointer.is_busy and editor.measurement_worker.is_busy):
            editor.request_measurement()
        self._show_draft_problem()
        self._arrange()
        for part in self.parts:
            part.is_covered = self.dialogs.is_open
        self.top_bar.update()
        self.tool_rail.update()
        self.panel.update()
        self.cursor.show(self._choose_cursor())
        title = editor.document.title
        if editor.document.history.has_unsaved_changes:
            title = f"● {title}"
        set_title(f"{title} · robocov edit")

    def _show_draft_problem(self) -> None:
        """Show once why the draft cannot be saved, so that other messages can replace it."""
        problem = self.editor.document.autosaver.problem
        if problem != self._shown_draft_problem:
            self._shown_draft_problem = problem
            self.editor.show_message(problem, is_error=True)

    def _choose_cursor(self) -> CursorShape:
        if not self.canvas.contains(self.pointer.pixel):
            return "arrow"
        if self.pointer.is_panning:
            return "move"
        if self.canvas.hovered:
            return "hand"
        return self.editor.tool.choose_cursor(self.editor)

    def _arrange(self) -> None:
        """Update the layout after a change of size, scale, panel or theme; otherwise do nothing."""
        editor = self.editor
        scale = self.suitable_scale
        key = (self.screen.get_size(), scale, editor.shows_panel, editor.is_compact, editor.theme)
        if key == self._layout_key:
            return
        self._layout_key = key
        self.theme = get_theme(editor.theme)
        self.layout = build_layout(
            key[0], scale, panel=editor.shows_panel, plot=False, is_compact=editor.is_compact
        )
        self.canvas.arrange(self.layout, self.theme)
        for part in self.parts:
            part.arrange(self.layout, self.theme)

    def draw(self) -> None:
        """Draw the map, the status bar, the message, the parts and everything above the map."""
        layout = self.layout
        theme = self.theme
        editor = self.editor
        self.canvas.draw(self.screen)
        if layout.status.height:
            status = list_status(editor, self.frame_rate, self.canvas.team)
            hint = STATUS_HINT if self.has_status_hint else ""
            draw_status(self.screen, layout.status, theme, layout.scale, facts=status, hint=hint)
        if layout.has_panel:
            self.panel.draw(self.screen)
        self.sheet_handle.draw(self.screen, layout, theme)
        is_error = editor.has_error_message
        self.message_box = draw_message(
            self.screen,
            editor.message,
            layout.arena,
            theme,
            layout.scale,
            is_error=is_error,
            strip_texts=self.canvas.strip_texts,
        )
        if not layout.is_compact:
            self.tool_rail.draw(self.screen)
            self.top_bar.draw(self.screen)
        self.draw_above_map()

    def _attempt(self, action: Callable[[], object]) -> None:
        problem = self.editor.problem
        self.editor.attempt(action)
        if self.editor.problem is not problem:
            self._show_problem()

    def _show_problem(self) -> None:
        self.canvas.show_problem(self.editor.problem)

    def open_menu(self, pixel: tuple[int, int]) -> None:
        """Open the context menu at a pixel; first select the object there unless it is selected already."""
        if self.canvas.contains(pixel):
            select_for_menu(self.editor, self.canvas.to_world(pixel))
        commands = [self.commands[name] if name else None for name in list_menu_commands(self.editor)]
        self.dialogs.ask(Menu(commands, pixel, self.run_command, is_for_fingers=self.editor.is_compact))

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event; the key for screenshots works even while a dialog is open."""
        is_space_released = event.type == pygame.KEYUP and event.key == pygame.K_SPACE
        if is_space_released or event.type == pygame.WINDOWFOCUSLOST:
            self.pointer.pans_with_left = False
        if event.type in MOUSE_EVENTS and event.type != pygame.MOUSEWHEEL:
            self.pointer.pixel = event.pos
        if event.type == pygame.KEYDOWN and event.key == pygame.K_F12:
            self.run_command("screenshot")
        else:
            super().handle_event(event)

    def handle_quit(self) -> None:
        """Quit, unless a question must be answered first; menus and the import dialog are closed."""
        if isinstance(self.dialogs.current, ImportDialog | Menu):
            self.dialogs.close()
        if not self.dialogs.is_open:
            self.run_command("quit")

    def open_file(self, path: Path) -> str | None:
        """Open or import a file that was dropped on the window; return a status message, if there is one."""
        return self.file_commands.open(path)

    def use_key(self, event: pygame.event.Event) -> bool:
        """Use a key for a text field or for the value typed for the tool; return whether it was used."""
        if super().use_key(event):
            return True
        return not self.panel.ui.is_busy and edit_typed_value(self.editor, event)

    def press_key(self, event: pygame.event.Event) -> None:
        """Handle a key press, as input or as the key of a command."""
        super().press_key(event)
        if self.play_mode.window is not None:
            self.play_mode.window.ignored_key = event.key
