"""The project's colors as CSS variables, for pages that follow the reader's preference.

Every color has one name in both themes: what is drawn with names is right in light and dark.
"""

from robocov_app.look.colors import Color, choose_text_color, mix
from robocov_app.look.theme import DARK, LIGHT, Theme, get_theme


def hex_code(color: Color) -> str:
    return f"#{bytes(color).hex()}"


def named_colors(theme: Theme) -> dict[str, Color]:
    def own(*names: str) -> dict[str, Color]:
        return {name: getattr(theme, name.replace("-", "_")) for name in names}

    return {
        **own("background", "panel", "ink", "faint", "grid"),
        "line": mix(theme.grid, theme.background, 0.45),
        "accent": theme.get_controller_color("rapf"),
        "warning": theme.get_controller_color("rpf"),
        **own("boundary", "obstacle", "obstacle-edge", "moving-obstacle", "cell-edge", "start", "final"),
        "on-final": choose_text_color(theme.final),
        "on-accent": choose_text_color(theme.get_controller_color("rapf")),
        "trajectory": theme.trajectory,
        "ring": theme.robot_ring,
        **{name: theme.get_controller_color(name) for name in theme.controllers},
        **{f"other-{k}": color for k, color in enumerate(theme.others)},
        **{f"cell-{k}": mix(theme.background, hue, theme.paper_tint) for k, hue in enumerate(theme.robots)},
        **{f"heat-{k}": color for k, color in enumerate(theme.quiet_heat)},
    }


def variables(theme: Theme) -> str:
    colors = "".join(f"--rc-{name}:{hex_code(color)};" for name, color in named_colors(theme).items())
    return f"color-scheme:{theme.name};{colors}"


def theme_rules(scope: str, theme: str = "auto") -> str:
    """Return CSS that gives a selector its colors; "auto" follows notebook or browser, paper is white."""
    light, dark = variables(LIGHT), variables(DARK)
    if theme != "auto":
        return f"{scope}{{{variables(get_theme(theme))}}}@media print{{{scope}{{{light}}}}}\n"
    notebook = f':is([data-jp-theme-light="{{}}"],[data-vscode-theme-kind$="{{}}"]) {scope}'
    return (
        f"{scope}{{{light}}}"
        f"@media (prefers-color-scheme:dark){{{scope}{{{dark}}}}}"
        f"{notebook.format('true', 'light')}{{{light}}}"
        f"{notebook.format('false', 'dark')}{{{dark}}}"
        # as strong as the rules for notebooks, and after them
        f"@media print{{{scope},:is([data-jp-theme-light],[data-vscode-theme-kind]) {scope}{{{light}}}}}\n"
    )
