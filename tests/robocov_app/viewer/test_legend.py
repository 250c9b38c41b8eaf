"""The legend that the panes share."""

from __future__ import annotations

from pathlib import Path

import pytest

from robocov.mapfile import load_map
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session


def list_legend_texts(tmp_path: Path, *controllers: str) -> list[str]:
    choices = tuple(ControllerChoice(name) for name in controllers)
    session = Session(SessionScenario(load_map("square"), choices))
    with ViewerLauncher(session, "square", tmp_path, size=(1280, 720), headless=True).window() as window:
        for _ in range(10):
            window.run_frame(1 / 30)
        return [entry.text for entry in window.canvas._list_legend_entries()]


@pytest.mark.parametrize("controllers", [("rpf", "lloyd"), ("lloyd", "rpf")])
def test_the_legend_explains_centroids_in_any_order_of_panes(
    tmp_path: Path, controllers: tuple[str, str]
) -> None:
    assert "cell centroid" in list_legend_texts(tmp_path, *controllers)


def test_the_legend_explains_each_symbol_once(tmp_path: Path) -> None:
    texts = list_legend_texts(tmp_path, "rpf", "lloyd", "atlas")
    assert {"cell centroid", "goal"} < set(texts)
    assert len(texts) == len(set(texts))
