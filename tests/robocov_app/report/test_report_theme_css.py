"""Colors of the themes as CSS variables: same names in both themes, and sufficient contrast."""

import re

import pytest

from robocov.errors import ParameterError
from robocov_app.look.colors import compute_contrast, format_hex_color, parse_hex_color
from robocov_app.look.theme import DARK, HEAT_LEVELS, LIGHT
from robocov_app.report.theme_css import build_theme_rules, format_variables, list_css_colors

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])


def parse_declarations(css: str) -> dict[str, str]:
    return dict(re.findall(r"--rc-([\w-]+):(#[0-9a-f]{6});", css))


def test_both_themes_have_the_same_names() -> None:
    assert list(list_css_colors(LIGHT)) == list(list_css_colors(DARK))
    assert parse_declarations(format_variables(DARK)).keys() == list_css_colors(DARK).keys()
    assert parse_declarations(format_variables(DARK))["ink"] == format_hex_color(DARK.ink)
    assert parse_hex_color(format_hex_color((1, 171, 255))[1:]) == (1, 171, 255)


@THEMES
@pytest.mark.parametrize("surface", ["background", "panel"])
def test_texts_and_curves_have_sufficient_contrast(theme, surface) -> None:
    colors = list_css_colors(theme)
    curves = [*theme.controllers, *(f"other-{k}" for k in range(len(theme.others)))]
    for name in ("ink", "faint", "accent", *curves):
        assert compute_contrast(colors[name], colors[surface]) >= 4.5, (theme.name, name, surface)
    for name in ("warning", "final", "trajectory", "start", "boundary"):
        assert compute_contrast(colors[name], colors[surface]) >= 3.0, (theme.name, name, surface)


@THEMES
def test_texts_on_colored_areas_have_sufficient_contrast(theme) -> None:
    colors = list_css_colors(theme)
    assert compute_contrast(colors["on-accent"], colors["accent"]) >= 4.5
    assert compute_contrast(colors["on-final"], colors["final"]) >= 4.5
    for k in range(HEAT_LEVELS):
        assert compute_contrast(colors["ink"], colors[f"heat-{k}"]) >= 4.5
    for k in range(len(theme.robots)):
        assert compute_contrast(colors["trajectory"], colors[f"cell-{k}"]) >= 3.0


def test_a_fixed_dark_theme_is_printed_in_light_colors() -> None:
    css = build_theme_rules(":root", "dark")
    screen, _, paper = css.partition("@media print")
    assert parse_declarations(screen)["background"] == format_hex_color(DARK.background)
    assert parse_declarations(paper)["background"] == format_hex_color(LIGHT.background)
    assert "prefers-color-scheme" not in css


def test_the_automatic_theme_follows_preferences_and_notebooks() -> None:
    css = build_theme_rules(".scope")
    for selector in (
        "prefers-color-scheme:dark",
        'data-jp-theme-light="false"',
        'data-vscode-theme-kind$="dark"',
    ):
        assert selector in css
    assert css.count("{") == css.count("}")
    assert css.index("@media print") == css.rindex("@media")


def test_an_unknown_theme_is_rejected() -> None:
    with pytest.raises(ParameterError, match="unknown theme 'sepia'"):
        build_theme_rules(":root", "sepia")
