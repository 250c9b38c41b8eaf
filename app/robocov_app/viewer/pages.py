"""The pages of the panel: parameters, what is shown, the robot that is asked, and keeping."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from robocov_app.render.fonts import shortened
from robocov_app.viewer.actions import key_words, layer_actions
from robocov_app.viewer.look import TEXT
from robocov_app.viewer.parameters import Pick

if TYPE_CHECKING:
    from robocov_app.viewer.parameters import Parameter
    from robocov_app.viewer.presenter import Desk
    from robocov_app.viewer.widgets import Widgets

MARGIN, WIDE = 12, 296
"""Pixels at scale 1: beside the widgets, and what is left to them."""

GAP = 6
"""Pixels at scale 1 between widgets side by side."""

NOT_OFFERED = frozenset({"obstacles", "boundary", "robots", "failed", "selection", "caption"})
"""Layers without a check box: a picture without them is no use; they have keys all the same."""

_SHORT = {
    "Nearest obstacle points": "Nearest obstacle",
    "Repulsion from robots": "Repulsion: robots",
    "Repulsion from obstacle": "Repulsion: wall",
    "Path from the cursor": "Path from cursor",
    "Communication range": "Comm. range",
}

_ROW = 27


def columns(count: int, wide: float = WIDE) -> list[tuple[float, float]]:
    """Return left edge and width of so many widgets side by side.

    >>> columns(2)
    [(12.0, 145.0), (163.0, 145.0)]
    """
    width = (wide - GAP * (count - 1)) / count
    return [(MARGIN + k * (width + GAP), width) for k in range(count)]


def parameters_page(widgets: Widgets, desk: Desk, top: float) -> None:
    """Sliders, fields and resets of the chosen controller's gains and of the team's limits."""
    parameters = desk.parameters()
    law = desk.session.circumstances(desk.lane).law
    groups = [
        (f"GAINS OF {law.label.upper()}", [each for each in parameters if not each.name.startswith("team.")]),
        ("ROBOTS", [each for each in parameters if each.name.startswith("team.")]),
    ]

    def build(bar: float) -> None:
        wide, y = WIDE - bar, 0.0
        for title, group in groups:
            widgets.label(title, widgets.rect(MARGIN, y, wide, 18), style="#header")
            y += 20
            if not group:
                widgets.label("none", widgets.rect(MARGIN, y, wide, 20), style="#unit")
            for each in group:
                if isinstance(each, Pick):
                    _words(widgets, desk, each, y, wide)
                else:
                    _slider(widgets, desk, each, y, wide)
                y += _ROW
            y += 6 if group else _ROW

    rows = sum(max(len(group), 1) for _, group in groups)
    widgets.page(("parameters", law.name), top, _ROW * rows + 26 * len(groups) + 2, build)


def _slider(widgets: Widgets, desk: Desk, each: Parameter, y: float, wide: float) -> None:
    tip = f"{each.meaning} ({each.unit})" if each.unit else each.meaning
    rect = widgets.rect
    right = MARGIN + wide

    def put(value: float | None) -> None:
        desk.attempt(lambda: desk.set_parameter(each.name, value))

    def read(text: str) -> None:
        desk.attempt(lambda: desk.set_parameter(each.name, each.read(text)))

    widgets.label(each.label, rect(MARGIN, y, 100, 24), tip=tip)
    widgets.slider(
        each.name,
        rect(MARGIN + 103, y + 5, wide - 103 - 120, 14),
        each.place(),
        (0.0, 1.0),
        lambda place: put(each.at(place)),
    )
    widgets.entry(each.name, each.words(), rect(right - 114, y, 50, 24), read)
    widgets.label(each.unit, rect(right - 59, y, 37, 24), style="#unit")
    usual = "no limit" if each.default is None else f"{each.default:g} {each.unit}".rstrip()
    widgets.button(
        "↺",
        rect(right - 22, y + 1, 22, 22),
        lambda: put(each.default),
        name=f"reset:{each.name}",
        tip=f"Back to the default: {usual}",
        style="#small",
    )


def _words(widgets: Widgets, desk: Desk, each: Pick, y: float, wide: float) -> None:
    """Buttons side by side, one for each word; where they do not fit, one that goes on to the next."""
    rect = widgets.rect
    left, room = MARGIN + 103, wide - 103 - 26

    def put(word: str) -> None:
        desk.attempt(lambda: desk.set_parameter(each.name, word))

    def go_on() -> None:
        now = next(known for known in desk.parameters() if known.name == each.name)
        place = each.offered.index(now.words())
        put(each.offered[(place + 1) % len(each.offered)])

    widgets.label(each.label, rect(MARGIN, y, 100, 24), tip=each.meaning)
    width = (room - 3 * (len(each.offered) - 1)) / len(each.offered)
    size = TEXT["#small"][0]
    if all(shortened(word, round(size), width - 6) == word for word in each.offered):
        for k, word in enumerate(each.offered):
            place = rect(left + k * (width + 3), y + 1, width, 22)
            name = f"{each.name}:{word}"
            widgets.button(word, place, partial(put, word), name=name, tip=each.meaning, style="#small")
    else:
        tip = f"{each.meaning}: {', '.join(each.offered)}"
        place = rect(left, y + 1, room, 22)
        widgets.button(f"{each.value} ›", place, go_on, name=f"next:{each.name}", tip=tip, style="#small")
    widgets.button(
        "↺",
        rect(MARGIN + wide - 22, y + 1, 22, 22),
        lambda: put(each.default),
        name=f"reset:{each.name}",
        tip=f"Back to the default: {each.default}",
        style="#small",
    )


def show_page(widgets: Widgets, desk: Desk, top: float, titles: dict[str, str]) -> None:
    """Check boxes of the layers."""
    actions = {action.name: action for action in layer_actions(titles)}
    names = [name for name in titles if name not in NOT_OFFERED]
    rows = -(-len(names) // 2)

    def box(name: str, x: float, y: float) -> None:
        keys = " or ".join(key_words(key) for key in actions[f"layer:{name}"].keys)

        def switch(on: bool) -> None:
            if on != (name in desk.shown):
                desk.do(f"layer:{name}")

        tip = f"{titles[name]} ({keys})" if keys else titles[name]
        rect = widgets.rect(x, y + 2, 17, 17)
        widgets.check(name, _SHORT.get(titles[name], titles[name]), rect, name in desk.shown, switch, tip)

    def build(bar: float) -> None:
        wide = WIDE - bar
        for k, name in enumerate(names):
            box(name, columns(2, wide)[k // rows][0], (k % rows) * 24)
        does = (("Fading", "fade"), ("Light/dark", "theme"), ("Whole map", "fit"))
        for (x, width), (text, action) in zip(columns(len(does), wide), does, strict=True):
            widgets.does(text, widgets.rect(x, 24 * rows + 8, width, 26), action)

    widgets.page("show", top, 24 * rows + 42, build)


def robot_page(widgets: Widgets, top: float) -> None:
    """Buttons above the inspector's words, which are drawn, not written into widgets."""
    does = (
        ("◀", "robot:previous"),
        ("▶", "robot:next"),
        ("Fail", "robot:fail"),
        ("Remove", "robot:remove"),
    )

    def build(_: float) -> None:
        for (x, width), (text, action) in zip(columns(len(does)), does, strict=True):
            widgets.does(text, widgets.rect(x, 2, width, 26), action)

    widgets.page("robot", top, 30, build)


def keep_page(widgets: Widgets, top: float) -> None:
    """Buttons for what is saved, and for help."""
    rows = (
        (("Screenshot", "screenshot"), ("Record film", "film")),
        (("Save run", "save:run"), ("Save map", "save:map")),
        (("Undo", "undo"), ("Redo", "redo")),
        (("Keys", "help"), ("Commands…", "palette")),
        (("Lesson", "tour"), ("Full screen", "fullscreen")),
    )

    def build(bar: float) -> None:
        for k, row in enumerate(rows):
            for (x, width), (text, action) in zip(columns(2, WIDE - bar), row, strict=True):
                widgets.does(text, widgets.rect(x, 2 + 33 * k, width, 28), action)

    widgets.page("keep", top, 33 * len(rows) + 4, build)
