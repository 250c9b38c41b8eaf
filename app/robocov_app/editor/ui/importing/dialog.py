"""The import dialog: options on the left, the map before and after on the right, the report below them."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pygame
from pygame import Rect, Surface

from robocov.errors import RobocovError
from robocov_app.editor.ui.importing.file_colors import (
    ColorSheet,
    find_role,
    list_declared_colors,
)
from robocov_app.editor.ui.importing.form import ImportForm
from robocov_app.editor.ui.importing.preview import ImportPreview
from robocov_app.editor.ui.importing.service import Imported
from robocov_app.formats import Importer
from robocov_app.formats.colors import Color, name_color
from robocov_app.jobs.workers import Worker
from robocov_app.render.fonts import render_text
from robocov_app.toolkit.dialogs import Dialog
from robocov_app.toolkit.overlay import wrap_text
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui

# Lengths in pixels at scale 1.
OPTIONS_WIDTH_PX = 300
OPTIONS_GAP_PX = 32  # between options and maps
REPORT_LINE_PX = 17
OPTIONS_MARGIN_PX = 44  # below the options, for the buttons
HELP_MARGIN_PX = 40  # below the help of an option
BUTTONS_HEIGHT_PX = 30
COLOR_BUTTON_WIDTH_PX = 78  # of a button that shows a color and its role
COLOR_BUTTON_GAP_PX = 6
SWATCH_PX = 12
SWATCH_LEFT_PX = 7  # from the edge of the button
CLICK_LABEL_WIDTH_PX = 56
CLICK_BUTTON_WIDTH_PX = 84
SMALL_BUTTON_HEIGHT_PX = 24
BUTTON_WIDTH_PX = 92
STATUS_TEXT_PX = 13
BOTTOM_MARGIN_PX = 8
MAPS_GAP_PX = 14  # between maps and report

MIN_REPORT_LINES = 7
KEEP_PART = "part"
SET_COLOR = "color"
HINTS = {
    KEEP_PART: "Click a part of the map to keep it · Enter: import · Esc: cancel",
    SET_COLOR: "Click a color in the left map, or choose one above · Enter: import",
}
_ROLE_LABELS = {None: "default", "free": "free", "solid": "solid", "ignore": "ignored"}


@contextmanager
def _column(ui: Ui, left: float, top: float, width: float) -> Iterator[None]:
    """Show widgets in a column, px at scale 1, and return to the previous one afterwards."""
    previous = (ui.x, ui.y, ui.width)
    ui.x = left
    ui.y = top
    ui.width = width
    yield
    ui.x, ui.y, ui.width = previous


class ImportDialog(Dialog):
    """Dialog for the options of an import, with a live preview.

    Parameters
    ----------
    path : Path
        File to import.
    importer : Importer
        Importer for the format of the file.
    worker : Worker of Imported
        Imports the file in the background.
    call : callable
        Takes the imported map when the user accepts it.

    Attributes
    ----------
    form : ImportForm
        Options of the import, as text that the user typed or chose.
    imported : Imported or None
        The map from the latest import that succeeded.
    accepted : bool
        Whether the user has accepted the map, which may still have to be imported.
    click_action : str
        Effect of a click on a map: `KEEP_PART` of the free space, or `SET_COLOR` to a role.
    """

    width = 10_000.0  # as wide as the window

    def __init__(
        self, path: Path, importer: Importer, worker: Worker[Imported], call: Callable[[Imported], object]
    ) -> None:
        self.path = path
        self.importer = importer
        self.call = call
        self.form = ImportForm(importer, self._request)
        self.imported: Imported | None = None
        self.accepted = False
        self.click_action = KEEP_PART
        self.preview = ImportPreview()
        self._worker = worker
        self._mistake = ""  # error in the options
        self._request()

    @property
    def sheet(self) -> ColorSheet | None:
        """The file in its own colors; None if colors cannot have roles in this format."""
        if self.imported is None or "free_color" not in self.importer.options:
            return None
        return self.imported.sheet

    @property
    def _shown_sheet(self) -> ColorSheet | None:
        """The file in its own colors if a click sets the role of a color; otherwise None."""
        if self.click_action != SET_COLOR:
            return None
        return self.sheet

    def _request(self) -> None:
        """Request an import with the current settings."""
        self.accepted = False
        self._mistake = ""
        try:
            reading, shaping = self.form.build_settings()
            self._worker.put((self.path, self.importer.name, reading, shaping))
        except RobocovError as error:
            self._mistake = str(error)

    def poll(self) -> Imported | None:
        """Receive a finished import; return the map if the user has accepted it, otherwise None."""
        imported = self._worker.poll()
        if imported is not None and not self._worker.is_busy:
            self.imported = imported
        if self.problem:
            self.accepted = False
        if not self.accepted or not self.is_ready:
            return None
        return self.imported

    @property
    def is_busy(self) -> bool:
        """Whether an import is running."""
        return not self._mistake and self._worker.is_busy

    @property
    def problem(self) -> str:
        """Reason why the file cannot be imported with the current settings; empty if none is known."""
        if self._mistake:
            return self._mistake
        if self._worker.is_busy:
            return ""
        return self._worker.problem

    @property
    def is_ready(self) -> bool:
        """Whether the map has been imported with the current settings."""
        return self.imported is not None and not self.is_busy and not self.problem

    def handle_key(self, name: str, ui: Ui) -> bool:
        """Accept the map if the key is Enter; return whether the key was used."""
        is_accepting = name in ("return", "enter") and ui.open_list is None
        if is_accepting:
            self.accepted = True
        return is_accepting

    def handle_cancel(self) -> None:
        """End the process that imports."""
        self._worker.close()

    def show_content(self, ui: Ui) -> None:
        """Draw the options on the left, and the maps with the report below them on the right."""
        left = ui.x
        top = ui.y
        width = ui.width
        height = pygame.display.get_window_size()[1] / ui.scale - 2 * top - BOTTOM_MARGIN_PX
        bottom = top + height
        with _column(ui, left, top, OPTIONS_WIDTH_PX):
            self._draw_options(ui, bottom)
        maps_left = left + OPTIONS_WIDTH_PX + OPTIONS_GAP_PX
        with _column(ui, maps_left, top, left + width - maps_left):
            if self.sheet is not None:
                self._draw_click_actions(ui)
            report_height = REPORT_LINE_PX * (MIN_REPORT_LINES + 1) + MAPS_GAP_PX
            self._draw_maps(ui, bottom - ui.y - report_height)
            self._draw_report(ui, bottom)
        ui.y = bottom

    def _draw_maps(self, ui: Ui, height: float) -> None:
        """Draw the two maps in a given height, px, or a text if there is no map yet; handle clicks."""
        top = ui.y
        ui.row(height=height, below=0)
        box, is_clicked = ui.area("maps")
        if self.imported is None:
            ui.space(MAPS_GAP_PX)
            if ui.surface is not None:
                text = "Reading the file…"
                if self.problem:
                    text = "Nothing to show"
                image = render_text(text, ui.px(STATUS_TEXT_PX), ui.theme.faint)
                ui.surface.blit(image, image.get_rect(center=box.center))
            return
        maps_height = self.preview.arrange(box, self.imported, ui.scale)
        if ui.surface is not None:
            self._draw_preview(ui.surface, ui, self.imported)
        if is_clicked:
            self._click(ui.pointer)
        ui.end_row()
        ui.y = top + maps_height / ui.scale + MAPS_GAP_PX

    def _draw_preview(self, surface: Surface, ui: Ui, imported: Imported) -> None:
        self.preview.draw(surface, imported, ui.scale, ui.theme, self._shown_sheet)
        if self.problem:
            # The maps belong to earlier settings.
            self.preview.draw_veil(surface, ui.theme)
            return
        position = self.form.find_kept_position()
        if position is not None:
            self.preview.draw_mark(surface, position, ui.scale, ui.theme)

    def _click(self, pixel: tuple[int, int]) -> None:
        """Handle a click on a map: keep the part of the free space there, or change the role of the color."""
        for number, camera in enumerate(self.preview.cameras):
            if not Rect(camera.view).collidepoint(pixel):
                continue
            x, y = camera.to_world(np.array(pixel, dtype=float)).tolist()
            sheet = self._shown_sheet
            if sheet is not None and number == 0:
                color = sheet.find_color(x, y)
                if color is not None:
                    self.form.cycle_color(color)
            else:
                # Round the position to the size of a pixel.
                digits = max(0, math.ceil(math.log10(camera.zoom)))
                self.form.keep_inside((round(x, digits), round(y, digits)))

    def _draw_click_actions(self, ui: Ui) -> None:
        """Draw the buttons that choose the effect of a click, and the colors with their roles."""
        ui.row(
            CLICK_LABEL_WIDTH_PX,
            CLICK_BUTTON_WIDTH_PX,
            CLICK_BUTTON_WIDTH_PX,
            0,
            height=SMALL_BUTTON_HEIGHT_PX,
            below=6,
        )
        ui.label("Click to", style="unit")
        part_tip = "Click a map to keep that part of the free space"
        color_tip = "Click the left map to make its color free, solid or ignored"
        self._draw_click_action(ui, KEEP_PART, "Keep a part", part_tip)
        self._draw_click_action(ui, SET_COLOR, "Set a color", color_tip)
        ui.end_row()
        if self._shown_sheet is not None:
            self._draw_color_buttons(ui, self._shown_sheet)

    def _draw_click_action(self, ui: Ui, action: str, text: str, tip: str) -> None:
        is_chosen = self.click_action == action
        if ui.button(text, key=f"clicks:{action}", selected=is_chosen, small=True, tip=tip):
            self.click_action = action

    def _draw_color_buttons(self, ui: Ui, sheet: ColorSheet) -> None:
        """Draw as many buttons for colors as fit: first colors with a role, then others in the file."""
        declared_colors = list_declared_colors(self.form.texts)
        colors = list(dict.fromkeys([*declared_colors, *sheet.colors]))
        columns = int((ui.width + COLOR_BUTTON_GAP_PX) // (COLOR_BUTTON_WIDTH_PX + COLOR_BUTTON_GAP_PX))
        shown_colors = colors[: max(columns, 1)]
        button_widths = [COLOR_BUTTON_WIDTH_PX for _ in shown_colors]
        ui.row(*button_widths, 0, height=SMALL_BUTTON_HEIGHT_PX, below=8)
        for color in shown_colors:
            self._draw_color_button(ui, color)
        ui.end_row()

    def _draw_color_button(self, ui: Ui, color: Color) -> None:
        """Draw the button of a color, which shows its role; a click changes the role."""
        role = find_role(self.form.texts, color)
        name = name_color(color)
        key = f"color:{name}"
        text = f"     {_ROLE_LABELS[role]}"
        tip = f"{name}: click to change its role"
        if ui.button(text, key=key, selected=role is not None, small=True, tip=tip):
            self.form.cycle_color(color)
        button = ui.find("button", key)
        if ui.surface is not None and button is not None:
            side = ui.px(SWATCH_PX)
            swatch = Rect(
                button.rect.left + ui.px(SWATCH_LEFT_PX), button.rect.centery - side // 2, side, side
            )
            pygame.draw.rect(ui.surface, color, swatch)
            pygame.draw.rect(ui.surface, ui.theme.faint, swatch, 1)

    def _draw_options(self, ui: Ui, bottom: float) -> None:
        """Draw the options, the help of the focused option and the buttons, above the lower edge `bottom`."""
        ui.paragraph(f"Import {self.path.name}", size=16, bold=True)
        ui.label(self.importer.title, style="unit")
        ui.end_row()
        self.form.show(ui, bottom - OPTIONS_MARGIN_PX)
        self.form.show_help(ui, bottom - HELP_MARGIN_PX)
        ui.y = bottom - BUTTONS_HEIGHT_PX
        ui.row(BUTTON_WIDTH_PX, BUTTON_WIDTH_PX, height=BUTTONS_HEIGHT_PX, below=0)
        if ui.button("Import", selected=self.is_ready, key="import", tip=self.problem):
            self.accepted = True
        if ui.button("Cancel", key="cancel"):
            self.is_done = True
            self.handle_cancel()
        ui.end_row()

    def _list_report_lines(self) -> list[str]:
        if self.problem:
            return [self.problem]
        if self.imported is None:
            return []
        return self.imported.report.format_lines()

    def _draw_report(self, ui: Ui, bottom: float) -> None:
        """Draw the report of the import or the problem, then a hint, down to the lower edge `bottom`."""
        lines: list[str] = []
        for text in self._list_report_lines():
            lines += wrap_text(text, ui.px(SMALL_TEXT_PX), ui.px(ui.width))
        max_lines = int((bottom - ui.y) / REPORT_LINE_PX) - 1
        if len(lines) > max_lines:
            # The last line that fits gives the number of lines left out.
            shown_lines = lines[: max_lines - 1]
            lines = [*shown_lines, f"and {len(lines) - len(shown_lines)} more lines"]
        ui.row(height=REPORT_LINE_PX, below=0)
        if ui.surface is not None:
            color = ui.theme.ink
            if self.problem:
                color = ui.theme.error
            for line in lines:
                ui.surface.blit(render_text(line, ui.px(SMALL_TEXT_PX), color), ui.cell())
        ui.end_row()
        ui.y = bottom - REPORT_LINE_PX
        hint = HINTS[KEEP_PART]
        if self._shown_sheet is not None:
            hint = HINTS[SET_COLOR]
        if self.is_busy and self.imported is not None:
            hint = "Importing…"
        ui.label(hint, style="unit")
        ui.end_row()
