"""The report in a browser: replay, keyboard, enlarged images, dark theme, print and narrow screens."""

import base64
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_run import ROOMS
from driven_browser import CHROMIUM, DRIVER, Browser
from moving_teams import build_moving_record, list_hues
from reported_results import HOSTILE, build_history, build_record, build_recorded_result, build_run
from shapely.geometry import Polygon

from robocov.conditions import Conditions
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.voronoi import partition
from robocov_app.look.axes import TICK_FACTORS, choose_value_limits
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.labels import spread_labels
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.report.document import build_report
from robocov_app.report.embedding import ReplayRun, embed_axis_rules, embed_map, embed_run
from robocov_app.report.replay import build_replay_html, read_asset
from robocov_app.report.results.result import DamagedRun

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("browser"),
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="not installed: chromium and chromedriver"),
]

SECONDS = 6.0
ENTRIES = [
    build_run(name, seed, base + 0.1 * seed)
    for seed in (0, 1)
    for name, base in (("rapf", 1.5), ("rpf", 3.0))
]

FIND_LOW_CONTRAST = """
function channels(code) { return code.match(/[\\d.]+/g).map(Number); }
function luminance(code) {
  const [r, g, b] = channels(code).slice(0, 3).map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function findBackground(element) {
  for (let e = element; e; e = e.parentElement) {
    const { backgroundColor: color } = getComputedStyle(e);
    if ((channels(color)[3] ?? 1) === 1 && color !== "transparent") return color;
  }
  return "rgb(255, 255, 255)";
}
const failures = [];
let checked = 0;
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const element = walker.currentNode.parentElement;
  const style = getComputedStyle(element);
  if (!walker.currentNode.textContent.trim() || element.closest("script, style")) continue;
  if (!element.checkVisibility({ visibilityProperty: true })) continue;
  const ink = element.ownerSVGElement ? style.fill : style.color;
  let below = findBackground(element);
  // Numbers of robots are on their discs.
  if (element.closest(".robocov-picture")) below = style.getPropertyValue("--rc-final");
  if (below.startsWith("#")) below = below.match(/[0-9a-f]{2}/g).map((x) => parseInt(x, 16)).join(",");
  const [low, high] = [luminance(ink), luminance(below)].sort((a, b) => a - b);
  checked += 1;
  if ((high + 0.05) / (low + 0.05) < 4.5) failures.push([element.outerHTML.slice(0, 120), ink, below]);
}
return [checked, failures];
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    result = replace(
        build_recorded_result([*ENTRIES, build_run("lloyd", error="it broke")], seconds=SECONDS),
        expected_count=9,
    )
    path.write_text(build_report([result]).html, encoding="utf-8")
    return path


@pytest.fixture
def opened(browser: Browser, page: Path) -> Browser:
    browser.open_file(page)
    browser.read_console()
    return browser


def test_a_page_opens_without_errors_or_requests(browser, page, tmp_path) -> None:
    browser.open_file(page)
    browser.wait_until(lambda: browser.find_all(".pane"))
    assert browser.read_console() == []
    assert browser.run_script("return performance.getEntriesByType('resource').length") == 0
    assert [box.text for box in browser.find_all(".facts strong")] == ["1.500 m", "3.000 m"]
    list_names = "return Object.getOwnPropertyNames(window)"
    names = browser.run_script(list_names)
    empty = tmp_path / "empty.html"
    empty.write_text("<!doctype html><p>nothing")
    browser.open_file(empty)
    added_names = set(names) - set(browser.run_script(list_names))
    # Names that begin with "se_" belong to the driver.
    assert not {name for name in added_names if not name.startswith("se_")}


def test_play_moves_robots_and_cursor_and_pause_stops_them(opened) -> None:
    opened.seek(0.0)
    before = opened.read_canvases()
    opened.find(".main").click()
    assert opened.is_playing
    opened.wait_until(lambda: opened.time > 1.0)
    opened.find(".main").click()
    opened.wait_until(lambda: not opened.is_playing)
    after = opened.read_canvases()
    paused_at = opened.time
    assert len(after) == 3
    assert all(old != new for old, new in zip(before, after, strict=True))
    time.sleep(0.2)
    assert opened.time == paused_at
    assert opened.read_canvases() == after


def test_playing_restarts_from_the_end(opened) -> None:
    assert opened.time == SECONDS  # The end is shown first.
    opened.find(".main").click()
    opened.wait_until(lambda: 0.0 < opened.time < SECONDS)
    opened.run_script("const list = document.querySelector('.speed select'); list.value = '16'")
    opened.wait_until(lambda: not opened.is_playing)
    assert opened.time == SECONDS
    assert opened.find(".clock").text == "6.0 / 6.0 s"


@pytest.mark.parametrize("seconds", [0.0, 2.4, 6.0])
def test_the_slider_seeks_in_all_panes(opened, seconds) -> None:
    opened.seek(seconds)
    canvas_sizes = opened.run_script(
        "return [...document.querySelectorAll('.pane > canvas')].map((c) => [c.width, c.height])"
    )
    for pane, (name, final) in enumerate((("rapf", 1.5), ("rpf", 3.0))):
        record = build_record(controller=name, seed=0, seconds=SECONDS)
        history = build_history(record, final)
        cost = np.interp(seconds, history.time, history.mean_distance)
        assert float(opened.find_all(".facts strong")[pane].text.split()[0]) == pytest.approx(cost, abs=2e-3)
        step = round(seconds * 10)
        width, height = canvas_sizes[pane]
        zoom = min((width - 4) / 16, (height - 4) / 10)
        for x, y in record.positions[step]:
            column = (width - zoom * 16) / 2 + x * zoom
            row = (height - zoom * 10) / 2 + (10 - y) * zoom
            others = np.linalg.norm(record.positions[step] - (x, y), axis=1)
            if np.sort(others)[1] * zoom > 24:  # left of the number, if no other robot is close
                assert opened.read_pixel(pane, column - 7, row) == LIGHT.final


def test_a_click_on_the_curves_seeks_to_that_time(opened) -> None:
    from selenium.webdriver import ActionChains

    chart = opened.find(".chart")
    ActionChains(opened.driver).move_to_element_with_offset(
        chart, -chart.size["width"] // 4, 0
    ).click().perform()
    first = opened.time
    ActionChains(opened.driver).move_to_element_with_offset(chart, 0, 0).click().perform()
    assert 0.5 < first < opened.time < SECONDS


def test_keys_seek_play_and_pause(opened) -> None:
    from selenium.webdriver.common.keys import Keys

    opened.run_script("document.querySelector('.stage').focus()")
    scroll_position = opened.run_script("return scrollY")
    opened.press_keys(Keys.HOME)
    assert opened.time == 0.0
    opened.press_keys(Keys.ARROW_RIGHT)
    assert opened.time == pytest.approx(0.2)
    opened.press_keys(".", ".")
    assert opened.time == pytest.approx(0.6)
    opened.press_keys(Keys.ARROW_LEFT, ",")
    assert opened.time == pytest.approx(0.2)
    opened.press_keys(" ")
    assert opened.is_playing
    opened.wait_until(lambda: opened.time > 0.5)
    opened.press_keys(" ")
    assert not opened.is_playing
    opened.press_keys(Keys.END)
    assert opened.time == SECONDS
    assert opened.run_script("return scrollY") == scroll_position
    # Keys in a list of runs do not seek.
    opened.run_script("document.querySelector('.pane select').focus()")
    opened.press_keys(".")
    assert opened.time == SECONDS


def test_the_focus_is_visible(opened) -> None:
    from selenium.webdriver.common.keys import Keys

    opened.press_keys(Keys.TAB)
    assert opened.has_focus(".skip")
    seen = set()
    for _ in range(45):
        opened.press_keys(Keys.TAB)
        name, outline = opened.run_script(
            "const e = document.activeElement; const s = getComputedStyle(e);"
            "return [e.className || e.tagName, s.outlineStyle + ' ' + s.outlineWidth]"
        )
        seen.add(name)
        assert outline == "solid 2px" or name in ("BODY", "HTML"), (name, outline)
    assert {"stage", "main"} <= seen


def test_controls_have_names(opened) -> None:
    tree = opened.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    roles: dict[str, int] = {}
    for node in tree:
        role = node.get("role", {}).get("value")
        control_roles = (
            "button",
            "checkbox",
            "combobox",
            "slider",
            "link",
            "region",
            "navigation",
            "image",
            "img",
        )
        if role in control_roles and not node["ignored"]:
            roles[role] = roles.get(role, 0) + 1
            assert node.get("name", {}).get("value"), node
    assert roles["slider"] == 1 and roles["checkbox"] == 3 and roles["combobox"] == 3
    assert roles["button"] > 10


def test_the_time_is_announced_only_when_paused(opened) -> None:
    read_announcement = "return document.querySelector('.said').textContent"
    opened.seek(3.0)
    opened.wait_until(
        lambda: opened.run_script(read_announcement).startswith(
            "At 3.0 s: RAPF: mean distance to the nearest robot"
        )
    )
    opened.run_script(
        "window.announcements = 0; new MutationObserver(() => { window.announcements += 1; })"
        ".observe(document.querySelector('.said'), {childList: true, characterData: true, subtree: true})"
    )
    # The page clicks itself: on a slow machine, the replay might end before a second click from here.
    opened.run_script(
        "const main = document.querySelector('.main'), at = document.querySelector('.transport input');"
        "const stop = () => { if (Number(at.value) < 3.1) { requestAnimationFrame(stop); return; }"
        "window.running = window.announcements; main.click(); }; main.click(); stop()"
    )
    opened.wait_until(lambda: opened.run_script("return window.announcements") == 1)
    assert opened.run_script("return window.running") == 0
    label = opened.find(".pane > canvas").get_attribute("aria-label")
    assert "RAPF" in label and "4 robots" in label and f"{opened.time:.1f} s" in label


def test_panes_are_added_changed_and_removed(opened) -> None:
    add = opened.find(".add")
    add.click()
    add.click()
    assert len(opened.find_all(".pane")) == 4 and not add.is_displayed()
    shown = opened.run_script(
        "return [...document.querySelectorAll('.pane select')].map((list) => list.value)"
    )
    assert sorted(shown) == ["0", "1", "2", "3"]
    opened.seek(3.0)
    opened.run_script(
        "const list = document.querySelector('.pane select'); list.value = '1';"
        "list.dispatchEvent(new Event('change'))"
    )
    assert opened.time == 3.0 and opened.has_focus(".pane select")
    assert opened.run_script("return document.querySelector('.pane select').value") == "1"
    for _ in range(3):
        opened.find(".remove").click()
    assert len(opened.find_all(".pane")) == 1 and not opened.find_all(".pane .remove")
    assert opened.read_console() == []


def test_an_enlarged_image_returns_the_focus_when_closed(opened) -> None:
    from selenium.webdriver.common.keys import Keys

    opened.run_script("document.querySelectorAll('.thumbnails button')[2].focus()")
    opened.press_keys(Keys.ENTER)
    dialog = opened.find("dialog")
    opened.wait_until(dialog.is_displayed)
    assert opened.has_focus("dialog .remove")
    title = opened.find("dialog h2").text
    read_image = "return document.querySelector('dialog canvas').toDataURL()"
    before = opened.run_script(read_image)
    assert opened.find("dialog canvas").size["width"] > 600
    opened.press_keys(Keys.ARROW_LEFT)
    assert opened.find("dialog h2").text != title
    assert opened.run_script(read_image) != before
    assert "Mean distance 3.000 m after 6.0 s." in opened.find("dialog .facts").text
    opened.press_keys(Keys.ESCAPE)
    opened.wait_until(lambda: not dialog.is_displayed())
    assert opened.run_script("return document.activeElement.dataset.run") == "2"


def test_the_run_of_an_enlarged_image_can_be_replayed(opened) -> None:
    opened.run_script("document.querySelectorAll('.thumbnails button')[3].click()")
    opened.find(".watch-run").click()
    opened.wait_until(lambda: len(opened.find_all(".pane")) == 3)
    assert opened.has_focus(".stage") and not opened.find("dialog").is_displayed()
    assert opened.find_all(".pane select")[2].get_property("value") == "3"


@pytest.mark.parametrize(("scheme", "theme"), [("light", LIGHT), ("dark", DARK)])
def test_colors_follow_the_preferred_scheme_and_are_legible(browser, page, scheme, theme) -> None:
    browser.open_file(page, color_scheme=scheme)
    background = browser.run_script("return getComputedStyle(document.documentElement).backgroundColor")
    assert background == f"rgb({', '.join(map(str, theme.background))})"
    checked, failures = browser.run_script(FIND_LOW_CONTRAST)
    assert checked > 150
    assert failures == []
    # A change of the preference takes effect at once, on canvases as well.
    other = {"light": "dark", "dark": "light"}[scheme]
    before = browser.read_canvases()
    browser.set_preferences(color_scheme=other)
    browser.wait_until(lambda: browser.read_canvases() != before)


def test_controls_are_not_printed(browser, page) -> None:
    browser.open_file(page, color_scheme="dark")
    pdf = browser.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})
    content = base64.b64decode(pdf["data"])
    assert content.startswith(b"%PDF")
    pages = content.count(b"/Type /Page\n") + content.count(b"/Type /Page ")
    assert 1 <= pages <= 12
    browser.set_preferences("print", color_scheme="dark")
    shown = browser.run_script(
        "return ['.live', '.stills', 'nav', '.keys']"
        ".map((name) => document.querySelector(name).checkVisibility())"
    )
    assert shown == [False, True, False, False]
    checked, failures = browser.run_script(FIND_LOW_CONTRAST)
    assert checked > 100
    assert failures == []
    browser.set_preferences()


@pytest.mark.parametrize("width", [360, 390, 768, 1920])
def test_no_element_overflows_at_any_width(browser, page, width) -> None:
    browser.open_file(page, width, 844)
    browser.wait_until(lambda: browser.find_all(".pane"))
    assert browser.run_script("return document.documentElement.scrollWidth") <= width
    browser.run_script("document.querySelector('.thumbnails button').click()")
    left, right, canvas_left, canvas_right = browser.run_script(
        "const box = document.querySelector('dialog').getBoundingClientRect();"
        "const canvas = document.querySelector('dialog canvas').getBoundingClientRect();"
        "return [box.left, box.right, canvas.left - box.left, box.right - canvas.right]"
    )
    assert left >= 0
    assert right <= width
    assert canvas_left >= 0
    assert canvas_right >= 0
    assert browser.read_console() == []


def test_reduced_motion_is_respected(browser, page) -> None:
    browser.open_file(page, reduced_motion="reduce")
    browser.run_script(
        "window.seen = new Set(); const slider = document.querySelector('.transport input');"
        "const look = () => { window.seen.add(slider.value); requestAnimationFrame(look); }; look()"
    )
    browser.seek(0.0)
    browser.find(".main").click()
    browser.wait_until(lambda: browser.time == SECONDS)
    assert 3 <= browser.run_script("return window.seen.size") <= 8


def test_hostile_names_have_no_effect(browser, tmp_path) -> None:
    entries = [replace(build_run(HOSTILE, seed, map_name=HOSTILE), label=HOSTILE) for seed in range(2)]
    path = tmp_path / "hostile.html"
    path.write_text(
        build_report([build_recorded_result(entries, replace(ROOMS, name=HOSTILE), seconds=2.0)]).html,
        encoding="utf-8",
    )
    browser.open_file(path)
    browser.find(".add").click()
    browser.run_script("document.querySelector('.thumbnails button').click()")
    assert browser.read_console() == [] and not browser.find_all("img")
    assert browser.find("dialog h2").text.startswith("</script>")


def test_replays_in_one_notebook_are_independent(browser, tmp_path) -> None:
    runs = [ReplayRun(build_record(seed=k, seconds=2.0), None, f"run {k}") for k in range(2)]
    cells = "".join(f"<section>{build_replay_html([run])}</section>" for run in runs)
    path = tmp_path / "notebook.html"
    path.write_text(
        f'<!doctype html><meta charset="utf-8"><body data-jp-theme-light="false">{cells}', "utf-8"
    )
    browser.open_file(path)
    assert browser.read_console() == []
    assert [each.text for each in browser.find_all(".head strong")] == ["run 0", "run 1"]
    background = browser.run_script(
        "return getComputedStyle(document.querySelector('.robocov-replay')).backgroundColor"
    )
    assert background == f"rgb({', '.join(map(str, DARK.background))})"
    before = browser.read_canvases()
    browser.seek(0.0)
    after = browser.read_canvases()
    assert before[0] != after[0]
    assert before[2:] == after[2:]  # Only the first replay seeks.
    assert not browser.find_all(".chart")[0].is_displayed()  # Without a cost there are no curves.


@pytest.mark.parametrize("robots", [1, 2, 5, 40])
def test_cells_are_voronoi_cells(browser, robots) -> None:
    record = build_record(robots=robots, seed=robots)
    positions = record.positions[0]
    if robots == 5:
        positions[4] = positions[3]  # Two robots at one position share a cell.
    script = read_asset("arena.js") + (
        "const [region, positions] = arguments;"
        "return Array.from({length: positions.length / 2}, (_, i) => cellOf(region, positions, i))"
    )
    cells = browser.run_script(script, ROOMS.region.vertices.ravel().tolist(), positions.ravel().tolist())
    expected = partition(positions, ROOMS.region)
    polygons = [Polygon(np.array(cell).reshape(-1, 2)) for cell in cells]
    areas = [polygon.area for polygon in polygons]
    centroids = [(polygon.centroid.x, polygon.centroid.y) for polygon in polygons]
    np.testing.assert_allclose(areas, expected.masses, rtol=1e-9)
    np.testing.assert_allclose(centroids, expected.centroids, rtol=1e-9)


@pytest.mark.parametrize("repeat", ["loop", "back-and-forth"])
def test_obstacles_have_their_positions_in_the_run(browser, repeat) -> None:
    path = ObstaclePath(((1.0, 1.0), (4.0, 1.0), (4.0, 3.0)), 0.7, repeat)
    cart = CircleObstacle((1.0, 1.0), 0.3, path=path)
    (mover,) = embed_map(replace(ROOMS, obstacles=(cart,)))["movingObstacles"]
    mover["line"] = [0.001 * value for value in mover["line"]]
    for seconds in (0.0, 1.0, 4.5, 7.3, 20.0, 1234.5):
        shift = browser.run_script(read_asset("data.js") + "return shiftOf(...arguments)", mover, seconds)
        assert shift == pytest.approx(path.compute_displacement(seconds).tolist(), abs=1e-6)


def test_robots_that_fail_are_crossed_out_and_late_robots_appear(browser, tmp_path) -> None:
    record = replace(build_record(), conditions=Conditions(failures=((2, 2.0),), joins=((3, 4.0),)))
    page = tmp_path / "replay.html"
    run = ReplayRun(record, build_history(record, 2.0), "a run")
    page.write_text(f"<!doctype html><main>{build_replay_html([run])}</main>", encoding="utf-8")
    browser.open_file(page)
    browser.wait_until(lambda: browser.find_all(".chart"))
    notes = []
    for seconds in (1.0, 3.0, 5.0):
        browser.seek(seconds)
        notes.append(browser.find(".facts").text.partition(" m ")[2])
    assert notes == ["mean distance", "mean distance, robot 2 failed", "mean distance, robot 2 failed"]
    script = (
        read_asset("data.js")
        + "const [data, times] = arguments; const run = new Run(data, new ArenaMap(data.plan, () => {}));"
        + "return [times.map((time) => run.statesAt(time)), run.events.map(({said}) => said)]"
    )
    data = embed_run(run, 0, choose_controller_styles(["rapf"])["rapf"], 5.0, include_goals=True)
    states, events = browser.run_script(script, {**data, "plan": embed_map(ROOMS)}, [0.0, 2.0, 3.9, 4.0])
    assert states == [[1, 1, 0, 1], [1, 2, 0, 1], [1, 2, 0, 1], [1, 2, 1, 1]]
    assert events == ["robot 2 fails", "robot 3 joins"]
    assert browser.read_console() == []


def test_labels_of_curves_have_the_positions_of_figures(browser) -> None:
    script = read_asset("arena.js") + read_asset("chart.js") + "return spreadLabels(...arguments)"
    rng = np.random.default_rng(2)
    for count in (1, 2, 4, 7, 12):
        heights = rng.uniform(0.0, 120.0, count).tolist()
        assert browser.run_script(script, heights, 15, 0, 150) == pytest.approx(
            spread_labels(heights, 15, 0, 150)
        )


@pytest.mark.parametrize(
    ("low", "high"), [(2.0, 6.0), (2.3, 6.0), (2.4, 6.0), (5.0, 6.0), (3.0, 3.0), (0.0, 0.0)]
)
def test_axes_of_curves_are_those_of_figures(browser, low, high) -> None:
    script = read_asset("arena.js") + read_asset("chart.js") + "return limitsOf(...arguments)"
    limits = browser.run_script(
        script, [{"end": 4.0, "range": {"low": low, "high": high}}], embed_axis_rules()
    )
    assert (limits["low"], limits["high"]) == pytest.approx(choose_value_limits(low, high))
    assert limits["end"] == 4.0


@pytest.mark.parametrize("robots", [12, 20, 30])
def test_the_page_has_the_hues_of_the_data(browser, robots) -> None:
    record = build_moving_record(robots)
    run = ReplayRun(record, None, "a run")
    data = embed_run(run, 0, choose_controller_styles(["rapf"])["rapf"], 5.0, include_goals=False)
    script = (
        read_asset("data.js")
        + "const [data, times] = arguments; const run = new Run(data, new ArenaMap(data.plan, () => {}));"
        + "return times.map((time) => run.huesAt(time))"
    )
    frames = [0, 1, data["count"] // 2, data["count"] - 1]
    times = [min(frame * data["step"], data["end"]) for frame in frames]
    shown = browser.run_script(script, {**data, "plan": embed_map(record.environment)}, times)
    assert shown == list_hues(data["hues"], frames)


ULP = float(np.spacing(2.0))


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 60.0, [0, 20, 40, 60]),
        (-0.0, 1.0, [0, 0.2, 0.4, 0.6, 0.8, 1]),
        (-3.0, -1.0, [-3, -2.5, -2, -1.5, -1]),
        *((low, high, []) for low, high in ((2.0, 2.0 + ULP), (2.0, 2.0), (-1e308, 1e308), (3.0, 1.0))),
        (0.0, 1e300, [k * 2e299 for k in range(6)]),
    ],
)
def test_axes_have_round_ticks(browser, low, high, expected) -> None:
    script = read_asset("arena.js") + read_asset("chart.js") + "return roundTicks(...arguments)"
    assert browser.run_script(script, low, high, 5, TICK_FACTORS) == pytest.approx(expected)


@pytest.mark.parametrize("values", [(2.0, 2.0 + ULP), (2.0, 2.0), (-0.0, 0.0), (1e-3, 1e300), (np.nan, 2.0)])
def test_curves_with_extreme_values_do_not_stop_the_page(browser, tmp_path, values) -> None:
    result = build_recorded_result([build_run(), build_run("rpf")], seconds=2.0)
    for folder, saved in result.loaded.items():
        time = saved.history.time
        distance = np.where(np.arange(len(time)) % 2, *values)
        result.loaded[folder] = saved._replace(history=replace(saved.history, mean_distance=distance))
    path = tmp_path / "page.html"
    path.write_text(build_report([result]).html, encoding="utf-8")
    browser.open_file(path)
    browser.wait_until(lambda: browser.find_all(".pane"))
    browser.seek(1.0)
    assert browser.read_console() == []
    assert len(browser.read_canvases()) == 3


@pytest.mark.parametrize("width", [390, 1280])
def test_long_names_do_not_widen_the_page(browser, tmp_path, width) -> None:
    name = "W" * 300
    runs = [
        replace(
            build_run(controller, seed, 2.0, map_name=f"{name}{m}", start=name, gains=((name, 1.0 + seed),)),
            label=controller,
        )
        for controller in (f"{name}1", f"{name}2")
        for m in range(2)
        for seed in range(3)
    ]
    failed = replace(runs[0], error=f"{name} {name}", metrics={}, seed=9)
    result = replace(
        build_recorded_result(runs, replace(ROOMS, name=name), seconds=2.0),
        gain_units={name: name},
        gain_meanings={name: name},
    )
    result = replace(result, runs=(*result.runs, failed), damaged_runs=(DamagedRun(name, name),))
    path = tmp_path / "names.html"
    path.write_text(build_report([result], title=name).html, encoding="utf-8")
    browser.open_file(path, width, 844)
    browser.wait_until(lambda: browser.find_all(".pane"))
    browser.run_script("for (const details of document.querySelectorAll('details')) details.open = true")
    outside = browser.run_script(
        "return [...document.body.querySelectorAll('*')].filter((e) => e.checkVisibility()"
        " && !e.closest('.scroll, .skip') && !e.matches('option'))"
        ".filter((e) => { const { left, right } = e.getBoundingClientRect();"
        " return left < -1 || right > innerWidth + 1; }).map((e) => e.outerHTML.slice(0, 80))"
    )
    assert outside == [] and browser.run_script("return document.documentElement.scrollWidth") <= width
    assert browser.find("h1 .cut").get_attribute("title") == name
    assert browser.find("h1").text == f"{name[:27]}…{name[:12]}"
    browser.run_script("document.querySelector('.thumbnails button').click()")
    assert browser.run_script("return document.querySelector('dialog').scrollWidth") <= width
