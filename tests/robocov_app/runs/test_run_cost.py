import sys

import numpy as np
import pytest
from drawn_run import ROOMS

from robocov.cost import CoverageCost
from robocov.mapfile.check import count_vertices
from robocov_app.runs import cost as run_cost
from robocov_app.runs.cost import build_cost, refine_cost_for_figures

PLACE = np.array([[2.0, 2.0]])


def test_it_is_the_cost(monkeypatch, capsys):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", 600.0)  # also on a slow machine
    cost = build_cost(ROOMS, 48)
    assert cost.lattice == 48
    assert cost(PLACE).value == CoverageCost(ROOMS, 48)(PLACE).value
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("quiet", [False, True])
def test_what_takes_long_is_told(monkeypatch, capsys, quiet):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", -1.0)
    build_cost(ROOMS, 48, quiet=quiet)
    said = capsys.readouterr().err
    assert ("shortest paths: 100 of 100 in" in said) == (not quiet)
    assert len(said.splitlines()) == (0 if quiet else 1)


def test_in_a_terminal_there_is_a_bar(monkeypatch, capsys):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", -1.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    build_cost(ROOMS, 48)
    assert "100/100" in capsys.readouterr().err


def test_large_maps_are_drawn_as_they_were_measured(monkeypatch):
    coarse = build_cost(ROOMS, 16)
    monkeypatch.setattr(run_cost, "MANY_VERTICES", count_vertices(ROOMS) - 1)
    assert refine_cost_for_figures(ROOMS, coarse) is coarse


def test_pictures_want_a_fine_lattice():
    coarse, fine = build_cost(ROOMS, 16), build_cost(ROOMS, 300)
    assert refine_cost_for_figures(ROOMS, coarse).lattice == run_cost.MIN_FIGURE_LATTICE
    assert refine_cost_for_figures(ROOMS, coarse, 20).lattice == 20
    assert refine_cost_for_figures(ROOMS, fine) is fine
    # the shortest paths do not depend on the lattice, and on large maps they take long
    finer = refine_cost_for_figures(ROOMS, coarse, 20)
    assert finer.geodesics is coarse.geodesics
    assert finer(PLACE).value == build_cost(ROOMS, 20)(PLACE).value
