"""The page as a whole: its sections, its size, and that hostile names cannot break it."""

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
    """A page of a sweep with gains, failures and missing runs."""
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
        assert len(page.all(tag)) == 1, tag
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and set(levels[1:]) == {2}
    skip = next(each for each in page.all("a"))
    assert skip == {"class": "skip", "href": "#content"}
    for section in page.all("section"):
        assert "aria-label" in section or "aria-labelledby" in section


def test_all_pictures_and_plots_are_described(html) -> None:
    page = Page(html)
    pictures = page.all("svg")
    assert len(pictures) > 30
    for each in pictures:
        hidden = each.get("aria-hidden") == "true"
        assert hidden or (each.get("role") == "img" and len(each.get("aria-label") or "") > 20)
    said = " ".join(each.get("aria-label") or "" for each in pictures)
    for number in (
        "1.430 m at the end (median of 5 runs, quartiles 1.230 to 1.630)",
        "medians at 0.1: 1.430",
    ):
        assert number in said, number
    for button in page.all("button"):
        assert "Open large." in button["aria-label"] and "final mean distance" in button["aria-label"]
    assert not page.all("img") and not page.all("canvas")  # canvases and their words are made by the script


def test_tables_have_captions_and_scopes(html) -> None:
    page = Page(html)
    assert len(page.all("table")) == len(page.all("caption")) >= 5
    assert {each.get("scope") for each in page.all("th")} == {"col", "row"}


def test_the_page_needs_no_network(html) -> None:
    assert not re.findall(r"(?:https?:)?//[\w.-]+\.\w|@import|url\((?!#)", unescape(html))
    page = Page(html)
    for _, attributes in page.elements:
        for name in ("src", "srcset", "action", "data", "poster"):
            assert name not in attributes
        assert (attributes.get("href") or "#").startswith("#")
        assert not [name for name in attributes if name.startswith("on")]
    (policy,) = [each["content"] for each in page.all("meta") if "http-equiv" in each]
    assert "default-src 'none'" in policy
    (script,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy and "unsafe-eval" not in policy


def test_hostile_names_stay_names() -> None:
    runs = [
        replace(
            build_run(HOSTILE, seed, 2.0 + seed, map_name=HOSTILE, gains=((HOSTILE, 1.0 + seed),)),
            label=HOSTILE,
        )
        for seed in range(3)
    ]
    runs.append(replace(runs[0], error=HOSTILE, figures={}, start=HOSTILE, seed=9))
    result = build_recorded_result(runs, replace(ROOMS, name=HOSTILE))
    result = replace(result, gain_units={HOSTILE: HOSTILE}, gain_meanings={HOSTILE: HOSTILE})
    html = build_report([result], title=HOSTILE).html
    page = Page(html)
    assert not page.all("img")
    assert [each.get("type") for each in page.all("script")] == ["application/json", None]
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])
    assert (
        data["maps"][0]["name"] == escape_controls(HOSTILE)
        and escape_controls(HOSTILE) in data["runs"][0]["title"]
    )
    assert escape_controls(HOSTILE) in "".join(page.words)
    assert "{{7*7}}" in "".join(page.words) and "49" not in re.findall(r"\b49\b", "".join(page.words))


def test_the_same_results_give_the_same_bytes() -> None:
    runs = [*SWEEP[:4], build_run("mine", error=HOSTILE)]
    first = build_report([build_recorded_result(runs)]).html
    again = build_report([build_recorded_result(runs)]).html
    assert again == first


@pytest.mark.slow
def test_fifty_runs_take_less_than_three_megabytes() -> None:
    runs = [
        build_run(name, seed, 2.0 + 0.1 * seed, robots=6, map_name=("rooms", "flat")[seed % 2])
        for seed in range(25)
        for name in ("rapf", "rpf")
    ]
    page = build_report([build_recorded_result(runs, seconds=60.0, hz=60.0)])
    assert page.shown == (50,)
    assert len(page.html.encode()) < 3_000_000
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page.html)[1])
    assert len(data["runs"]) == 50 and data["rate"] >= 2.0


@pytest.mark.slow
def test_fifty_long_runs_of_large_teams_take_less_than_three_megabytes() -> None:
    runs = [build_run("rapf", seed, 2.0, robots=30) for seed in range(50)]
    result = build_recorded_result(runs[:1], seconds=300.0, hz=5.0)
    (saved,) = result.loaded.values()
    loaded = {each.folder: SavedRun(each.folder, saved.record, saved.history) for each in runs}
    page = build_report([build_result(runs, loaded=loaded, maps={"rooms": ROOMS})])
    assert page.shown == (50,) and len(page.html.encode()) < 3_000_000


@pytest.mark.slow
def test_several_results_are_sections_with_ids_of_their_own() -> None:
    one = build_recorded_result([build_run(), build_run("rpf", final=3.0)])
    other = build_recorded_result([build_run("lloyd", map_name="hall")], HALL)
    page = build_report(
        [replace(one, kind="comparison"), replace(other, kind="run"), replace(one, kind="comparison")]
    )
    parsed = Page(page.html)
    ids = [attributes["id"] for _, attributes in parsed.elements if "id" in attributes]
    assert len(ids) == len(set(ids)) and page.shown == (2, 1, 2)
    levels = [int(tag[1]) for tag, _ in parsed.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[:3] == [1, 2, 3] and levels.count(2) == 3
    assert "3 results" in parsed.words


def test_empty_sections_are_left_out() -> None:
    headings = re.findall(
        r"<h2[^>]*>([^<]+)", build_report([replace(build_recorded_result([build_run()]), kind="run")]).html
    )
    assert headings == ["Setup", "Results", "Replay", "Cost over time", "Metrics"]
    failed = build_report([build_result([build_run(error="it broke")])]).html
    assert re.findall(r"<h2[^>]*>([^<]+)", failed) == ["Setup", "Failures"]
    assert "it broke" in failed and "No run has a result." in failed


def test_a_sweep_has_all_of_its_sections(html) -> None:
    headings = re.findall(r"<h2[^>]*>([^<]+)", html)
    assert headings == [
        *("Setup", "Results", "Replay", "Cost over time", "Final cost", "In pairs"),
        *("What the result depends on", "Trajectories", "Failures"),
    ]
    assert "Not finished: 9 of 40 runs are missing." in html and "1 of 31 runs failed (mine 1 of 1): " in html
    assert html.count('class="thumbnails"') == 1 and html.count("data-run=") == 30


@pytest.mark.parametrize("theme", ["auto", "light", "dark"])
def test_themes(theme) -> None:
    html = build_report([build_recorded_result([build_run()])], theme=theme).html
    assert ("prefers-color-scheme" in html.partition("</style>")[0]) == (theme == "auto")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: build_report([build_recorded_result([build_run()])], theme="sepia"),
            "unknown theme 'sepia'",
        ),
    ],
)
def test_an_unknown_theme_is_rejected(call, message) -> None:
    with pytest.raises(ParameterError) as caught:
        call()
    assert message in str(caught.value)


def test_failures_are_at_the_top(html) -> None:
    words = html.partition("<body>")[2]
    assert words.index("1 of 31 runs failed (mine 1 of 1): ") < words.index("Not finished: 9 of 40")
    assert words.index("Not finished") < words.index('class="lede"') < words.index("<table")


def test_variants_have_the_same_marks_and_labels_in_tables_pictures_and_the_replay(html) -> None:
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
    whole = name.replace("<", "&lt;").replace(">", "&gt;")
    html = build_report(
        [build_recorded_result([build_run(map_name=name)], replace(ROOMS, name=name))], title=name
    ).html
    page = Page(html)
    cut = [word for words in page.words for word in words.split() if "…" in word]
    assert len(cut) >= 3 and max(map(len, cut)) <= MAX_WORD_CHARS and f'title="{whole}"' in html


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
    assert not is_report(path) and not is_report(tmp_path / "none.html")


def test_all_marks_have_paths() -> None:
    from robocov_app.look.curve_styles import choose_controller_styles

    styles = choose_controller_styles(["rapf", "rpf", "lloyd", *"abcdefghijklmnop"]).values()
    assert {style.mark for style in styles} == MARKER_PATHS.keys()
    assert len({(style.name, style.mark) for style in styles}) == len(styles)


@pytest.mark.slow
def test_the_replay_explains_obstacles_that_move() -> None:
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    words = [
        "paler obstacles move" in build_report([build_recorded_result([build_run()], environment)]).html
        for environment in (ROOMS, replace(ROOMS, obstacles=(cart,)))
    ]
    assert words == [False, True]
