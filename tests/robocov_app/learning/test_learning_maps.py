"""Maps of learning episodes: given, generated and rejected ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocov.environment import Environment
from robocov.errors import MapError, ParameterError
from robocov.mapfile import load_map, save_map
from robocov_app.learning import GeneratedMaps
from robocov_app.learning.maps import MapSampler


def draw_names(sampler: MapSampler, seed: int, count: int) -> list[str]:
    rng = np.random.default_rng(seed)
    return [sampler.draw(rng).name for _ in range(count)]


def test_a_single_map_is_given_by_name_path_or_object(empty: Environment, tmp_path: Path) -> None:
    save_map(empty, tmp_path / "mine.json")
    for maps in (empty, tmp_path / "mine.json", str(tmp_path / "mine.json")):
        assert draw_names(MapSampler(maps, 8), 0, 2) == ["empty", "empty"]
    assert draw_names(MapSampler("square", 8), 0, 1) == [load_map("square").name]


def test_several_maps_are_drawn_equally_often(empty: Environment, cluttered: Environment) -> None:
    names = draw_names(MapSampler([empty, cluttered], 8), 0, 200)
    assert 75 <= names.count("empty") <= 125
    assert names == draw_names(MapSampler([empty, cluttered], 8), 0, 200)
    assert names != draw_names(MapSampler([empty, cluttered], 8), 1, 200)


def test_functions_that_build_maps_receive_new_seeds() -> None:
    seeds: list[int] = []

    def build_map(seed: int) -> Environment:
        seeds.append(seed)
        return Environment(f"map {seed}", ((0, 0), (1, 0), (1, 1), (0, 1)))

    names = draw_names(MapSampler(build_map, 8), 3, 5)
    assert len(set(seeds)) == 5
    assert names == [f"map {seed}" for seed in seeds]


def test_generated_maps_follow_from_their_seeds() -> None:
    maps = GeneratedMaps("polygons", seeds=[3, 8], parameters={"obstacles": 2, "area": 0.05})
    names = set(draw_names(MapSampler(maps, 8), 0, 12))
    assert names == {"polygons 3", "polygons 8"}
    assert len(maps(0).obstacles) == 2
    assert GeneratedMaps(parameters={"obstacles": 2, "area": 0.05})(5).name == "polygons 5"


def test_costs_of_recently_used_maps_are_cached(empty: Environment, cluttered: Environment) -> None:
    sampler = MapSampler([empty, cluttered], 8)
    first = sampler.get_cost(empty)
    assert sampler.get_cost(empty) is first
    assert sampler.get_cost(cluttered) is not first
    assert first.lattice == 8
    for k in range(70):  # more than the cache can hold
        sampler.get_cost(Environment(f"map {k}", ((0, 0), (1, 0), (1, 1), (0, 1))))
        if k == 40:
            cost_of_cluttered = sampler.get_cost(cluttered)
    assert sampler.get_cost(empty) is not first
    assert sampler.get_cost(cluttered) is cost_of_cluttered


def test_invalid_maps_are_rejected(empty: Environment) -> None:
    with pytest.raises(ParameterError, match="maps: expected at least one, got none"):
        MapSampler([], 8)
    with pytest.raises(ParameterError, match=r"maps\[1\]: expected a map, its name or path"):
        MapSampler([empty, 3], 8)
    with pytest.raises(MapError, match="did you mean"):
        MapSampler("roomss", 8)
    with pytest.raises(ParameterError, match=r"maps: expected an Environment"):
        MapSampler(lambda seed: "x", 8).draw(np.random.default_rng(0))
    with pytest.raises(ParameterError, match="maps: seeds: expected at least one, got none"):
        GeneratedMaps(seeds=[])
