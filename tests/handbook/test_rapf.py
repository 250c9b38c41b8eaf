"""The page on RAPF states the default gains, and prints what its code prints."""

from __future__ import annotations

from typing import Any

import pytest
from markdown_pages import find_code_blocks, read_handbook_page

import robocov as rc

PAGE = read_handbook_page("rapf")


def test_the_table_contains_the_default_gains_and_limits() -> None:
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


def test_the_code_prints_the_forces_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    example, output = find_code_blocks(PAGE)
    names: dict[str, Any] = {}
    exec(example.code, names)
    assert capsys.readouterr().out == output.code
