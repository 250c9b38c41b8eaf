"""Questions with a few answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.dialogs.dialog import Dialog
from robocov_app.toolkit.overlay import wrap_text
from robocov_app.toolkit.widgets.appearance import TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import ENTER_KEYS

MAX_LINES = 14
"""Maximum number of lines of text that are shown."""

# Lengths in pixels at scale 1.
_TITLE_PX = 16
_TEXT_PX = TEXT_PX + 1
_TITLE_GAP_PX = 6
_TEXT_GAP_PX = 12
_BUTTON_HEIGHT_PX = 30
_BUTTON_GAP_PX = 8
_BUTTON_MARGIN_PX = 18
"""Distance of the text of a button from its left and right edges."""

_KEY_STEPS = {"left": -1, "shift+tab": -1, "right": 1, "tab": 1}


@dataclass
class Answer:
    """An answer to a question, shown as a button.

    Attributes
    ----------
    text : str
    call : callable
        Called when the user gives this answer.
    key : str
        Key that gives this answer; Enter does so, too, while it is highlighted.
    """

    text: str
    call: Callable[[], object] = lambda: None
    key: str = ""


@dataclass
class Question(Dialog):
    """A question with answers as buttons; a click outside only closes it, as Escape does.

    Attributes
    ----------
    title : str
    text : str
        May have several lines.
    answers : sequence of Answer
    on_cancel : callable
        Called if the user closes the question without an answer.
    highlighted : int
        Index of the highlighted answer, which Enter gives.
    """

    title: str
    text: str
    answers: Sequence[Answer]
    on_cancel: Callable[[], object] = lambda: None
    highlighted: int = 0

    closes_on_outside_click = True

    def show_content(self, ui: Ui) -> None:
        """Show the title, the text and the answers."""
        ui.paragraph(self.title, size=_TITLE_PX, bold=True)
        ui.space(_TITLE_GAP_PX)
        self._show_text(ui)
        ui.space(_TEXT_GAP_PX)
        texts = [answer.text for answer in self.answers]
        widths = [
            measure_text(text, ui.px(TEXT_PX), bold=True) / ui.scale + 2 * _BUTTON_MARGIN_PX for text in texts
        ]
        free_width = max(ui.width - sum(widths) - _BUTTON_GAP_PX * len(widths), 1.0)
        ui.row(free_width, *widths, height=_BUTTON_HEIGHT_PX, gap=_BUTTON_GAP_PX, below=0)
        ui.cell()
        for number, answer in enumerate(self.answers):
            tip = f"Key {answer.key.upper()}" if answer.key else ""
            if ui.button(answer.text, key=f"answer:{number}", selected=number == self.highlighted, tip=tip):
                self._give(answer)

    def _show_text(self, ui: Ui) -> None:
        lines: list[str] = []
        for paragraph in self.text.split("\n"):
            lines += wrap_text(paragraph, ui.px(_TEXT_PX), ui.px(ui.width)) or [""]
        for line in lines[:MAX_LINES]:
            ui.paragraph(line, size=_TEXT_PX)
        if len(lines) > MAX_LINES:
            more = f"… and {len(lines) - MAX_LINES} more lines"
            ui.paragraph(more, size=_TEXT_PX, color=ui.theme.faint)

    def _give(self, answer: Answer) -> None:
        self.is_done = True
        answer.call()

    def handle_key(self, name: str, ui: Ui) -> bool:
        """Highlight an answer (arrow keys, Tab), or give one (Enter or its key)."""
        self.highlighted = (self.highlighted + _KEY_STEPS.get(name, 0)) % len(self.answers)
        chosen = next((answer for answer in self.answers if answer.key == name), None)
        if name in ENTER_KEYS:
            chosen = self.answers[self.highlighted]
        if chosen is not None:
            self._give(chosen)
        return True

    def handle_cancel(self) -> None:
        """Call `on_cancel`."""
        self.on_cancel()
