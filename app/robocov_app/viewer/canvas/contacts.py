"""Contacts of robots with walls, obstacles and other robots, at the displayed step."""

import numpy as np
import shapely
from scipy.spatial import KDTree

from robocov.environment import Environment
from robocov.metrics import MAX_CONTACT_GAP_M
from robocov.typing import FloatArray
from robocov_app.render.scene import Contacts, Scene


class ContactFinder:
    """Finds contacts of robots by the criterion with which reports count them.

    The outline of the walls is computed once for each map.
    """

    def __init__(self) -> None:
        self._environment: Environment | None = None
        self._walls = shapely.LineString()

    def find_contacts(self, environment: Environment, scene: Scene) -> Contacts:
        """Return the contacts in a scene.

        Parameters
        ----------
        environment : Environment
            The map, of which only the obstacles that do not move are used.
        scene : Scene
            Robots, moving obstacles and failed robots.

        Returns
        -------
        Contacts
        """
        if environment is not self._environment:
            self._environment = environment
            self._walls = environment.static.free.boundary
            shapely.prepare(self._walls)
        positions = scene.now.positions
        radii = scene.team.radius
        centers = shapely.points(positions)
        rows = []
        points = []
        for body in [self._walls, *_list_movable_outlines(scene)]:
            touching = np.flatnonzero(shapely.dwithin(body, centers, radii + MAX_CONTACT_GAP_M))
            lines = shapely.shortest_line(body, centers[touching])
            rows.append(touching)
            points.append(shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 0])
        return Contacts(
            rows=np.concatenate(rows),
            points=np.concatenate(points),
            points_between_robots=_find_points_between_robots(positions, radii),
        )


def _list_movable_outlines(scene: Scene) -> list[shapely.Geometry]:
    """Return the outlines of moving obstacles and failed robots."""
    outlines: list[shapely.Geometry] = [moving.polygon.exterior for moving in scene.moving]
    for number, center in scene.failed.items():
        outlines.append(shapely.Point(center).buffer(scene.get_failed_radius(number)).exterior)
    return outlines


def _find_points_between_robots(positions: FloatArray, radii: FloatArray) -> FloatArray:
    """Return the contact points of pairs of robots, (p, 2) m, for positions (n, 2) m and radii (n,) m."""
    reach = 2.0 * float(radii.max(initial=0.0)) + MAX_CONTACT_GAP_M
    pairs = KDTree(positions).query_pairs(reach, output_type="ndarray")
    first, second = pairs.T
    offsets = positions[second] - positions[first]
    distances = np.hypot(*offsets.T)
    is_contact = distances <= radii[first] + radii[second] + MAX_CONTACT_GAP_M
    fractions = radii[first] / (radii[first] + radii[second])
    points = positions[first] + fractions[:, None] * offsets
    return np.asarray(points[is_contact])
