"""Pictures are kept as long as there is room."""

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.surface_cache import cache_surfaces


def drawing(most_bytes: int):
    drawn: list[int] = []

    @cache_surfaces(most_bytes)
    def page(side: int, name: str = "") -> pygame.Surface:
        drawn.append(side)
        return pygame.Surface((side, side), 0, 32)

    return page, drawn


@given(st.lists(st.integers(1, 30), max_size=60))
def test_no_more_bytes_are_kept_than_allowed(sides: list[int]) -> None:
    page, _ = drawing(4000)
    for side in sides:
        assert page(side).get_size() == (side, side)
        assert sum(picture.get_pitch() * picture.get_height() for picture in page.surfaces.values()) <= 4000


def test_what_is_asked_for_often_stays() -> None:
    page, drawn = drawing(2000)
    for side in range(1, 20):
        page(10)
        page(side)
    assert drawn.count(10) == 1


@pytest.mark.parametrize("call", [lambda page: page(5, "a"), lambda page: page(5, name="a")])
def test_other_words_are_another_picture(call) -> None:
    page, drawn = drawing(10_000)
    assert page(5) is not call(page)
    assert call(page) is call(page)
    assert drawn == [5, 5]


def test_cleared_pictures_are_drawn_again() -> None:
    page, drawn = drawing(10_000)
    page(5)
    page.cache_clear()
    page(5)
    assert drawn == [5, 5]
