"""Crosses where robots head: plus signs for centroids, times signs for goals of another kind."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import TWO, list_legend_texts, list_pixels, measure_least_error, render_layers
from drawn_run import SQUARE, build_scene

from robocov.observation import Decision, Snapshot
from robocov.voronoi import partition
from robocov_app.look.theme import LIGHT
from robocov_app.render.scene import CENTROID_TOLERANCE_M, Scene, are_centroids

CENTROIDS = partition(TWO, SQUARE.region).centroids
UPRIGHT = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
ACROSS = np.array([[0.0, 0.0], [3.0, 3.0], [-3.0, 3.0]])


def test_centroids_are_plus_signs() -> None:
    frame, painter = render_layers(build_scene(TWO, goals=CENTROIDS), "centroids")
    for center in painter.camera.to_pixels(CENTROIDS):
        assert all(measure_least_error(frame, center + arm, LIGHT.ink) < 60 for arm in UPRIGHT)


@pytest.mark.parametrize("layer", ["centroids", "goals"])
def test_goals_of_another_kind_are_times_signs(layer: str) -> None:
    """A controller that does not head for centroids does not know of them."""
    goals = CENTROIDS + (0.0, 2.0 * CENTROID_TOLERANCE_M)
    goals[1] += 1.0
    frame, painter = render_layers(build_scene(TWO, goals=goals), layer)
    for center in painter.camera.to_pixels(goals):
        assert all(measure_least_error(frame, center + arm, LIGHT.final) < 90 for arm in ACROSS)


def test_the_legend_distinguishes_centroids_and_goals() -> None:
    """RPF has no goals: neither crosses nor their entry in the legend."""
    for goals, words in ((CENTROIDS, ["cell centroid"]), (TWO + 1, ["goal"]), (None, [])):
        scene = build_scene(TWO, goals=goals)
        pixels, painter = list_pixels(scene, "centroids")
        assert bool(len(pixels)) == bool(words)
        assert list_legend_texts(painter, scene) == words


def test_goals_are_centroids_with_limited_communication() -> None:
    """That of what it takes for its cell; the word does not change with each message that is lost."""
    scene = build_scene(TWO, goals=CENTROIDS)
    alone = partition(TWO[:1], SQUARE.region)
    heard = replace(alone, centroids=np.repeat(alone.centroids, 2, axis=0))
    decision = Decision(np.zeros((2, 2)), heard.centroids, cells=heard)
    assert scene.snapshot is not None
    limited = Scene.from_snapshot(
        SQUARE, replace(scene.team, communication_range=np.ones(2)), Snapshot(scene.snapshot.seen, decision)
    )
    assert not are_centroids(heard.centroids, CENTROIDS)
    _, painter = list_pixels(limited, "centroids")
    assert list_legend_texts(painter, limited) == ["cell centroid"]


@pytest.mark.parametrize("goals", [CENTROIDS, TWO + 1])
def test_a_robot_that_has_arrived_has_no_cross(goals: np.ndarray) -> None:
    arrived = goals if goals is not CENTROIDS else partition(CENTROIDS, SQUARE.region).centroids
    pixels, _ = list_pixels(build_scene(arrived, goals=arrived), "centroids")
    assert len(pixels) == 0


def test_a_robot_without_a_goal_has_no_cross() -> None:
    goals = np.array([[3.0, 6.0], [np.nan, np.nan]])
    for layer in ("centroids", "goals"):
        scene = build_scene(TWO, goals=goals)
        frame, painter = render_layers(scene, layer)
        assert measure_least_error(frame, painter.camera.to_pixels(goals[0]), LIGHT.final) < 90
        pixels, _ = list_pixels(scene, layer)
        assert (painter.camera.to_world(pixels.astype(float))[:, 0] < 4.0).all()


def test_are_centroids_ignores_unknown_goals() -> None:
    assert are_centroids(np.array([[1.0, 1.0], [np.nan, np.nan]]), np.array([[1.0, 1.02], [5.0, 5.0]]))
    assert not are_centroids(np.array([[1.0, 1.0], [5.0, 4.9]]), np.array([[1.0, 1.0], [5.0, 5.0]]))
