"""The page as a whole: sections, size, accessibility, and escaping of hostile names."""

import hashlib
import json
import re
from base64 import b64encode
from dataclasses import replace
from html import unescape

import pytest
from drawn_run import HALL, ROOMS
from reported_results import HOSTILE, Page, build_recorded_result, build_result, build_run

from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import ParameterError
from robocov.files.result_folder import is_report
from robocov.text import escape_controls
from robocov_app.look.curve_styles import MARKER_PATHS
from robocov_app.report.document import MAX_WORD_CHARS, build_report
from robocov_app.report.results.result import DamagedRun
from robocov_app.runs.saved_runs import SavedRun

MAX_PAGE_BYTES = 3_000_000
SWEEP = [
    build_run(
        name, seed, base + 0.2 * seed + 0.3 * k, gains=(("k_rep", k), ("limit", None if k > 1 else 2.0))
    )
    for seed in range(5)
    for name, base in (("rapf", 1.0), ("rpf", 2.0))
    for k in (0.1, 1.0, 3.0)
]


@pytest.fixture(scope="module")
def html() -> str:
    """Build the page of a sweep with several gains, failed runs and missing runs."""
    return build_report(
        [replace(build_recorded_result([*SWEEP, build_run("mine", error=HOSTILE)]), expected_count=40)]
    ).html


def test_the_page_is_well_formed_and_its_ids_are_unique(html) -> None:
    page = Page(html)
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in page.elements:
        for name in ("aria-labelledby", "aria-describedby", "for"):
            assert attributes.get(name) is None or attributes[name] in ids
        if (attributes.get("href") or "").startswith("#"):
            assert attributes["href"][1:] in ids


def test_the_page_has_landmarks_headings_and_a_skip_link(html) -> None:
    page = Page(html)
    for tag in ("header", "nav", "main", "footer", "h1", "title"):
        assert len(page.find_all(tag)) == 1, tag
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and set(levels[1:]) == {2}
    skip = next(each for each in page.find_all("a"))
    assert skip == {"class": "skip", "href": "#content"}
    for section in page.find_all("section"):
        assert "aria-label" in section or "aria-labelledby" in section


def test_all_images_and_plots_are_described(html) -> None:
    page = Page(html)
    images = page.find_all("svg")
    assert len(images) > 30
    for each in images:
        hidden = each.get("aria-hidden") == "true"
        assert hidden or (each.get("role") == "img" and len(each.get("aria-label") or "") > 20)
    descriptions = " ".join(each.get("aria-label") or "" for each in images)
    for number in (
        "1.430 m at the end (median of 5 runs, quartiles 1.230 to 1.630)",
        "medians at 0.1: 1.430",
    ):
        assert number in descriptions, number
    for button in page.find_all("button"):
        assert "Open large." in button["aria-label"] and "final mean distance" in button["aria-label"]
    assert not page.find_all("img")
    assert not page.find_all("canvas"), "canvases are created by the script"


def test_tables_have_captions_and_scopes(html) -> None:
    page = Page(html)
    assert len(page.find_all("table")) == len(page.find_all("caption")) >= 5
    assert {each.get("scope") for each in page.find_all("th")} == {"col", "row"}


def test_the_page_needs_no_network(html) -> None:
    assert not re.findall(r"(?:https?:)?//[\w.-]+\.\w|@import|url\((?!#)", unescape(html))
    page = Page(html)
    for _, attributes in page.elements:
        for name in ("src", "srcset", "action", "data", "poster"):
            assert name not in attributes
        assert (attributes.get("href") or "#").startswith("#")
        assert not [name for name in attributes if name.startswith("on")]
    (policy,) = [each["content"] for each in page.find_all("meta") if "http-equiv" in each]
    assert "default-src 'none'" in policy
    (script,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy and "unsafe-eval" not in policy


def test_hostile_names_are_escaped() -> None:
    runs = [
        replace(
            build_run(HOSTILE, seed, 2.0 + seed, map_name=HOSTILE, gains=((HOSTILE, 1.0 + seed),)),
            label=HOSTILE,
        )
        for seed in range(3)
    ]
    runs.append(replace(runs[0], error=HOSTILE, metrics={}, start=HOSTILE, seed=9))
    result = build_recorded_result(runs, replace(ROOMS, name=HOSTILE))
    result = replace(result, gain_units={HOSTILE: HOSTILE}, gain_meanings={HOSTILE: HOSTILE})
    html = build_report([result], title=HOSTILE).html
    page = Page(html)
    assert not page.find_all("img")
    assert [each.get("type") for each in page.find_all("script")] == ["application/json", None]
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])
    assert data["maps"][0]["name"] == escape_controls(HOSTILE)
    assert escape_controls(HOSTILE) in data["runs"][0]["title"]
    assert escape_controls(HOSTILE) in "".join(page.texts)
    assert "{{7*7}}" in "".join(page.texts)
    assert not re.findall(r"\b49\b", "".join(page.texts))


def test_the_same_results_give_the_same_bytes() -> None:
    runs = [*SWEEP[:4], build_run("mine", error=HOSTILE)]
    first = build_report([build_recorded_result(runs)]).html
    second = build_report([build_recorded_result(runs)]).html
    assert second == first


@pytest.mark.slow
def test_fifty_runs_take_less_than_three_megabytes_at_two_frames_per_second() -> None:
    runs = [
        build_run(name, seed, 2.0 + 0.1 * seed, robots=6, map_name=("rooms", "flat")[seed % 2])
        for seed in range(25)
        for name in ("rapf", "rpf")
    ]
    page = build_report([build_recorded_result(runs, seconds=60.0, hz=60.0)])
    assert page.shown == (50,)
    assert len(page.html.encode()) < MAX_PAGE_BYTES
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page.html)[1])
    assert len(data["runs"]) == 50
    # Runs that are too large for a page are embedded at a lower rate. At 2 Hz, robots at their maximum speed
    # of 1 m/s still move by no more than 0.5 m from frame to frame.
    assert data["rate"] >= 2.0


@pytest.mark.slow
def test_fifty_long_runs_of_large_teams_take_less_than_three_megabytes() -> None:
    runs = [build_run("rapf", seed, 2.0, robots=30) for seed in range(50)]
    result = build_recorded_result(runs[:1], seconds=300.0, hz=5.0)
    (saved,) = result.loaded.values()
    loaded = {each.folder: SavedRun(each.folder, saved.record, saved.history) for each in runs}
    page = build_report([build_result(runs, loaded=loaded, maps={"rooms": ROOMS})])
    assert page.shown == (50,)
    assert len(page.html.encode()) < MAX_PAGE_BYTES


@pytest.mark.slow
def test_several_results_are_sections_with_unique_ids() -> None:
    comparison = build_recorded_result([build_run(), build_run("rpf", final=3.0)])
    run = build_recorded_result([build_run("lloyd", map_name="hall")], HALL)
    page = build_report(
        [
            replace(comparison, kind="comparison"),
            replace(run, kind="run"),
            replace(comparison, kind="comparison"),
        ]
    )
    parsed = Page(page.html)
    ids = [attributes["id"] for _, attributes in parsed.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert page.shown == (2, 1, 2)
    levels = [int(tag[1]) for tag, _ in parsed.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[:3] == [1, 2, 3]
    assert levels.count(2) == 3
    assert "3 results" in parsed.texts


def test_empty_sections_are_left_out() -> None:
    headings = re.findall(
        r"<h2[^>]*>([^<]+)", build_report([replace(build_recorded_result([build_run()]), kind="run")]).html
    )
    assert headings == ["Setup", "Results", "Replay", "Cost over time", "Metrics"]
    failed = build_report([build_result([build_run(error="it broke")])]).html
    assert re.findall(r"<h2[^>]*>([^<]+)", failed) == ["Setup", "Failures"]
    assert "it broke" in failed
    assert "No run has a result." in failed


def test_a_sweep_has_all_of_its_sections(html) -> None:
    headings = re.findall(r"<h2[^>]*>([^<]+)", html)
    assert headings == [
        *("Setup", "Results", "Replay", "Cost over time", "Final cost", "In pairs"),
        *("What the result depends on", "Trajectories", "Failures"),
    ]
    assert "Not finished: 9 of 40 runs are missing." in html
    assert "1 of 31 runs failed (mine 1 of 1): " in html
    assert html.count('class="thumbnails"') == 1
    assert html.count("data-run=") == 30


@pytest.mark.parametrize("theme", ["auto", "light", "dark"])
def test_only_the_automatic_theme_follows_the_preferred_scheme(theme) -> None:
    html = build_report([build_recorded_result([build_run()])], theme=theme).html
    assert ("prefers-color-scheme" in html.partition("</style>")[0]) == (theme == "auto")


def test_an_unknown_theme_is_rejected() -> None:
    with pytest.raises(ParameterError, match="unknown theme 'sepia'"):
        build_report([build_recorded_result([build_run()])], theme="sepia")


def test_failed_and_missing_runs_are_at_the_top(html) -> None:
    body = html.partition("<body>")[2]
    assert body.index("1 of 31 runs failed (mine 1 of 1): ") < body.index("Not finished: 9 of 40")
    assert body.index("Not finished") < body.index('class="lede"') < body.index("<table")


def test_marks_and_labels_of_variants_are_the_same_everywhere(html) -> None:
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])
    styles = {(run["label"], run["style"], run["mark"], str(run["dashes"])) for run in data["runs"]}
    assert len(styles) == 6
    for part in zip(*styles, strict=True):
        assert len(set(part)) == 6
    for label, style, mark, _ in styles:
        cell = f'<path d="{mark}" style="fill:var(--rc-{style})"/></svg>{label}<'
        assert html.count(cell) >= 3  # gains, results, trajectories


def test_a_long_name_is_shortened_with_a_tooltip() -> None:
    name = "<b>" + "ü" * 297
    escaped = name.replace("<", "&lt;").replace(">", "&gt;")
    html = build_report(
        [build_recorded_result([build_run(map_name=name)], replace(ROOMS, name=name))], title=name
    ).html
    page = Page(html)
    shortened = [word for text in page.texts for word in text.split() if "…" in word]
    assert len(shortened) >= 3
    assert max(map(len, shortened)) <= MAX_WORD_CHARS
    assert f'title="{escaped}"' in html


def test_a_result_with_only_damaged_runs_has_a_section_with_the_reason() -> None:
    damaged = replace(
        build_result([]), damaged_runs=(DamagedRun("run", "record.npz: no zip file"),), expected_count=1
    )
    html = build_report([build_recorded_result([build_run()]), damaged]).html
    assert "1 run cannot be read and is left out: run (record.npz: no zip file)." in html


def test_a_report_is_recognized(tmp_path) -> None:
    path = tmp_path / "page.html"
    path.write_text(build_report([build_recorded_result([build_run()])]).html)
    assert is_report(path)
    path.write_text("<!doctype html><title>mine</title>")
    assert not is_report(path)
    assert not is_report(tmp_path / "none.html")


def test_all_marks_have_paths() -> None:
    from robocov_app.look.curve_styles import choose_controller_styles

    styles = choose_controller_styles(["rapf", "rpf", "lloyd", *"abcdefghijklmnop"]).values()
    assert {style.mark for style in styles} == MARKER_PATHS.keys()
    assert len({(style.name, style.mark) for style in styles}) == len(styles)


@pytest.mark.slow
def test_the_replay_explains_moving_obstacles() -> None:
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    has_explanation = [
        "paler obstacles move" in build_report([build_recorded_result([build_run()], environment)]).html
        for environment in (ROOMS, replace(ROOMS, obstacles=(cart,)))
    ]
    assert has_explanation == [False, True]
