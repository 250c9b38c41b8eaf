"""The legend that panes share tells what any of them shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from robocov.mapfile import load_map
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session


def words(tmp_path: Path, *laws: str) -> list[str]:
    session = Session(SessionScenario(load_map("square"), tuple(ControllerChoice(law) for law in laws)))
    with ViewerLauncher(session, "square", tmp_path, size=(1280, 720), headless=True).window() as window:
        for _ in range(10):
            window.run_frame(1 / 30)
        return [entry.text for entry in window.canvas._list_legend_entries()]


@pytest.mark.parametrize("laws", [("rpf", "lloyd"), ("lloyd", "rpf")])
def test_centroids_are_explained_whoever_heads_for_them(tmp_path: Path, laws: tuple[str, str]) -> None:
    assert "cell centroid" in words(tmp_path, *laws)


def test_each_thing_is_explained_once(tmp_path: Path) -> None:
    found = words(tmp_path, "rpf", "lloyd", "atlas")
    assert {"cell centroid", "goal"} < set(found)
    assert len(found) == len(set(found))
