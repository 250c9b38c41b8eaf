"""The panel's look: our theme as pygame_gui's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pygame_gui import UIManager
from pygame_gui.core import UIAppearanceTheme

from robocov_app.render.fonts import font_path
from robocov_app.render.theme import LIGHT, mix

if TYPE_CHECKING:
    from robocov_app.render.theme import Colour, Theme

FONT = "robocov"

TEXT = {"": (12.0, False), "#header": (11.0, True), "#unit": (11.0, False), "#small": (11.0, False)}
"""Size at scale 1 of text, and whether it is bold, by style."""

BAR = 10.0
"""Pixels at scale 1 that a scroll bar is wide."""


def hexed(colour: Colour) -> str:
    """Return a colour as pygame_gui reads it.

    >>> hexed((31, 95, 224))
    '#1f5fe0'
    """
    return "#{:02x}{:02x}{:02x}".format(*colour)


def field_colour(theme: Theme) -> Colour:
    """Return the fill of what can be typed into or dragged."""
    return theme.background if theme is LIGHT else mix(theme.panel, theme.background, 0.8)


def gui_theme(theme: Theme, scale: float) -> dict[str, Any]:
    """Return our theme in pygame_gui's terms."""
    accent, ink, panel = theme.final, theme.ink, theme.panel
    field = field_colour(theme)
    line = mix(panel, ink, 0.24)
    hover = mix(field, accent, 0.14)
    on_accent = (255, 255, 255) if theme is LIGHT else theme.background
    colours = {
        "normal_bg": hexed(field),
        "hovered_bg": hexed(hover),
        "active_bg": hexed(mix(field, accent, 0.28)),
        "disabled_bg": hexed(panel),
        "selected_bg": hexed(accent),
        "dark_bg": hexed(panel),
        "normal_text": hexed(ink),
        "hovered_text": hexed(ink),
        "active_text": hexed(ink),
        "selected_text": hexed(on_accent),
        "disabled_text": hexed(mix(panel, ink, 0.4)),
        "normal_border": hexed(line),
        "hovered_border": hexed(accent),
        "active_border": hexed(accent),
        "selected_border": hexed(accent),
        "disabled_border": hexed(mix(panel, ink, 0.14)),
        "text_cursor": hexed(ink),
        "text_shadow": hexed(panel),
        "filled_bar": hexed(accent),
        "unfilled_bar": hexed(field),
        "link_text": hexed(accent),
    }
    radius = str(round(4 * scale))
    knob = mix(panel, ink, 0.3)
    plain = {
        "border_width": "1",
        "shadow_width": "0",
        "shape": "rounded_rectangle",
        "shape_corner_radius": radius,
    }
    text = {"name": FONT, "size": str(round(12 * scale)), "bold": "0", "italic": "0"}
    bold = {**text, "bold": "1"}
    left = {"text_horiz_alignment": "left"}
    chosen = {
        "normal_bg": hexed(accent),
        "normal_text": hexed(on_accent),
        "normal_border": hexed(accent),
        "hovered_bg": hexed(mix(accent, ink, 0.15)),
        "hovered_text": hexed(on_accent),
        "active_bg": hexed(mix(accent, ink, 0.25)),
        "active_text": hexed(on_accent),
    }
    clear = {"dark_bg": "#00000000", "normal_bg": "#00000000", "normal_border": "#00000000"}
    return {
        "defaults": {"colours": colours, "font": text, "misc": {**plain, "tool_tip_delay": "0.6"}},
        "button": {"font": text, "misc": {**plain, "text_horiz_alignment": "center"}},
        "#chosen": {"colours": chosen, "font": bold},
        "#chosen_tab": {"colours": chosen, "font": {**text, "size": str(round(11 * scale))}},
        "#small": {"font": {**text, "size": str(round(11 * scale))}},
        "label": {
            "colours": {**clear, "normal_text": hexed(ink)},
            "font": text,
            "misc": {"text_horiz_alignment": "left", "text_horiz_alignment_padding": "0"},
        },
        "#header": {
            "colours": {**clear, "normal_text": hexed(theme.faint)},
            "font": {**bold, "size": str(round(11 * scale))},
            "misc": {"text_horiz_alignment": "left", "text_horiz_alignment_padding": "0"},
        },
        "#unit": {
            "colours": {**clear, "normal_text": hexed(theme.faint)},
            "font": {**text, "size": str(round(11 * scale))},
            "misc": {"text_horiz_alignment": "left", "text_horiz_alignment_padding": "0"},
        },
        "#panel": {
            "colours": {"dark_bg": hexed(panel), "normal_border": hexed(panel)},
            "misc": {"border_width": "0", "shadow_width": "0", "shape": "rectangle"},
        },
        "panel": {
            "colours": {"dark_bg": hexed(panel), "normal_border": hexed(panel)},
            "misc": {"border_width": "0", "shadow_width": "0", "shape": "rectangle"},
        },
        "horizontal_slider": {
            "colours": {"dark_bg": hexed(mix(field, ink, 0.1)), "normal_border": hexed(line)},
            "misc": {
                **plain,
                "enable_arrow_buttons": "0",
                "sliding_button_width": str(round(12 * scale)),
                "shape_corner_radius": str(round(6 * scale)),
            },
        },
        "horizontal_slider.#sliding_button": {
            "colours": {
                "normal_bg": hexed(accent),
                "hovered_bg": hexed(mix(accent, ink, 0.2)),
                "active_bg": hexed(mix(accent, ink, 0.3)),
                "normal_border": hexed(accent),
            },
            "misc": {**plain, "shape_corner_radius": str(round(5 * scale))},
        },
        "vertical_scroll_bar": {
            "colours": {"dark_bg": hexed(panel), "normal_border": hexed(panel)},
            "misc": {**plain, "border_width": "0", "enable_arrow_buttons": "0"},
        },
        "vertical_scroll_bar.#sliding_button": {
            "colours": {
                "normal_bg": hexed(knob),
                "hovered_bg": hexed(mix(panel, ink, 0.45)),
                "active_bg": hexed(mix(panel, ink, 0.55)),
                "normal_border": hexed(panel),
                "hovered_border": hexed(panel),
                "active_border": hexed(panel),
            },
            "misc": {
                **plain,
                "border_width": str(max(1, round(2 * scale))),
                "shape_corner_radius": str(round(0.5 * BAR * scale)),
            },
        },
        "text_entry_line": {
            "colours": {"dark_bg": hexed(field), "normal_border": hexed(line)},
            "font": text,
            "misc": {**plain, "padding": f"{round(5 * scale)},{round(2 * scale)}"},
        },
        "drop_down_menu": {
            "misc": {**plain, "expand_direction": "down", "open_button_width": str(round(20 * scale))}
        },
        "drop_down_menu.#selected_option": {"font": text, "misc": {**plain, **left, "border_width": "0"}},
        "drop_down_menu.#expand_button": {
            "font": {**text, "size": str(round(11 * scale))},
            "misc": {**plain, "border_width": "0"},
        },
        "drop_down_menu.#drop_down_options_list": {
            "font": text,
            "colours": {"dark_bg": hexed(field)},
            "misc": {"list_item_height": str(round(24 * scale)), "border_width": "1", "shape": "rectangle"},
        },
        "@selection_list_item": {"misc": {**left, "border_width": "0", "shape": "rectangle"}},
        "tool_tip": {"misc": {"rect_width": str(round(210 * scale)), "border_width": "0"}},
        "tool_tip.text_box": {
            "colours": {
                "dark_bg": hexed(mix(panel, ink, 0.92 if theme is LIGHT else 0.2)),
                "normal_text": hexed((245, 247, 250)),
                "normal_border": hexed(line),
            },
            "font": {**text, "size": str(round(11 * scale))},
            "misc": {"border_width": "1", "padding": f"{round(7 * scale)},{round(5 * scale)}"},
        },
        "check_box": {"font": text, "misc": {**plain, "text_offset": str(round(6 * scale))}},
    }


class _Theme(UIAppearanceTheme):
    """Finds the ids of a widget by a key that costs nothing to make.

    The library's key is a text of some ten thousand letters, which takes half of the time in which a
    widget is made.
    """

    def build_all_combined_ids(
        self,
        element_base_ids: list[str | None] | None,
        element_ids: list[str] | None,
        class_ids: list[str | None] | None,
        object_ids: list[str | None] | None,
    ) -> list[str]:
        """Return all ids of a widget, the most telling first."""
        ids = (element_base_ids, element_ids, class_ids, object_ids)
        known: dict[Any, list[str]] = self.__dict__.setdefault("known_ids", {})
        key = tuple(tuple(each or ()) for each in ids)
        if key not in known:
            known[key] = super().build_all_combined_ids(*ids)
        return known[key]


class _Manager(UIManager):
    def create_new_theme(self, theme_path: Any = None) -> UIAppearanceTheme:
        """Return a theme of ours."""
        theme = _Theme(self.resource_loader, self._locale)
        if theme_path is not None:
            theme.load_theme(theme_path)
        return theme


def manager_of(size: tuple[int, int], theme: Theme, scale: float) -> UIManager:
    """Return a manager with our look and font."""
    manager = _Manager(size, enable_live_theme_updates=False)
    regular, bold = font_path(), font_path(True)
    if regular is not None and bold is not None:
        manager.add_font_paths(FONT, str(regular), str(bold))
    manager.get_theme().load_theme(gui_theme(theme, scale))
    return manager
