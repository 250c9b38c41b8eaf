"""The cache of rendered surfaces and its limit of memory."""

import pygame
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.surface_cache import CachedRenderer, cache_surfaces


def create_renderer(max_bytes: int) -> tuple[CachedRenderer, list[int]]:
    """Return a cached function that renders squares, and the list of the sides of rendered squares, px."""
    rendered_sides: list[int] = []

    @cache_surfaces(max_bytes)
    def render_square(side: int, name: str = "") -> pygame.Surface:
        rendered_sides.append(side)
        return pygame.Surface((side, side), 0, 32)

    return render_square, rendered_sides


def count_bytes(surface: pygame.Surface) -> int:
    return surface.get_pitch() * surface.get_height()


@given(st.lists(st.integers(1, 30), max_size=60))
def test_memory_is_limited(sides: list[int]) -> None:
    max_bytes = 4000
    render_square, _ = create_renderer(max_bytes)
    for side in sides:
        assert render_square(side).get_size() == (side, side)
        used_bytes = sum(count_bytes(surface) for surface in render_square.surfaces.values())
        assert used_bytes <= max_bytes


def test_frequently_used_surfaces_stay_in_the_cache() -> None:
    render_square, rendered_sides = create_renderer(2000)
    for side in range(1, 20):
        render_square(10)
        render_square(side)
    assert rendered_sides.count(10) == 1


def test_positional_arguments_distinguish_surfaces() -> None:
    render_square, rendered_sides = create_renderer(10_000)
    surface = render_square(5)
    named_surface = render_square(5, "a")
    assert named_surface is not surface
    assert render_square(5, "a") is named_surface
    assert rendered_sides == [5, 5]


def test_keyword_arguments_distinguish_surfaces() -> None:
    render_square, rendered_sides = create_renderer(10_000)
    surface = render_square(5)
    named_surface = render_square(5, name="a")
    assert named_surface is not surface
    assert render_square(5, name="a") is named_surface
    assert rendered_sides == [5, 5]


def test_surfaces_are_rendered_again_after_clearing() -> None:
    render_square, rendered_sides = create_renderer(10_000)
    render_square(5)
    render_square.cache_clear()
    render_square(5)
    assert rendered_sides == [5, 5]
