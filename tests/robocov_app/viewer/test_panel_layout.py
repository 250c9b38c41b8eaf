"""The layout of the panel: names and symbols of parameters, sliders, and the list of controllers."""

from __future__ import annotations

from pathlib import Path

import pygame
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import RAPF, RPF

from robocov.controllers import CONTROLLERS
from robocov_app.toolkit.widgets.appearance import TEXT_PX
from robocov_app.toolkit.widgets.slider import FINE_FRACTION
from robocov_app.viewer.panel.panel import choose_note
from robocov_app.viewer.panel.parameters import (
    GAIN_LABELS,
    MAX_BASIC_GAINS,
    NumberParameter,
    list_gain_parameters,
    list_limit_parameters,
)
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

MIN_SLIDER_PX = 140


@pytest.mark.parametrize("name", list(CONTROLLERS))
def test_labels_of_gains_are_unique_and_capitalized(name: str) -> None:
    parameters = list(list_gain_parameters(ControllerChoice(name)))
    labels = [parameter.label for parameter in parameters]
    assert len(set(labels)) == len(labels)
    for parameter in parameters:
        assert parameter.name in GAIN_LABELS
        assert parameter.label[:1].isupper()
        assert "_" not in parameter.label


@pytest.mark.parametrize("name", list(CONTROLLERS))
def test_only_a_few_numbers_are_basic_gains(name: str) -> None:
    parameters = list_gain_parameters(ControllerChoice(name))
    basic = [parameter for parameter in parameters if not parameter.is_advanced]
    assert len(basic) <= MAX_BASIC_GAINS
    assert all(isinstance(parameter, NumberParameter) for parameter in basic)


def test_a_symbol_that_repeats_the_name_is_left_out() -> None:
    notes = {parameter.name: choose_note(parameter) for parameter in list_gain_parameters(RAPF)}
    assert notes["k_rep"] == "k_rep"
    assert notes["attraction_limit"] == ""


def test_four_limits_are_shown_before_the_advanced_ones() -> None:
    limits = list(list_limit_parameters(RobotProperties()))
    assert [limit.is_advanced for limit in limits] == [False] * 4 + [True] * 3


@pytest.mark.parametrize("size", [(900, 600), (1280, 720)])
def test_four_sliders_are_wide_and_visible_at_once(tmp_path: Path, size: tuple[int, int]) -> None:
    with open_viewer(tmp_path, RAPF, size=size) as driver:
        driver.window.draw()
        scale = driver.window.layout.scale
        for name in ("k_rep", "rho_0", "k_att", "attraction_limit"):
            slider = driver.find_widget("slider", name)
            assert slider is not None
            assert slider.rect.width >= MIN_SLIDER_PX * scale
            assert slider.rect.height >= TEXT_PX * scale


def test_four_controllers_leave_space_for_parameters(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF, RPF, RPF) as driver:
        driver.window.draw()
        menus = [driver.find_rect("menu", f"controller:{pane}") for pane in range(4)]
        assert len({menu.left for menu in menus}) == 1
        for name in ("k_rep", "rho_0"):
            assert driver.find_rect("slider", name).height > 0


def test_advanced_parameters_appear_at_a_click(driver: Driver) -> None:
    driver.window.draw()
    assert driver.find_widget("slider", "height") is None
    section = driver.find_widget("section", "section:advanced")
    assert section is not None
    assert section.value is False
    driver.scroll_to(section)
    driver.click(*driver.find_rect("section", "section:advanced").center)
    assert driver.find_widget("slider", "height") is not None
    driver.type_into("height", "2")
    driver.press_key("return")
    assert driver.session.timeline.panes[0].controller.get_value("height") == 2.0


def test_a_parameter_is_reset_only_if_it_differs_from_its_default(driver: Driver) -> None:
    driver.window.draw()
    assert driver.find_widget("button", "reset:k_rep") is None
    driver.type_into("k_rep", "2")
    driver.press_key("return")
    driver.push_button("reset:k_rep")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 0.3
    driver.window.draw()
    assert driver.find_widget("button", "reset:k_rep") is None


def test_shift_makes_a_drag_ten_times_finer(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    def drag(pixels: int) -> float:
        knob, _ = driver.find_knob("k_rep")
        driver.drag(knob.center, *((knob.centerx + x, knob.centery) for x in range(1, pixels + 1)))
        return float(driver.session.timeline.panes[0].controller.get_value("k_rep"))

    coarse = drag(40) / 0.3
    driver.push_button("reset:k_rep")
    monkeypatch.setattr(pygame.key, "get_mods", lambda: pygame.KMOD_LSHIFT)
    fine = drag(40) / 0.3
    assert fine == pytest.approx(coarse**FINE_FRACTION, rel=0.02)


def test_a_window_of_parameters_names_them_in_the_palette(driver: Driver) -> None:
    titles = [command.title for command in driver.window.commands.list_all()]
    assert "Repulsion strength (k_rep)" in titles
