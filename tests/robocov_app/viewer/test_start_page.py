"""The start page: examples, maps and recent sessions, before the viewer is loaded."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest
from driven_window import build_key_event
from sample_sessions import start_session

from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.commands import demo
from robocov_app.commands.demo import Arguments
from robocov_app.look.theme import DARK
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFT_FOLDER_VARIABLE
from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.window.display import REDUCED_MOTION_VARIABLE, open_display
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.session.files.workspace import SessionWorkspace
from robocov_app.viewer.start.cards import START_CARDS, StartChoice, Target, choose_map, choose_session
from robocov_app.viewer.start.page import ANIMATION_S, StartPage
from robocov_app.viewer.start.previews import RunPreview, fit_outline, load_previews
from robocov_app.viewer.start.recording import RECORDED_RUNS, record_outline
from robocov_app.viewer.start.sketch import DRAWING_S, draw_sketch
from robocov_app.viewer.window.window import ViewerWindow

SIZES = ((900, 600), (1280, 720), (1920, 1080))


@contextmanager
def open_page(
    size: tuple[int, int] = (900, 600),
    recent: list[Path] | None = None,
    can_open_viewer: Callable[[], bool] = lambda: True,
) -> Iterator[StartPage]:
    with open_display(headless=True):
        page = StartPage(size, 1.0, recent=recent or [], can_open_viewer=can_open_viewer)
        page.guard.is_enabled = False
        yield page


def press(page: StartPage, *names: str) -> None:
    for name in names:
        attributes = build_key_event(name)
        for kind in (pygame.KEYDOWN, pygame.KEYUP):
            pygame.event.post(pygame.event.Event(kind, **attributes))
        page.run_frame(0.02)


def click(page: StartPage, name: str) -> None:
    item = next(item for item in page.focus.items if item.name == name)
    pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=item.box.center, rel=(0, 0), buttons=()))
    pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=item.box.center, button=1))
    page.run_frame(0.02)


def test_the_page_is_shown_only_without_a_map_and_options() -> None:
    assert Arguments().shows_start_page
    assert Arguments(theme="dark", size="900x600").shows_start_page
    assert not Arguments(map="rooms").shows_start_page
    assert not Arguments(robots=3).shows_start_page
    assert not Arguments(tour=True).shows_start_page
    assert not Arguments(serve=True).shows_start_page


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("has_recent", [False, True])
def test_everything_is_inside_the_window_and_nothing_overlaps(
    size: tuple[int, int], has_recent: bool, tmp_path: Path
) -> None:
    recent = [tmp_path / f"{number}.robocov" for number in range(9)] if has_recent else []
    with open_page(size, recent) as page:
        boxes = [item.box for item in page.focus.items]
        assert all(page.screen.get_rect().contains(box) for box in boxes)
        assert not any(first.colliderect(second) for first, second in itertools.combinations(boxes, 2))
        assert len([item for item in page.focus.items if item.name.startswith("card:")]) == 6
        assert any(item.name.startswith("recent:") for item in page.focus.items) == has_recent


@pytest.mark.parametrize("number", range(1, 7))
def test_a_card_is_chosen_by_its_key_and_by_a_click(number: int) -> None:
    for choose in (lambda page: press(page, str(number)), lambda page: click(page, f"card:{number}")):
        with open_page() as page:
            choose(page)
            assert page.choice is START_CARDS[number - 1].choice
            assert page.closed


def test_cards_and_maps_are_reached_by_tab_arrows_and_enter() -> None:
    with open_page() as page:
        press(page, "tab")
        assert page.focus.name == "card:1"
        press(page, "right", "down")
        assert page.focus.name == "card:5"
        press(page, "down")
        name = page.focus.name.removeprefix("map:")
        press(page, "return")
        assert name in list_bundled_maps()
        assert page.choice == choose_map(name)


def test_all_maps_are_reached_by_the_arrows_next_to_the_thumbnails() -> None:
    with open_page() as page:
        seen = set()
        for _ in range(len(list_bundled_maps())):
            seen |= {item.name for item in page.focus.items if item.name.startswith("map:")}
            click(page, "maps:on")
        assert {f"map:{name}" for name in list_bundled_maps()} <= seen


def test_the_wheel_scrolls_the_maps_unless_it_turns_sideways() -> None:
    with open_page() as page:

        def list_maps_after_wheel(x: int, y: int) -> list[str]:
            pygame.event.post(pygame.event.Event(pygame.MOUSEWHEEL, x=x, y=y, precise_x=x, precise_y=y))
            page.run_frame(0.02)
            return [item.name for item in page.focus.items if item.name.startswith("map:")]

        first = list_maps_after_wheel(0, 1)
        assert list_maps_after_wheel(1, 0) == first
        second = list_maps_after_wheel(0, -1)
        assert second != first
        assert list_maps_after_wheel(-1, 0) == second
        assert list_maps_after_wheel(0, 1) == first


def test_a_recent_session_is_opened_and_a_missing_one_reported(tmp_path: Path) -> None:
    session = tmp_path / "class.robocov"
    session.write_text("{}")
    with open_page(recent=[session, tmp_path / "gone.robocov"]) as page:
        click(page, "recent:1")
        assert page.choice is None
        assert page.model.has_error_message
        click(page, "recent:0")
        assert page.choice == choose_session(session)


def test_a_file_that_cannot_be_opened_is_reported(tmp_path: Path) -> None:
    with open_page() as page:
        pygame.event.post(pygame.event.Event(pygame.DROPFILE, file=str(tmp_path / "essay.docx")))
        page.run_frame(0.02)
        assert page.model.message.startswith("essay.docx: expected a session (.robocov) or a map (.json)")
        press(page, "ctrl+o")
        assert page.dialogs.current is not None


def test_the_page_stays_usable_until_the_viewer_is_ready() -> None:
    is_ready = False
    with open_page(can_open_viewer=lambda: is_ready) as page:
        press(page, "2")
        before = pygame.surfarray.array3d(page.screen)
        assert not page.closed
        press(page, "escape")
        assert page.choice is None, "the choice is given up"
        assert not np.array_equal(before, pygame.surfarray.array3d(page.screen))
        press(page, "3")
        is_ready = True
        page.run_frame(0.02)
        assert page.closed
        assert page.choice is START_CARDS[2].choice
    with open_page(can_open_viewer=lambda: False) as page:
        press(page, "2")
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        page.run_frame(0.02)
        assert page.closed
        assert page.choice is None


def test_theme_and_help_have_keys_and_buttons() -> None:
    with open_page() as page:
        press(page, "t")
        assert page.theme_name == "dark"
        click(page, "theme")
        assert page.theme_name == "light"
        press(page, "f1")
        assert page.help_page.is_open
        press(page, "escape")
        assert not page.help_page.is_open
        click(page, "help")
        assert page.help_page.is_open


def test_examples_move_and_rest_after_a_while() -> None:
    with open_page() as page:
        first = pygame.surfarray.array3d(page.screen)
        page.run_frame(1.0)
        assert not np.array_equal(first, pygame.surfarray.array3d(page.screen))
        page.run_frame(ANIMATION_S)
        rest = page.build_frame_key()
        page.run_frame(5.0)
        assert page.build_frame_key() == rest


def test_examples_stand_still_with_reduced_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(REDUCED_MOTION_VARIABLE, "1")
    with open_page() as page:
        page.run_frame(0.1)
        key = page.build_frame_key()
        page.run_frame(1.0)
        assert page.build_frame_key() == key


def test_outlines_are_those_of_the_bundled_maps() -> None:
    outlines = load_previews().outlines
    assert list(outlines) == list(list_bundled_maps())
    for name, outline in outlines.items():
        expected = record_outline(load_map(name))
        assert len(outline.rings) == len(expected)
        for ring, ring_before in zip(expected, outline.rings, strict=True):
            assert np.abs(ring - ring_before).max() <= 0.0051, f"{name}: run the recording again"


def test_every_card_has_its_previews_and_can_be_built() -> None:
    recorded = {run.name for run in RECORDED_RUNS}
    assert set(load_previews().runs) == recorded
    for card in START_CARDS:
        assert set(card.previews) <= recorded
        options = Arguments(**card.choice.options)
        assert not card.choice.options or demo.build_session(options).timeline.panes


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[ViewerWindow]:
    """Close windows immediately, and return those that were opened."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    windows: list[ViewerWindow] = []

    def run(window: ViewerWindow) -> None:
        window.run_frame(0.02)
        assert window.screen.get_size() == pygame.display.get_window_size()
        windows.append(window)

    monkeypatch.setattr(ViewerWindow, "run", run)
    return windows


def choose_in_turn(monkeypatch: pytest.MonkeyPatch, *choices: StartChoice | None) -> list[str]:
    """Let the start page make these choices, and return the messages that it shows."""
    remaining = list(choices)
    messages: list[str] = []

    def run(page: StartPage) -> None:
        messages.append(page.model.message)
        page.choice = remaining.pop(0)

    monkeypatch.setattr(StartPage, "run", run)
    return messages


def test_the_chosen_example_is_opened(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, opened: list[ViewerWindow]
) -> None:
    for card in (START_CARDS[3], START_CARDS[5]):
        choose_in_turn(monkeypatch, card.choice)
        assert demo.command(Arguments(folder=tmp_path, size="1000x700")) == 0
    comparison, lesson = opened
    assert comparison.viewer.session.displayed.environment.name == "Blocks A"
    assert len(comparison.viewer.session.timeline.panes) == 3
    assert comparison.layout.size == (1000, 700)
    assert comparison.dialogs.current is None, "the page has offered the lesson already"
    assert lesson.lesson.player is not None


def test_the_editor_is_opened_to_draw_a_map(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, opened: list[ViewerWindow]
) -> None:
    from robocov_app.editor.ui.window import EditorWindow

    runs: list[str] = []
    monkeypatch.setattr(EditorWindow, "run", lambda window: runs.append("editor"))
    (choice,) = [card.choice for card in START_CARDS if card.choice.target is Target.EDITOR]
    choose_in_turn(monkeypatch, choice)
    assert demo.command(Arguments(folder=tmp_path)) == 0
    assert runs == ["editor"]
    assert not opened


def test_a_session_that_cannot_be_opened_leads_back_to_the_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, opened: list[ViewerWindow]
) -> None:
    broken = tmp_path / "broken.robocov"
    broken.write_text("no session")
    messages = choose_in_turn(monkeypatch, choose_session(broken), None)
    assert demo.command(Arguments(folder=tmp_path)) == 0
    assert not opened
    assert "broken.robocov" in messages[1]


def leave_draft(folder: Path, number: int) -> None:
    """Leave the draft of a session in which a robot has failed, as a process that was killed."""
    session = start_session()
    workspace = SessionWorkspace(session, folder)
    session.fail_robot(number)
    workspace.save_draft({}, at_once=True)
    workspace.close()


@pytest.fixture
def drafts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Return the folder for drafts."""
    folder = tmp_path / "drafts"
    monkeypatch.setenv(DRAFT_FOLDER_VARIABLE, str(folder))
    return folder


def answer_recovery(monkeypatch: pytest.MonkeyPatch, *answers: str, then: StartChoice | None = None) -> None:
    """Let the user of the start page press these keys, and then choose something, unless a key has."""

    def run(page: StartPage) -> None:
        for answer in answers:
            assert page.dialogs.current is not None
            assert page.dialogs.current.title == "Recover unsaved work?"
            press(page, answer)
        assert page.dialogs.current is None
        if page.choice is None:
            page.choice = then

    monkeypatch.setattr(StartPage, "run", run)


def test_unsaved_work_is_recovered_from_the_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, drafts: Path, opened: list[ViewerWindow]
) -> None:
    leave_draft(drafts, 2)
    answer_recovery(monkeypatch, "r")
    assert demo.command(Arguments(folder=tmp_path)) == 0
    (window,) = opened
    assert window.viewer.session.displayed.numbers == (1, 3)
    assert window.viewer.files.workspace.has_unsaved_edits
    assert window.dialogs.current is None


def test_unsaved_work_that_is_postponed_on_the_page_is_offered_at_the_next_start_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, drafts: Path, opened: list[ViewerWindow]
) -> None:
    leave_draft(drafts, 2)
    answer_recovery(monkeypatch, "l", then=START_CARDS[0].choice)
    assert demo.command(Arguments(folder=tmp_path)) == 0
    (window,) = opened
    assert window.dialogs.current is None
    assert len(find_recoverable_drafts(drafts)) == 1


def test_the_page_offers_the_next_draft_when_one_is_discarded(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, drafts: Path, opened: list[ViewerWindow]
) -> None:
    leave_draft(drafts, 2)
    leave_draft(drafts, 3)
    answer_recovery(monkeypatch, "d", "d")
    assert demo.command(Arguments(folder=tmp_path)) == 0
    assert not opened
    assert find_recoverable_drafts(drafts) == ()


def test_the_page_loads_neither_the_simulation_nor_the_compiler() -> None:
    script = (
        "import sys, robocov_app.commands.demo, robocov_app.viewer.start.launch;"
        "heavy = {'numba', 'scipy', 'pymunk', 'matplotlib', 'robocov.controllers', 'robocov.simulation'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


MAX_COLOR_DIFFERENCE = 20


def count_pencil_pixels(seconds: float) -> int:
    """Return the number of pixels in the color of the pencil while the preview of the editor is drawn."""
    screen = pygame.Surface((190, 120), 0, 32)
    screen.fill(DARK.background)
    draw_sketch(screen, screen.get_rect(), DARK, 1.0, seconds=seconds)
    differences = np.abs(pygame.surfarray.array3d(screen).astype(int) - DARK.accent).max(axis=2)
    return int((differences < MAX_COLOR_DIFFERENCE).sum())


def test_the_pencil_is_never_cut_off() -> None:
    counts = [count_pencil_pixels(seconds) for seconds in np.linspace(0.0, 0.98 * DRAWING_S, 30)]
    assert min(counts) > 0.85 * max(counts)


def test_badges_cover_no_preview(monkeypatch: pytest.MonkeyPatch) -> None:
    previews: list[pygame.Rect] = []
    badges: list[pygame.Rect] = []

    def record_preview(
        screen: pygame.Surface, run: RunPreview, box: pygame.Rect, *args: Any, **kwargs: Any
    ) -> None:
        previews.append(fit_outline(run.outline, box))

    def record_badge(screen: pygame.Surface, box: pygame.Rect, *args: Any, **kwargs: Any) -> None:
        badges.append(box)

    monkeypatch.setattr("robocov_app.viewer.start.card_section.draw_run", record_preview)
    monkeypatch.setattr("robocov_app.viewer.start.card_section.draw_rounded_box", record_badge)
    with open_page(size=(900, 600)) as page:
        page.run_frame(0.0)
    assert previews
    assert badges
    assert not any(preview.collidelist(badges) >= 0 for preview in previews)
