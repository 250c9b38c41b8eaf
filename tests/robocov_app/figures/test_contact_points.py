"""Points at which contacts of a run began."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_run import ROOMS, SQUARE, record_walk

import robocov as rc
from robocov.metrics import compute_clearances, count_contacts
from robocov.team import Team
from robocov_app.figures.contact_points import find_contact_points


def test_a_contact_that_lasts_has_one_point():
    record = record_walk(SQUARE, 1, steps=6)
    radius = float(record.team.radius[0])
    positions = np.array([[4.0, 4.0], [radius, 4.0], [radius, 4.2], [4.0, 4.0], [4.0, radius], [4.0, 4.0]])
    walls = np.array([[0.0, 4.0], [0.0, 4.0], [0.0, 4.2], [0.0, 4.0], [4.0, 0.0], [4.0, 0.0]])
    record = replace(record, positions=positions[:, None], obstacle_points=walls[:, None])
    assert find_contact_points(record) == pytest.approx(np.array([[0.0, 4.0], [4.0, 0.0]]))


def test_robots_touch_between_their_centers():
    record = record_walk(SQUARE, 2, steps=3)
    positions = np.array([[[2.0, 4.0], [6.0, 4.0]], [[3.0, 4.0], [3.4, 4.0]], [[2.0, 4.0], [6.0, 4.0]]])
    record = replace(
        record, positions=positions, team=replace(Team.homogeneous(2), radius=np.array([0.1, 0.3]))
    )
    assert find_contact_points(record) == pytest.approx(np.array([[3.1, 4.0]]))


@pytest.mark.parametrize("controller", ["lloyd", "rapf"])
def test_there_are_as_many_points_as_contacts_in_the_summary(controller):
    record = rc.run("trap", controller, duration=20.0)
    assert len(find_contact_points(record)) == count_contacts(record, compute_clearances(record))


def test_a_crowd_has_none():
    assert len(find_contact_points(record_walk(ROOMS, 101, steps=2))) == 0
