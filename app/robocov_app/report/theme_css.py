"""The themes as CSS variables, for pages that follow the reader's preferred theme.

A color has the same name in both themes, so everything drawn with these names is right in both.
"""

from robocov_app.look.colors import Color, choose_text_color, format_hex_color, mix
from robocov_app.look.theme import DARK, LIGHT, Theme, get_theme

_LINE_FADE = 0.45
"""Fraction of the background color in the lines that separate rows of tables."""


def list_css_colors(theme: Theme) -> dict[str, Color]:
    """Return the colors of a theme, keyed by the names of their CSS variables without ``--rc-``."""
    accent = theme.get_controller_color("rapf")
    colors = {
        "background": theme.background,
        "panel": theme.panel,
        "ink": theme.ink,
        "faint": theme.faint,
        "grid": theme.grid,
        "line": mix(theme.grid, theme.background, _LINE_FADE),
        "accent": accent,
        "warning": theme.get_controller_color("rpf"),
        "boundary": theme.boundary,
        "obstacle": theme.obstacle,
        "obstacle-edge": theme.obstacle_edge,
        "moving-obstacle": theme.moving_obstacle,
        "cell-edge": theme.cell_edge,
        "start": theme.start,
        "final": theme.final,
        "on-final": choose_text_color(theme.final),
        "on-accent": choose_text_color(accent),
        "trajectory": theme.trajectory,
        "ring": theme.robot_ring,
    }
    colors |= {name: theme.get_controller_color(name) for name in theme.controllers}
    colors |= {f"other-{number}": color for number, color in enumerate(theme.others)}
    colors |= {f"cell-{hue}": theme.get_paper_cell_color(hue) for hue in range(len(theme.robots))}
    colors |= {f"heat-{level}": color for level, color in enumerate(theme.muted_heat)}
    return colors


def format_variables(theme: Theme) -> str:
    """Format the colors of a theme as CSS declarations."""
    colors = list_css_colors(theme).items()
    declarations = "".join(f"--rc-{name}:{format_hex_color(color)};" for name, color in colors)
    return f"color-scheme:{theme.name};{declarations}"


def build_theme_rules(scope: str, theme: str = "auto") -> str:
    """Build the CSS rules that define the color variables for a selector.

    Parameters
    ----------
    scope : str
        The selector.
    theme : str
        Name of a theme, or "auto" to follow the notebook or the browser. On paper it is always light.

    Returns
    -------
    str
    """
    light = format_variables(LIGHT)
    dark = format_variables(DARK)
    if theme != "auto":
        return f"{scope}{{{format_variables(get_theme(theme))}}}@media print{{{scope}{{{light}}}}}\n"
    notebook = f':is([data-jp-theme-light="{{}}"],[data-vscode-theme-kind$="{{}}"]) {scope}'
    return (
        f"{scope}{{{light}}}"
        f"@media (prefers-color-scheme:dark){{{scope}{{{dark}}}}}"
        f"{notebook.format('true', 'light')}{{{light}}}"
        f"{notebook.format('false', 'dark')}{{{dark}}}"
        # These rules win, because they are as specific as the rules for notebooks and follow them.
        f"@media print{{{scope},:is([data-jp-theme-light],[data-vscode-theme-kind]) {scope}{{{light}}}}}\n"
    )
