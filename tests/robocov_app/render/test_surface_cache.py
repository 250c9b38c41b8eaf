"""Surfaces are cached within bounded memory."""

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.surface_cache import cache_surfaces


def create_renderer(max_bytes: int):
    rendered: list[int] = []

    @cache_surfaces(max_bytes)
    def render_page(side: int, name: str = "") -> pygame.Surface:
        rendered.append(side)
        return pygame.Surface((side, side), 0, 32)

    return render_page, rendered


@given(st.lists(st.integers(1, 30), max_size=60))
def test_memory_is_bounded(sides: list[int]) -> None:
    render_page, _ = create_renderer(4000)
    for side in sides:
        assert render_page(side).get_size() == (side, side)
        assert (
            sum(surface.get_pitch() * surface.get_height() for surface in render_page.surfaces.values())
            <= 4000
        )


def test_frequently_used_surfaces_stay() -> None:
    render_page, rendered = create_renderer(2000)
    for side in range(1, 20):
        render_page(10)
        render_page(side)
    assert rendered.count(10) == 1


@pytest.mark.parametrize(
    "call", [lambda render_page: render_page(5, "a"), lambda render_page: render_page(5, name="a")]
)
def test_different_arguments_give_different_surfaces(call) -> None:
    render_page, rendered = create_renderer(10_000)
    assert render_page(5) is not call(render_page)
    assert call(render_page) is call(render_page)
    assert rendered == [5, 5]


def test_surfaces_are_rendered_again_after_clearing() -> None:
    render_page, rendered = create_renderer(10_000)
    render_page(5)
    render_page.cache_clear()
    render_page(5)
    assert rendered == [5, 5]
