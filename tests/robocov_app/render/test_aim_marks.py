"""Crosses where robots head: plus signs for centroids, times signs for other goals."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import SIZE, TWO, list_legend_texts, list_pixels, measure_min_error, render_layers
from drawn_run import SQUARE, build_scene

from robocov.observation import Decision, Snapshot
from robocov.voronoi import partition
from robocov_app.look.theme import LIGHT
from robocov_app.render.painter import Painter
from robocov_app.render.scene import CENTROID_TOLERANCE_M, Scene, are_centroids

CENTROIDS = partition(TWO, SQUARE.region).centroids
OTHER_GOALS = TWO + 1.0
PLUS_SIGN_PX = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
TIMES_SIGN_PX = np.array([[0.0, 0.0], [3.0, 3.0], [-3.0, 3.0]])


def test_centroids_are_plus_signs() -> None:
    frame, painter = render_layers(build_scene(TWO, goals=CENTROIDS), "centroids")
    for center in painter.camera.to_pixels(CENTROIDS):
        for offset in PLUS_SIGN_PX:
            assert measure_min_error(frame, center + offset, LIGHT.ink) < 60


def test_goals_that_are_centroids_are_plus_signs_too() -> None:
    """An x over the plus sign of the centroid would look like a star."""
    frame, painter = render_layers(build_scene(TWO, goals=CENTROIDS), "goals")
    for center in painter.camera.to_pixels(CENTROIDS):
        for offset in PLUS_SIGN_PX:
            assert measure_min_error(frame, center + offset, LIGHT.ink) < 60


@pytest.mark.parametrize("layer", ["centroids", "goals"])
def test_other_goals_are_times_signs(layer: str) -> None:
    goals = CENTROIDS + (0.0, 2.0 * CENTROID_TOLERANCE_M)
    goals[1] += 1.0
    frame, painter = render_layers(build_scene(TWO, goals=goals), layer)
    for center in painter.camera.to_pixels(goals):
        for offset in TIMES_SIGN_PX:
            assert measure_min_error(frame, center + offset, LIGHT.final) < 90


@pytest.mark.parametrize(
    ("goals", "legend"),
    [
        pytest.param(CENTROIDS, ["cell centroid"], id="centroids"),
        pytest.param(OTHER_GOALS, ["goal"], id="other goals"),
        pytest.param(None, [], id="no goals"),
    ],
)
def test_the_legend_distinguishes_centroids_and_goals(goals: np.ndarray | None, legend: list[str]) -> None:
    painter = Painter(SQUARE, SIZE)
    painter.show_only({"centroids"})
    assert list_legend_texts(painter, build_scene(TWO, goals=goals)) == legend


def test_a_controller_without_goals_has_no_crosses() -> None:
    pixels, _ = list_pixels(build_scene(TWO, goals=None), "centroids")
    assert len(pixels) == 0


def test_centroids_of_assumed_cells_are_centroids_with_limited_communication() -> None:
    """Here each robot knows only the first one and takes the whole square for its cell."""
    assumed_cell = partition(TWO[:1], SQUARE.region)
    assumed = replace(assumed_cell, centroids=np.repeat(assumed_cell.centroids, 2, axis=0))
    assert not are_centroids(assumed.centroids, CENTROIDS)
    scene = build_scene(TWO, goals=CENTROIDS)
    assert scene.snapshot is not None
    decision = Decision(np.zeros((2, 2)), assumed.centroids, cells=assumed)
    team = replace(scene.team, communication_range=np.ones(2))
    scene = Scene.from_snapshot(SQUARE, team, Snapshot(scene.snapshot.seen, decision))
    _, painter = list_pixels(scene, "centroids")
    assert list_legend_texts(painter, scene) == ["cell centroid"]


@pytest.mark.parametrize(
    "positions",
    [
        pytest.param(partition(CENTROIDS, SQUARE.region).centroids, id="centroids"),
        pytest.param(OTHER_GOALS, id="other goals"),
    ],
)
def test_a_robot_that_has_arrived_has_no_cross(positions: np.ndarray) -> None:
    pixels, _ = list_pixels(build_scene(positions, goals=positions), "centroids")
    assert len(pixels) == 0


@pytest.mark.parametrize("layer", ["centroids", "goals"])
def test_a_robot_without_a_goal_has_no_cross(layer: str) -> None:
    """Only the first robot has a goal, in the left half of the square."""
    goals = np.array([[3.0, 6.0], [np.nan, np.nan]])
    scene = build_scene(TWO, goals=goals)
    frame, painter = render_layers(scene, layer)
    assert measure_min_error(frame, painter.camera.to_pixels(goals[0]), LIGHT.final) < 90
    pixels, _ = list_pixels(scene, layer)
    points = painter.camera.to_world(pixels.astype(float))
    assert (points[:, 0] < 4.0).all()


def test_are_centroids_ignores_unknown_goals() -> None:
    goals = np.array([[1.0, 1.0], [np.nan, np.nan]])
    assert are_centroids(goals, np.array([[1.0, 1.02], [5.0, 5.0]]))


def test_are_centroids_rejects_goals_beyond_the_tolerance() -> None:
    goals = np.array([[1.0, 1.0], [5.0, 4.9]])
    assert not are_centroids(goals, np.array([[1.0, 1.0], [5.0, 5.0]]))
