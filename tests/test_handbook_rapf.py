"""The page on RAPF states the defaults of the package and prints what its code prints."""

from __future__ import annotations

import re
from typing import Any

import pytest

import robocov as rc
from robocov_app.commands.handbook import find_page_sources

PAGE = (find_page_sources() / "rapf.md").read_text(encoding="utf-8")


def test_the_table_has_the_default_gains_and_limits() -> None:
    rapf = rc.Rapf()
    rpf = rc.Rpf()
    team = rc.Team.homogeneous(1)
    for row in (
        f"| `k_rep` | {rapf.k_rep:g} N m³ | {rpf.k_rep:g} N m³ |",
        f"| `rho_0` | {rapf.rho_0:g} m | {rpf.rho_0:g} m |",
        f"| `k_att` | {rapf.k_att:g} N/m³ |",
        f"| `attraction_limit` | {rapf.attraction_limit:g} N |",
        f"| {team.mass[0]:g} kg, {team.viscosity[0]:g} N s/m |",
        f"| {team.max_speed[0]:g} m/s, {team.max_acceleration[0]:g} m/s² |",
    ):
        assert row in PAGE


def test_the_example_prints_the_forces_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    code, printed = re.findall(r"```(?:python|text)\n(.*?)```", PAGE, re.S)
    names: dict[str, Any] = {}
    exec(code, names)
    assert capsys.readouterr().out == printed
