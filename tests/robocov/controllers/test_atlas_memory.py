from __future__ import annotations

from copy import deepcopy

import numpy as np

from robocov.controllers.atlas import Atlas
from robocov.controllers.atlas_memory import RestTracker
from robocov.observation.region import Region
from robocov.robots import Team


def test_who_stays_is_noticed() -> None:
    watch = RestTracker(np.array([1, 4]), np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.0, 0.5]))
    later = watch.goes_on(np.array([1, 2, 4]), np.array([[0.05, 0.0], [3.0, 3.0], [1.2, 0.0]]), 2.0)
    assert later.since.tolist() == [0.0, 2.0, 2.0]
    # creeping away is noticed as well
    np.testing.assert_array_equal(later.places, [[0.0, 0.0], [3.0, 3.0], [1.2, 0.0]])


def test_copies_share_what_never_changes() -> None:
    region = Region(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]))
    memory = Atlas().begin(region, Team.homogeneous(3))
    twin = deepcopy(memory)
    assert len(memory.maps) == 3
    assert all(one is other for one, other in zip(memory.states, twin.states, strict=True))
    assert twin.legs is not memory.legs
    assert all((known.state == 0).all() for known in memory.maps)
