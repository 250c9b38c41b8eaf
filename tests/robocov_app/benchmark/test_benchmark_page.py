"""The page that compares results: its tables, notes and plots, and results from files."""

from __future__ import annotations

import copy
import html
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from benchmark_results import MAPS, build_bundled_rapf, build_result, select_bundled_results
from driven_browser import CHROMIUM, DRIVER, Browser

from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.page.page import build_page


class PageTables(NamedTuple):
    overview: list[tuple[str, ...]]
    ideal: list[tuple[str, ...]]
    incomplete: list[tuple[str, ...]]


def read_tables(results: list[dict[str, Any]]) -> PageTables:
    """Return the rows of the tables on the page of some results."""
    tables: dict[str, list[tuple[str, ...]]] = {}
    for part in re.findall(r"<table>.*?</table>", build_page(results, "Test"), re.DOTALL):
        caption = html.unescape(re.search(r"<caption><span>(.*?)</span>", part)[1])  # type: ignore[index]
        rows = []
        for row in re.findall(r"<tr>(.*?)</tr>", part.partition("<tbody>")[2]):
            cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)
            rows.append(tuple(html.unescape(re.sub(r"<svg.*?</svg>", "", cell)) for cell in cells))
        tables.setdefault(caption.partition(",")[0].partition(":")[0], rows)
    incomplete = tables.get("Few") or tables.get("Few*", [])
    return PageTables(tables["Scores"], tables["Ratings"], incomplete)


@pytest.mark.usefixtures("without_plots")
def test_entries_made_with_an_earlier_version_are_marked() -> None:
    adaptive, rapf = select_bundled_results("adaptive", "rapf")
    earlier = {**adaptive, "versions": {**adaptive["versions"], "robocov": "0.1.0 (results 4)"}}
    current = {**adaptive, "versions": {**adaptive["versions"], "robocov": "0.1.0 (results 5)"}}
    note = "Adaptive: made with an earlier version"
    page = build_page([rapf, earlier], "Test")
    assert note in page
    assert "in which the same runs give different results: Adaptive." in page
    assert "in which the same runs give different results" not in build_page([rapf, current], "Test")
    assert "made with an earlier version" not in build_page([rapf, current], "Test")


@pytest.mark.usefixtures("without_plots")
def test_the_page_links_to_the_corrections() -> None:
    page = build_page(select_bundled_results("rapf"), "Test")
    assert page.count('id="corrections"') == 1
    assert 'see <a href="#corrections">Corrections</a>' in page
    assert ratings.CORRECTIONS in page


@pytest.mark.usefixtures("without_plots")
def test_an_incomplete_entry_is_listed_separately() -> None:
    results = select_bundled_results("atlas", "rapf")
    _, rapf = results
    few_result = {**rapf, "rows": rapf["rows"][:3], "entry": {**rapf["entry"], "label": "Few"}}
    ratings_alone = ratings.build_ratings(results)
    ratings_with_few = ratings.build_ratings([*results, few_result])
    for track, track_ratings in ratings_alone.items():
        assert track_ratings == ratings_with_few[track][: len(track_ratings)]
    tables = [read_tables(results), read_tables([*results, few_result])]
    assert tables[0].overview == tables[1].overview[:-1]
    assert tables[1].overview[-1][:5] == ("Few", "own", "–", "–", "3 of 345")
    assert [row[0] for row in tables[1].ideal] == [row[0] for row in tables[0].ideal]
    assert "Few" not in [row[0] for row in tables[1].ideal]
    incomplete = tables[1].incomplete
    few_row, *other_rows = incomplete
    assert few_row[:2] == ("Few", "own") and few_row[3] == "3 of 142"
    # RAPF is shown next to it, over the same runs.
    rapf_row = next(row for row in other_rows if row[0] == "RAPF")
    assert rapf_row[1:] == few_row[1:]


@pytest.mark.usefixtures("without_plots")
def test_unranked_entries_are_in_alphabetical_order_and_entries_without_runs_are_named() -> None:
    results = select_bundled_results("rapf", "lloyd")
    few_results = [
        {**results[0], "rows": results[0]["rows"][:3], "entry": {**results[0]["entry"], "label": label}}
        for label in ("b", "C", "a")
    ]
    page = build_page([*results, *few_results], "Test")
    overview = page.partition('id="overview-core"')[2].partition("</section>")[0]
    rows = re.findall(r'<th scope="row"[^>]*>(?:<svg.*?</svg>)?(.*?)</th>', overview)
    assert rows[-3:] == ["a", "b", "C"]
    plans = page.partition('id="overview-plans"')[2].partition("</section>")[0]
    assert "Without runs on these tracks: a; b; C." in plans
    entries = page.partition("<span>Entries</span>")[2].partition("</table>")[0]
    labels = re.findall(r'<th scope="row"[^>]*>(?:<svg.*?</svg>)?(.*?)</th>', entries)
    assert labels == ["a", "b", "C", "Lloyd", "RAPF"]


@pytest.mark.usefixtures("without_plots")
@pytest.mark.parametrize("track", ["tuning", "plans-small"])
def test_runs_on_other_tracks_do_not_change_the_overview(track: str) -> None:
    results = select_bundled_results("atlas", "exploring-lloyd")
    atlas, explorer = results
    row = {**explorer["rows"][0], "track": track, "map": suite.TRACKS[track].maps[0], "seed": 0}
    extended = {**explorer, "rows": [*explorer["rows"], row]}
    assert read_tables([atlas, extended]).overview == read_tables(results).overview


@pytest.mark.usefixtures("without_plots")
def test_large_plans_have_a_ranking_of_their_own() -> None:
    page = build_page(select_bundled_results("rapf", "lloyd"), "Test")
    overview = page.partition('id="overview-plans"')[2].partition("</section>")[0]
    assert "Overview of large plans" in overview
    first_row = re.findall(r"<tr>(.*?)</tr>", overview.partition("<tbody>")[2])[0]
    cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", first_row)
    assert (cells[2], cells[4]) == ("1", "30")


@pytest.mark.usefixtures("short_ideal_track")
def test_entries_with_failed_runs_are_neither_in_plots_nor_hidden() -> None:
    failing = build_result("Failing", 0.1)
    failing["rows"][0] = {"track": "ideal", "map": MAPS[0], "seed": 0, "error": "it failed"}
    page = build_page([failing, build_result("Mine", 0.2), build_bundled_rapf()], "Test")
    descriptions = re.findall(r"Median gap against .*?\.", page)
    assert descriptions and not any("Failing" in description for description in descriptions)
    overview = page.partition('id="overview-core"')[2].partition("</section>")[0]
    (row,) = [row for row in overview.split("<tr>") if "Failing*</th>" in row]
    # Only a line break keeps the column narrow.
    assert "<td>2,\n1 failed</td>" in row and "<td>50%</td>" in row and "<td>∞</td>" in row


def build_unfinished_atlas() -> dict[str, Any]:
    """Return the result of Atlas with shared maps without its runs on the two last tracks of large plans."""
    (result,) = copy.deepcopy(select_bundled_results("atlas-shared"))
    result["rows"] = [row for row in result["rows"] if row["track"] not in ("plans-large", "plans-crowd")]
    return result


@pytest.mark.usefixtures("without_plots")
def test_unranked_entries_with_the_smallest_gap_are_named() -> None:
    """The oracle has even smaller gaps, but does not compete."""
    page = build_page([build_unfinished_atlas(), *select_bundled_results("rapf", "oracle")], "Test")
    assert "have no rank: Atlas, shared maps (Plans one robot, Plans small, Plans medium)." in page


@pytest.mark.usefixtures("without_plots")
def test_files_do_not_hide_bundled_entries_with_the_smallest_gap() -> None:
    results = [build_unfinished_atlas(), *select_bundled_results("rapf")]
    forged = copy.deepcopy(results[1])
    forged["is_bundled"] = False
    for row in forged["rows"]:
        row["gap"] = 0.0
    page = build_page([*results, forged], "Test")
    assert "Of the built-in controllers that do not know the whole map" in page
    assert "have no rank: Atlas, shared maps (Plans one robot, Plans small, Plans medium)." in page


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_other_entries_do_not_replace_a_bundled_one() -> None:
    by_label = build_result("RAPF", 0.1)
    by_name = build_result("RAPF", 0.2, controller="rapf", source_sha256=None)
    incomplete = build_result("Few", 0.4)
    incomplete["rows"].pop()
    tables = read_tables([by_label, by_name, incomplete, build_bundled_rapf()])
    gaps = {row[0]: row[4] for row in tables.ideal}
    assert gaps == {"RAPF": "30.0", "RAPF*": "10.0", "RAPF #2*": "20.0"}
    # Only the bundled entry is a yardstick.
    assert [row[0] for row in tables.incomplete] == ["Few*", "RAPF"]


@pytest.mark.usefixtures("short_ideal_track")
def test_results_from_files_are_marked_everywhere() -> None:
    long_label = "Atlas, shared maps" + 30 * "."
    pages = [
        build_page([*results, build_bundled_rapf()], "Test")
        for results in ([build_result(long_label, 0.1)], [build_result("Mine", 0.1, is_bundled=True)])
    ]
    assert [f"{long_label}*" in page for page in pages] == [True, False]
    # In a plot, only the name is shortened.
    (text,) = set(re.findall(r">(Atlas, shared maps[^<]*)</text>", pages[0]))
    assert text.endswith("…*")
    assert ["from a file, which may contain anything" in page for page in pages] == [True, False]


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_equal_scores_have_the_same_rank() -> None:
    results = [build_result(label, gap) for label, gap in (("a", 0.2), ("b", 0.2), ("c", 0.1), ("d", 0.4))]
    overview = read_tables([*results, build_bundled_rapf()]).overview
    ranks = {row[0]: row[2] for row in overview}
    # The files change no rank of RAPF.
    assert ranks == {"c*": "1", "a*": "1", "b*": "1", "RAPF": "1", "d*": "2"}
    ranks = {row[0]: row[2] for row in read_tables(results).overview}
    assert ranks == {"c*": "1", "a*": "2", "b*": "2", "d*": "4"}


@pytest.mark.usefixtures("short_ideal_track")
def test_files_do_not_remove_bundled_results_from_plots() -> None:
    bundled = [build_bundled_rapf(), build_result("Bundled", 0.5, is_bundled=True)]
    files = [build_result(f"Short {k}", 0.1) for k in range(5)]
    for result in files:
        for row in result["rows"]:
            row["path_length_m"] = 1e-9
    files += [build_result("Long", 0.1), build_result("Far", 1e9)]
    for row in files[-2]["rows"]:
        row["path_length_m"] = 1e9
    page = build_page([*files, *bundled], "Test")
    (path_plot,) = re.findall(r"<figcaption>Gap and path length</figcaption>.*?</figure>", page)
    drawn, _, note = path_plot.partition("</svg>")
    assert all(f">{label}</text>" in drawn for label in ("RAPF", "Bundled"))
    assert "Short" not in drawn and "Long" not in drawn
    shorts = "; ".join(f"Short {k}*" for k in range(5))
    assert f"because they are far from all others: {shorts}; Long*; Far*." in note


@pytest.mark.usefixtures("short_ideal_track")
def test_files_do_not_squeeze_bundled_results_in_plots() -> None:
    bundled = [build_bundled_rapf(), build_result("Bundled", 0.5, is_bundled=True)]
    results = {name: build_result(name, 0.1) for name in ("Short", "Long", "Near", "Still")}
    path_lengths = {"Short": 2.0, "Long": 40.0, "Near": 3.0, "Still": 0.0}
    for name, result in results.items():
        for row in result["rows"]:
            row["path_length_m"] = path_lengths[name]
    results["High"] = build_result("High", 2.1)
    page = build_page([*results.values(), *bundled], "Test")
    (path_plot,) = re.findall(r"<figcaption>Gap and path length</figcaption>.*?</figure>", page)
    drawn, _, note = path_plot.partition("</svg>")
    assert all(f">{label}</text>" in drawn for label in ("RAPF", "Bundled", "Near*"))
    # The median paths of the bundled results are 8.3 and 8.5 m, and their largest gap is 50%.
    far_labels = note.partition("far from all others: ")[2].partition(".")[0].split("; ")
    assert sorted(far_labels) == ["High*", "Long*", "Short*", "Still*"]


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_the_code_of_an_entry_in_a_file_is_a_claim() -> None:
    forged = build_result("\u0410tlas", 0.1, controller="atlas", source_sha256=None)
    plugin = build_result("Zigzag", 0.1, controller="zigzag", source_sha256=None)
    page = build_page([forged, build_result("Mine", 0.1), plugin, build_bundled_rapf()], "Test")
    entries = page.partition("<span>Entries</span>")[2].partition("</table>")[0]
    codes = re.findall(r"<td[^>]*>((?:according|built|source).*?)</td>", entries)
    # In alphabetical order: Mine, RAPF, Zigzag, and a label that begins with a Cyrillic letter.
    assert codes == [
        "according to the file: source 111111111111",
        "built in",
        "according to the file: installed package",
        "according to the file: built in",
    ]


@pytest.mark.usefixtures("short_ideal_track")
def test_the_page_shows_entries_with_any_content() -> None:
    labels = ["<script>alert(1)</script>", "A\x00B", "\u202eevil", "$x^{$ \\frac", "{{ 7 * 7 }}", "W" * 60]
    results = [build_result(label, 0.1 * k) for k, label in enumerate(labels)]
    results.append(build_result("Gains", 0.1, set={"<b>" * 30: "</table>" * 50}))
    results[0]["rows"][0] = {"track": "ideal", "map": MAPS[0], "seed": 0, "error": "<b>x</b>"}
    results[1]["rows"][0] |= {"deciding_s": 1e15}
    for k in range(100):
        results.append(build_result(f"Entry {k}", 0.5))
        if k % 2:
            results[-1]["rows"].pop()
    page = build_page([*results, build_bundled_rapf()], "Test")
    assert not set(page) & {"\x00", "\u202e"}
    assert "<script" not in page and "<b>" not in page
    assert "A\\x00B" in page and "{{ 7 * 7 }}" in page
    tables = [html.unescape(part) for part in re.findall(r"<caption><span>(.*?)</span>", page)]
    assert sum("incomplete" in caption for caption in tables) == 50
    assert "Entries with lower scores that are not drawn: 47." in page


@pytest.mark.slow
@pytest.mark.xdist_group("browser")
@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="not installed: chromium and chromedriver")
def test_the_page_works_in_narrow_and_wide_windows(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    maps = ("rooms", "polygons-7001")
    track = replace(suite.TRACKS["ideal"], seeds=(0,), maps=maps)
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]
    results = []
    for k, name in enumerate(("rapf", "lloyd", "atlas")):
        result = build_result(name.upper(), 0.1 * (k + 1), controller=name, source_sha256=None)
        for j, (row, map_name) in enumerate(zip(result["rows"], maps, strict=True)):
            row["map"] = map_name
            row["gap"] += 0.01 * j
            row["path_length_m"] = 8.0 - k
            row["sent_bytes"] *= k + 1
            row["deciding_s"] *= 20**k
            if k == 0:
                row["gap_to_bound"] = 0.5
        results.append(result)
    page = tmp_path / "page.html"
    page.write_text(build_page(results, "A <test> of names"), encoding="utf-8")
    for width in (1280, 390):
        browser.open_file(page, width)
        assert browser.read_console() == []
        assert browser.run_script("return performance.getEntriesByType('resource').length") == 0
        assert browser.run_script("return document.documentElement.scrollWidth") <= width
        assert len(browser.find_all("svg.plot")) == 3
    assert browser.find("h1").text == "A <test> of names"
    labels = [cell.text for cell in browser.find_all("#ideal tbody th")][:3]
    assert labels == ["RAPF*", "LLOYD*", "ATLAS*"]
    assert [cell.text for cell in browser.find_all("#overview-core tbody th")] == labels
    gaps = [
        float(cell.text.split()[0])
        for cell in browser.find_all("#ideal .scroll:first-of-type tbody td:nth-child(5)")
    ]
    assert gaps == np.sort(gaps).tolist()
