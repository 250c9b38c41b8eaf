"""The options of an import as text, and the fields in which the user types or chooses it."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any

from robocov.environment import Point
from robocov_app.editor.ui.importing.file_colors import choose_next_role, find_role, set_role
from robocov_app.editor.ui.importing.options import ImportOption, list_options
from robocov_app.formats import Importer, ReadOptions, Shaping
from robocov_app.formats.colors import Color
from robocov_app.toolkit.overlay import wrap_text
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX
from robocov_app.toolkit.widgets.text_edit import TextEdit
from robocov_app.toolkit.widgets.ui import Ui

# Lengths in pixels at scale 1.
OPTION_LABEL_WIDTH_PX = 126
MAX_ROW_PX = 28.0  # maximum height of the row of an option

MAX_TEXT_CHARACTERS = 200
DEFAULT_TEXT = "default"


class ImportForm:
    """The options of an import, as text that the user typed or chose.

    Parameters
    ----------
    importer : Importer
        Format of the file.
    handle_change : callable
        Called after an option has changed.

    Attributes
    ----------
    options : tuple of ImportOption
        All options of the format.
    texts : dict of str to str
        Text by option name, for options without their default value.
    """

    def __init__(self, importer: Importer, handle_change: Callable[[], object]) -> None:
        self.options = list_options(importer)
        self.texts: dict[str, str] = {}
        self._handle_change = handle_change
        self._focused_ui: Ui | None = None  # where the first field has received the text cursor

    def find_option(self, name: str) -> ImportOption:
        """Return the option with a given name."""
        return next(option for option in self.options if option.name == name)

    def set_text(self, name: str, text: str) -> None:
        """Set an option to text that the user typed or chose; empty text restores the default."""
        option = self.find_option(name)
        if not text or text in (option.default, DEFAULT_TEXT):
            self.texts.pop(name, None)
        else:
            self.texts[name] = text[:MAX_TEXT_CHARACTERS]
        self._handle_change()

    def keep_inside(self, position: Point) -> None:
        """Set the options so that the part of the free space around a position, m, is kept."""
        self.texts.pop("keep", None)
        self.set_text("inside", f"{position[0]:.10g} {position[1]:.10g}")

    def cycle_color(self, color: Color) -> None:
        """Give a color the next role in the cycle: none, free, solid, ignored."""
        set_role(self.texts, color, choose_next_role(find_role(self.texts, color)))
        self._handle_change()

    def find_kept_position(self) -> Point | None:
        """Return the position around which the free space is kept, m; None if it is not set."""
        if "inside" not in self.texts:
            return None
        x, y = self.find_option("inside").parse(self.texts["inside"])
        return x, y

    def build_settings(self) -> tuple[ReadOptions, Shaping]:
        """Parse the options for reading and for shaping; raise RobocovError if an option is invalid."""
        reading_names = {field.name for field in fields(ReadOptions)}
        reading: dict[str, Any] = {}
        shaping: dict[str, Any] = {}
        for name, text in self.texts.items():
            value = self.find_option(name).parse(text)
            if name in reading_names:
                reading[name] = value
            else:
                shaping[name] = value
        return ReadOptions(**reading), Shaping(**shaping)

    def show(self, ui: Ui, bottom: float) -> None:
        """Show a row for each option, above the lower edge `bottom`, px at scale 1."""
        if ui is not self._focused_ui:
            self._focused_ui = ui
            self._focus_first_field(ui)
        row_height = min((bottom - ui.y) / len(self.options), MAX_ROW_PX) - 4
        ui.row(OPTION_LABEL_WIDTH_PX, 0, height=row_height, below=4)
        for option in self.options:
            self._show_option(ui, option)
        ui.end_row()

    def show_help(self, ui: Ui, bottom: float) -> None:
        """Show the help of the focused option, above the lower edge `bottom`, px at scale 1."""
        text = next((option.help for option in self.options if option.name == ui.focus), "")
        max_lines = max(int((bottom - ui.y) / (SMALL_TEXT_PX + 5)), 0)
        lines = wrap_text(text, ui.px(SMALL_TEXT_PX), ui.px(ui.width))[:max_lines]
        ui.paragraph(" ".join(lines), size=SMALL_TEXT_PX, color=ui.theme.faint)

    def _focus_first_field(self, ui: Ui) -> None:
        first = next(option.name for option in self.options if not option.choices)
        ui.focus = first
        ui.edit = TextEdit.select_all(self.texts.get(first, ""))

    def _show_option(self, ui: Ui, option: ImportOption) -> None:
        """Show the label of an option, and its drop-down list or text field; apply the user's input."""
        name = option.name
        current_text = self.texts.get(name, option.default)
        style = "bold" if name in self.texts else ""
        ui.label(name.replace("_", " ").capitalize(), tip=option.help, style=style)
        if option.choices:
            choices = option.choices
            if not option.default:
                choices = (DEFAULT_TEXT, *choices)
            text = ui.dropdown(name, choices, current_text or DEFAULT_TEXT, tip=option.help)
        else:
            text = ui.text_field(name, current_text, placeholder=DEFAULT_TEXT, tip=option.help, live=True)
        if text is not None and text != current_text:
            self.set_text(name, text)
