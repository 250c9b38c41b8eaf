"""Contacts of robots, which the window marks and reports count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from drawn_run import ROOMS, build_scene

from robocov.controllers import Lloyd
from robocov.metrics import MAX_CONTACT_GAP_M, compute_clearances
from robocov.simulation import Simulation
from robocov_app.render.moving_obstacles import MovingObstacle
from robocov_app.render.record_scene import build_record_scene
from robocov_app.render.scene import Scene
from robocov_app.viewer.canvas.contacts import ContactFinder


def find_robot_contacts(scene: Scene) -> list[list[float]]:
    """Return the contact points between robots, on the map of a scene."""
    contacts = ContactFinder().find_contacts(scene.environment, scene)
    return contacts.points_between_robots.round(9).tolist()


def test_contacts_with_walls_are_those_that_metrics_count() -> None:
    starts = ROOMS.start("corner").sample(5, 0)
    record = Simulation(ROOMS, Lloyd(), starts).run(8.0)
    is_touching = compute_clearances(record) <= MAX_CONTACT_GAP_M
    assert is_touching.any()
    finder = ContactFinder()
    for row in range(0, len(record.time), 20):
        contacts = finder.find_contacts(ROOMS, build_record_scene(record, row))
        assert sorted(contacts.rows.tolist()) == np.flatnonzero(is_touching[row]).tolist()
        distances = shapely.distance(shapely.points(contacts.points), ROOMS.free.boundary)
        assert (distances < 1e-9).all()


def test_robots_touch_at_the_point_between_them() -> None:
    scene = build_scene(np.array([[2.0, 2.0], [2.2, 2.0], [4.0, 4.0]]))
    assert scene.team.radius.tolist() == [0.1] * 3
    assert find_robot_contacts(scene) == [[2.1, 2.0]]
    assert find_robot_contacts(build_scene(np.array([[2.0, 2.0], [2.2011, 2.0]]))) == []


def test_failed_robots_and_moving_obstacles_are_touched() -> None:
    box = MovingObstacle(shapely.box(4.0, 2.0, 5.0, 3.0), np.zeros(2), np.zeros((1, 2)), np.zeros(2))
    scene = replace(build_scene(np.array([[3.9, 2.5], [2.0, 2.0]])), failed={3: (2.0, 2.2)}, moving=(box,))
    contacts = ContactFinder().find_contacts(scene.environment, scene)
    assert contacts.rows.tolist() == [0, 1]
    assert np.allclose(contacts.points, [[4.0, 2.5], [2.0, 2.1]], atol=1e-3)
