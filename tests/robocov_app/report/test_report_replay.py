"""The HTML of a replay: content, isolation from the page, and escaping of names."""

import json
import re
from dataclasses import replace

from drawn_run import ROOMS
from reported_results import HOSTILE, Page, build_history, build_record

from robocov.text import escape_controls
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.replay import (
    MAX_PANES,
    build_replay_element,
    build_replay_html,
    read_replay_css,
    read_replay_js,
)


def build_replay_runs(count: int = 2, name: str = "run") -> list[ReplayRun]:
    records = [
        build_record(seed=seed, controller=("rapf", "rpf", "lloyd")[seed % 3]) for seed in range(count)
    ]
    return [
        ReplayRun(record, build_history(record, 2.0), f"{name} {k}", "It went well.")
        for k, record in enumerate(records)
    ]


def read_replay_data(html: str) -> dict:
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])


def test_a_replay_is_self_contained() -> None:
    html = build_replay_html(build_replay_runs())
    page = Page(html)
    assert [attributes for name, attributes in page.elements if "id" in attributes] == []
    assert not re.findall(r"\b(?:src|href)=|https?:|@import|url\(", html)
    assert len(page.find_all("style")) == 1
    assert len(page.find_all("script")) == 2
    assert not page.find_all("html")
    data = read_replay_data(html)
    assert [run["title"] for run in data["runs"]] == ["run 0", "run 1"]
    assert [run["style"] for run in data["runs"]] == ["rapf", "rpf"]


def test_runs_with_different_gains_have_different_styles() -> None:
    runs = [ReplayRun(build_record(gains={"k": k}), None, f"run {n}") for n, k in enumerate((1.0, 2.0, 1.0))]
    styles = [
        (run["style"], run["mark"], tuple(run["dashes"]))
        for run in read_replay_data(build_replay_html(runs))["runs"]
    ]
    assert styles[0] == styles[2]
    assert all(first != second for first, second in zip(*styles[:2], strict=True))


def test_images_with_descriptions_replace_the_replay_without_scripts() -> None:
    page = Page(build_replay_element(build_replay_runs(6)))
    images = page.find_all("svg")
    assert len(images) == MAX_PANES
    assert all(each["role"] == "img" and "4 robots" in each["aria-label"] for each in images)
    assert not page.find_all("style")


def test_hostile_names_are_escaped() -> None:
    record = replace(build_record(replace(ROOMS, name=HOSTILE)), label=HOSTILE, controller=HOSTILE)
    html = build_replay_html([ReplayRun(record, None, HOSTILE, HOSTILE)])
    page = Page(html)
    assert len(page.find_all("script")) == 2
    assert not page.find_all("img")
    data = read_replay_data(html)
    escaped = escape_controls(HOSTILE)
    assert data["runs"][0]["title"] == escaped
    assert data["runs"][0]["facts"] == escaped
    assert data["maps"][0]["name"] == escaped


def test_panes_show_the_first_or_the_selected_runs() -> None:
    assert read_replay_data(build_replay_html(build_replay_runs(6)))["panes"] == [0, 1, 2, 3]
    assert read_replay_data(build_replay_element(build_replay_runs(6), [5, 2]))["panes"] == [5, 2]


def test_the_same_runs_give_the_same_bytes() -> None:
    assert build_replay_html(build_replay_runs()) == build_replay_html(build_replay_runs())


def test_style_and_script_do_not_affect_the_page() -> None:
    css = read_replay_css()
    for selector in re.findall(r"([^{}]+)\{", re.sub(r"@[^{]+\{", "", css)):
        for part in re.sub(r":is\([^)]*\)", "", selector).split(","):
            assert part.strip().startswith((".robocov-replay", ".robocov-picture")), part
    html = build_replay_html(build_replay_runs(1))
    script = html[html.rindex("<script>") : html.rindex("</script>")]
    assert script.startswith('<script>(() => {\n"use strict";')
    assert script.rstrip().endswith("})();")
    assert "window." not in read_replay_js().replace("window.devicePixelRatio", "").replace(
        "window.innerHeight", ""
    )
