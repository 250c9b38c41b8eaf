from __future__ import annotations

import math

import numpy as np

from robocov.density import Gaussian, Gaussians
from robocov.observation.region import Region
from robocov.planning.discovered import FREE, WALL, DiscoveredMap, Raster
from robocov.planning.placement import demand, own_place, team_places, viewpoint
from robocov.planning.wayfinding import GridPlanner, Window

REGION = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]]))
RASTER = Raster(REGION, 0.1)
WINDOW = Window.around(RASTER, np.array([4.0, 2.0]), math.inf, 250)


def known(*walls: tuple[slice, slice]) -> DiscoveredMap:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    for wall in walls:
        state[wall] = WALL
    return DiscoveredMap(RASTER, state)


def ways(on: DiscoveredMap) -> GridPlanner:
    return GridPlanner(on, WINDOW, 0.15)


HALVES = (slice(0, 28), slice(39, 41))
"""A wall between a left and a right room, with a passage above."""


def test_weights_are_areas() -> None:
    some = ways(known(HALVES))
    weights = demand(some)
    assert weights.sum() == np.count_nonzero(~known(HALVES).blocked)
    every = np.ones(len(weights))
    assert viewpoint(some, every, every, 0.0, ()) is None


def test_what_counts_more_weighs_more() -> None:
    spot = Gaussians((Gaussian((6.0, 2.0), 3.0, 0.5),), floor=1.0)
    some = ways(known())
    plain, dense = demand(some), demand(some, spot)
    assert (dense >= plain).all()
    near = some.standing(np.array([6.0, 2.0]))
    np.testing.assert_allclose(dense[near] / plain[near], spot.evaluate(some.nodes[[near]])[0])


def test_unknown_insides_hardly_count_and_shadows_do() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[10:20, 10:20] = WALL
    state[11:19, 11:19] = 0
    state[10:20, 50:60] = 0
    some = GridPlanner(DiscoveredMap(RASTER, state), WINDOW, 0.0)
    full = np.count_nonzero(state == FREE)
    np.testing.assert_allclose(demand(some).sum(), full + 100, rtol=1e-3)
    assert demand(some, sure=True).sum() == full
    # a look goes to the border of what is open, and not to where somebody has looked
    mine = home = np.ones(len(some.nodes))
    place = viewpoint(some, mine, home, 5.0, ())
    assert place is not None
    assert 4.9 < place[0] < 6.1
    assert 0.9 < place[1] < 2.1
    other = viewpoint(some, mine, home, 5.0, (place,))
    assert other is not None
    assert math.dist(place, other) > 0.5
    assert viewpoint(some, mine, home, 101.0, ()) is None


def cost(on: DiscoveredMap, places: np.ndarray) -> float:
    some = ways(on)
    weights = demand(some)
    away = some.from_places(places)
    good = np.isfinite(away) & (weights > 0)
    return float((weights[good] * away[good]).sum())


def test_a_team_spreads_over_both_rooms() -> None:
    on = known(HALVES)
    some = ways(on)
    now = np.array([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5], [1.5, 1.5]])
    nobody = np.zeros(4, dtype=bool)
    places = team_places(some, demand(some), now, now, nobody, np.empty((0, 2)), 0.01, 0.01)
    assert (places[:, 0] > 4.1).any()
    assert cost(on, places) < 0.5 * cost(on, now)
    for by_hand in ([[1.5, 2], [2.5, 1], [5.5, 2], [7, 2]], [[1, 1], [3, 1], [1.5, 3], [6, 2]]):
        assert cost(on, places) < 1.02 * cost(on, np.array(by_hand, dtype=float))
    # the same plan, by whom ever it is made
    order = np.array([2, 0, 3, 1])
    other = team_places(some, demand(some), now[order], now[order], nobody, np.empty((0, 2)), 0.01, 0.01)
    np.testing.assert_allclose(np.sort(places, axis=0), np.sort(other, axis=0))


def test_who_rests_stays_in_the_plan() -> None:
    on = known(HALVES)
    some = ways(on)
    now = np.array([[1.0, 1.0], [6.3, 1.9], [1.0, 1.5]])
    given = np.array([False, True, False])
    places = team_places(some, demand(some), now, now, given, np.empty((0, 2)), 0.01, 0.01)
    np.testing.assert_array_equal(places[1], now[1])
    assert (places[[0, 2], 0] < 4.1).sum() >= 1


def test_ones_own_place_is_a_minimum_and_is_kept() -> None:
    on = known()
    some = ways(on)
    weights = demand(some)
    others = np.array([[6.0, 2.0]])
    begin = some.standing(np.array([0.7, 0.7]))
    found = own_place(some, weights, others, begin, np.full(2, np.nan), 0.0)
    found = own_place(some, weights, others, found.node, np.full(2, np.nan), 0.0)
    best = cost(on, np.vstack([found.goal, others]))
    for shift in ([0.3, 0], [-0.3, 0], [0, 0.3], [0, -0.3]):
        assert cost(on, np.vstack([found.goal + shift, others])) > best
    np.testing.assert_allclose(found.goal[1], 2.0, atol=0.1)
    assert (found.mine[some.nodes[:, 0] > 5.5] == 0.0).all()
    near = found.goal + [0.05, -0.02]
    assert own_place(some, weights, others, found.node, near, 0.01).goal.tolist() == near.tolist()
    moved = own_place(some, weights, others, found.node, near, 0.0).goal
    np.testing.assert_allclose(moved, found.goal, atol=1e-9)


def test_what_is_not_known_may_be_left_out() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[:, 40:] = 0
    on = DiscoveredMap(RASTER, state)
    hoped, sure = demand(ways(on)), demand(ways(on), sure=True)
    assert sure.sum() == 40 * 40
    assert hoped.sum() > 1.5 * sure.sum()


def test_places_are_swapped_only_where_that_saves_enough() -> None:
    some = ways(known())
    weights, nobody = demand(some), np.zeros(2, dtype=bool)
    start = np.array([[2.0, 2.0], [6.0, 2.0]])
    places = team_places(some, weights, start, start, nobody, np.empty((0, 2)), 1.0, 1.0)
    left, right = places[:, 0]
    assert left < right
    # each is beyond the middle between them: 2.4 m of way each, or 1.6 m to the place of the other one
    now = np.array([[0.5 * (left + right) + 0.3, 2.0], [0.5 * (left + right) - 0.3, 2.0]])
    for swapping, swapped in ((0.0, True), (0.5, True), (0.6, False)):
        found = team_places(some, weights, now, places, nobody, np.empty((0, 2)), 1.0, 1.0, swapping)
        assert np.array_equal(found, places[::-1] if swapped else places)
