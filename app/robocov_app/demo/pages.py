"""The pages of the panel: parameters, what is shown, the robot that is asked, and keeping."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.demo.actions import key_words, layer_actions

if TYPE_CHECKING:
    from typing import Any

    from robocov_app.demo.desk import Desk
    from robocov_app.demo.parameters import Parameter
    from robocov_app.demo.widgets import Widgets

MARGIN, WIDE = 12, 296
"""Pixels at scale 1: beside the widgets, and what is left to them."""

BAR = 12
"""What a scroll bar takes of that."""

NOT_OFFERED = frozenset({"obstacles", "boundary", "robots", "failed", "selection", "caption"})
"""Layers without a check box: a picture without them is no use; they have keys all the same."""

_SHORT = {
    "Distance to the nearest robot": "Distance map",
    "Nearest obstacle points": "Nearest obstacle",
    "Repulsion from robots": "Repulsion: robots",
    "Repulsion from obstacle": "Repulsion: wall",
    "Path from the cursor": "Path from cursor",
    "Communication range": "Comm. range",
    "Scale of colours": "Colour scale",
    "Known of obstacles": "Known obstacles",
}


def parameters_page(widgets: Widgets, desk: Desk, top: int) -> None:
    """Sliders, fields and resets of the chosen controller's gains and of the team's limits."""
    parameters = desk.parameters()
    box, scrolls = widgets.scrolled(top, 27 * len(parameters) + 20 * 2 + 12)
    wide = WIDE - BAR if scrolls else WIDE
    law = desk.session.circumstances(desk.lane).law
    y = 0.0
    for title, of_team in ((f"GAINS OF {law.label.upper()}", False), ("ROBOTS", True)):
        widgets.label(title, widgets.rect(MARGIN, y, wide, 18), style="#header", box=box)
        y += 20
        group = [each for each in parameters if each.name.startswith("team.") == of_team]
        if not group:
            widgets.label("none", widgets.rect(MARGIN, y, wide, 22), style="#unit", box=box)
            y += 24
        for each in group:
            _slider(widgets, desk, each, y, wide, box)
            y += 27
        y += 4


def _slider(widgets: Widgets, desk: Desk, each: Parameter, y: float, wide: float, box: Any) -> None:
    tip = f"{each.meaning} ({each.unit})" if each.unit else each.meaning
    rect = widgets.rect
    right = MARGIN + wide

    def put(value: float | None) -> None:
        desk.attempt(lambda: desk.set_parameter(each.name, value))

    def read(text: str) -> None:
        desk.attempt(lambda: desk.set_parameter(each.name, each.read(text)))

    widgets.label(each.label, rect(MARGIN, y, 104, 24), box=box, tip=tip)
    widgets.slider(
        each.name,
        rect(MARGIN + 106, y + 4, wide - 106 - 122, 16),
        each.place(),
        (0.0, 1.0),
        lambda place: put(each.at(place)),
        box,
    )
    widgets.entry(each.name, each.words(), rect(right - 118, y, 50, 24), read, box)
    widgets.label(each.unit, rect(right - 64, y, 40, 24), style="#unit", box=box)
    usual = "no limit" if each.default is None else f"{each.default:g} {each.unit}"
    widgets.button(
        "↺",
        rect(right - 22, y + 1, 22, 22),
        lambda: put(each.default),
        box=box,
        tip=f"Back to the default: {usual}",
        style="#small",
    )


def show_page(widgets: Widgets, desk: Desk, top: int, titles: dict[str, str]) -> None:
    """Check boxes of the layers."""
    actions = {action.name: action for action in layer_actions(titles)}
    names = [name for name in titles if name not in NOT_OFFERED]
    rows = -(-len(names) // 2)
    box, scrolls = widgets.scrolled(top, 24 * rows + 44)
    wide = WIDE - BAR if scrolls else WIDE
    for k, name in enumerate(names):
        x, y = MARGIN + (k // rows) * (wide / 2 + 2), (k % rows) * 24
        keys = " or ".join(key_words(key) for key in actions[f"layer:{name}"].keys)

        def switch(on: bool, name: str = name) -> None:
            if on != (name in desk.shown):
                desk.do(f"layer:{name}")

        tip = f"{titles[name]} ({keys})" if keys else titles[name]
        widgets.check(
            name,
            _SHORT.get(titles[name], titles[name]),
            widgets.rect(x, y + 2, 17, 17),
            name in desk.shown,
            switch,
            box,
            tip,
        )
    third = wide / 3
    for k, (text, action) in enumerate((("Fading", "fade"), ("Light/dark", "theme"), ("Whole map", "fit"))):
        widgets.does(text, widgets.rect(MARGIN + k * (third + 1), 24 * rows + 8, third - 4, 26), action, box)


def robot_page(widgets: Widgets, top: int) -> None:
    """Buttons above the inspector's words, which are drawn, not written into widgets."""
    wide = 69.5
    rows = (
        ("◀", "robot:previous"),
        ("▶", "robot:next"),
        ("Fail", "robot:fail"),
        ("Remove", "robot:remove"),
    )
    for k, (text, action) in enumerate(rows):
        widgets.does(text, widgets.rect(MARGIN + k * (wide + 6), top / widgets.scale, wide, 26), action)


def keep_page(widgets: Widgets, top: int) -> None:
    """Buttons for what is saved, and for help."""
    rows = (
        (("Screenshot", "screenshot"), ("Record film", "film")),
        (("Save run", "save:run"), ("Save map", "save:map")),
        (("Undo", "undo"), ("Redo", "redo")),
        (("Keys", "help"), ("Commands…", "palette")),
        (("Guided tour", "tour"), ("Full screen", "fullscreen")),
    )
    box, scrolls = widgets.scrolled(top, 33 * len(rows) + 8)
    wide = WIDE - BAR if scrolls else WIDE
    for k, row in enumerate(rows):
        for j, (text, action) in enumerate(row):
            rect = widgets.rect(MARGIN + j * (wide / 2 + 3), 2 + 33 * k, wide / 2 - 3, 28)
            widgets.does(text, rect, action, box)
