"""The guided tour: what it names exists, it is as long as it says, and it leaves the desk as it was."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from driven_window import Driver, opened
from touched_run import RAPF, begun

from robocov.controllers import controller_kinds
from robocov.mapfile import bundled_maps, load_map
from robocov_app.render.picture import pane_layers, standard_layers
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import Desk
from robocov_app.viewer.session.scenario import MOST_PANES, Limits
from robocov_app.viewer.tour import _PLAIN, CHAPTERS, Chapter, Tour

LAYERS = {layer.name for layer in (*standard_layers(), *pane_layers())}
SHORT = tuple(
    Chapter(f"chapter {k}", "One. Two.", 2.0, "square", "corner", (RAPF,), 1.0, then={1.0: done})
    for k, done in enumerate(
        (lambda desk: desk.session.fail_robot(2), lambda desk: desk.session.add_robot((5, 5)))
    )
)


def desk_of(**changes) -> Desk:
    return Desk(begun(**changes), Costs(4, direct=True), {"cells", "robots"}, Path(), "hall")


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.title)
def test_what_a_chapter_names_exists(chapter: Chapter) -> None:
    assert chapter.map in bundled_maps()
    assert chapter.start in load_map(chapter.map).starts
    assert 1 <= len(chapter.laws) <= MOST_PANES
    for law in chapter.laws:
        assert law.name in controller_kinds()
        law.made()
    assert chapter.also <= LAYERS and LAYERS >= _PLAIN
    assert chapter.asks is None or 1 <= chapter.asks <= 6
    assert all(0.0 < time < chapter.seconds for time in chapter.then)
    assert 0.1 <= chapter.speed <= 16.0


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.title)
def test_a_chapter_says_two_or_three_sentences_and_leaves_time_to_read_them(chapter: Chapter) -> None:
    assert len(re.findall(r"[.!?](?= |$)", chapter.text)) in (2, 3)
    assert chapter.text.endswith(".") and "  " not in chapter.text
    assert len(chapter.title) <= 44 and not chapter.title.endswith(".")
    words = len(chapter.text.split())
    assert words / chapter.seconds < 3.0  # so fast do people read, and they are to watch too


def test_the_whole_tour_is_about_three_minutes_and_a_half() -> None:
    assert 150.0 <= sum(chapter.seconds for chapter in CHAPTERS) <= 240.0
    assert len({chapter.title for chapter in CHAPTERS}) == len(CHAPTERS)


def test_chapters_follow_each_other_and_what_is_to_happen_happens() -> None:
    desk = desk_of()
    tour = Tour(desk, lambda: None, SHORT)
    assert tour.title.endswith("chapter 0") and tour.progress == 0.0 and tour.seconds == 4.0
    assert desk.map_name == "square" and desk.session.playing
    assert len(desk.session.numbers) == 6
    tour.advance(1.1)
    assert desk.session.numbers == (1, 3, 4, 5, 6) and tour.progress == pytest.approx(1.1 / 4)
    tour.advance(1.0)
    assert tour.title.endswith("chapter 1") and desk.session.numbers == (1, 2, 3, 4, 5, 6)
    tour.advance(1.5)
    assert desk.session.numbers[-1] == 7 and not tour.done
    tour.advance(1.0)
    assert tour.done
    tour.advance(1.0)
    assert tour.done and tour.title.endswith("chapter 1")


def test_the_end_gives_back_layers_and_speed() -> None:
    desk = desk_of()
    desk.set_speed(0.5)
    tour = Tour(desk, lambda: None)
    tour.advance(30.0)
    assert desk.shown != {"cells", "robots"}
    version = desk.version
    tour.end()
    assert desk.shown == {"cells", "robots"} and desk.session.clock.speed == 0.5
    assert desk.version > version and tour.done


def test_the_tour_shows_the_whole_map_at_every_chapter() -> None:
    shown: list[str] = []
    desk = desk_of()
    tour = Tour(desk, lambda: shown.append(desk.map_name))
    for chapter in CHAPTERS:
        tour.advance(chapter.seconds)
    assert shown == [chapter.map for chapter in CHAPTERS]


def test_the_tour_is_of_the_usual_robots_whatever_was_set_before() -> None:
    desk = desk_of(robots=1)
    desk.command("radius 0.5")
    desk.command("max_speed 0.1")
    tour = Tour(desk, lambda: None)
    for chapter in CHAPTERS:
        assert desk.lane.circumstances.limits == Limits()
        tour.advance(chapter.seconds)
    assert tour.done


def test_skipping_goes_both_ways_and_past_the_last_to_the_end() -> None:
    tour = Tour(desk_of(), lambda: None)
    tour.skip(1)
    tour.skip(1)
    assert tour.title.startswith("3 ")
    tour.skip(-1)
    assert tour.title.startswith("2 ")
    tour.skip(-1)
    tour.skip(-1)
    assert tour.title.startswith("1 ")
    for _ in CHAPTERS:
        tour.skip(1)
    assert tour.done


def test_all_of_it_plays_in_the_window(tmp_path: Path) -> None:
    with opened(tmp_path, lattice=8) as driver:
        driver.key("f2")
        played = play_through(driver)
        assert played == [f"{k + 1}  {chapter.title}" for k, chapter in enumerate(CHAPTERS)]
        assert driver.window.tour is None and not driver.desk.trouble
        lane = driver.session.lanes[0]
        assert np.isfinite(lane.simulation.positions).all()


def play_through(driver: Driver) -> list[str]:
    """Let the tour play in long frames; return the titles of what was seen."""
    titles: list[str] = []
    driver.session.clock.budget = 0.02
    while driver.window.tour is not None:
        if driver.window.tour.title not in titles:
            titles.append(driver.window.tour.title)
            driver.window.frame(0.0)
        driver.window.advance(0.7)
        assert not driver.desk.trouble, driver.desk.message
    return titles
