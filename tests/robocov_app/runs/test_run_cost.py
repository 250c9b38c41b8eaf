"""The cost of a run: its computation, progress and refinement for figures."""

import sys

import numpy as np
import pytest
from drawn_run import ROOMS

from robocov.cost import CoverageCost
from robocov.mapfile.check import count_vertices
from robocov_app.runs import cost as run_cost
from robocov_app.runs.cost import build_cost, refine_cost_for_figures

POSITION = np.array([[2.0, 2.0]])


def test_the_cost_is_that_of_the_library(monkeypatch, capsys):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", 600.0)  # Even on a slow machine.
    cost = build_cost(ROOMS, 48)
    assert cost.lattice == 48
    assert cost(POSITION).value == CoverageCost(ROOMS, 48)(POSITION).value
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("quiet", [False, True])
def test_long_computations_report_their_progress_unless_quiet(monkeypatch, capsys, quiet):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", -1.0)
    build_cost(ROOMS, 48, quiet=quiet)
    output = capsys.readouterr().err
    assert ("shortest paths: 100 of 100 in" in output) == (not quiet)
    assert len(output.splitlines()) == int(not quiet)


def test_a_terminal_shows_a_progress_bar(monkeypatch, capsys):
    monkeypatch.setattr("robocov_app.terminal.progress.PATIENCE_S", -1.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    build_cost(ROOMS, 48)
    assert "100/100" in capsys.readouterr().err


def test_costs_of_large_maps_are_not_refined(monkeypatch):
    coarse = build_cost(ROOMS, 16)
    monkeypatch.setattr(run_cost, "MANY_VERTICES", count_vertices(ROOMS) - 1)
    assert refine_cost_for_figures(ROOMS, coarse) is coarse


def test_coarse_costs_are_refined_for_figures():
    coarse = build_cost(ROOMS, 16)
    assert refine_cost_for_figures(ROOMS, coarse).lattice == run_cost.MIN_FIGURE_LATTICE
    refined = refine_cost_for_figures(ROOMS, coarse, 20)
    assert refined.lattice == 20
    assert refined(POSITION).value == build_cost(ROOMS, 20)(POSITION).value


def test_fine_costs_are_not_refined():
    fine = build_cost(ROOMS, 300)
    assert refine_cost_for_figures(ROOMS, fine) is fine


def test_a_refined_cost_uses_the_same_shortest_paths():
    """They do not depend on the lattice, and take long on large maps."""
    coarse = build_cost(ROOMS, 16)
    assert refine_cost_for_figures(ROOMS, coarse, 20).geodesics is coarse.geodesics
