"""What goes beyond the paper, as small as it can be: done, gone on with, stopped, read, drawn and written."""

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest
from tiny_paper import TINY, TINY_BEYOND, means, shared

from robocov.controllers import CONTROLLERS
from robocov.metrics.results import read_results
from robocov_app.cli import main
from robocov_app.replication import (
    beyond,
    beyond_studies,
    beyond_writing,
    evidence,
    goals,
    rival_gains,
    steps,
    studying,
)
from robocov_app.replication import plan as planned
from robocov_app.replication.beyond import among_rivals, forecast_beyond, studied_beyond
from robocov_app.replication.beyond_plots import WORDS, beyond_figures, gap_samples
from robocov_app.replication.beyond_writing import beyond_claims, beyond_page, goal_words
from robocov_app.replication.doing import swept_together
from robocov_app.replication.evidence import evidence_rows
from robocov_app.replication.goals import QUESTIONS
from robocov_app.replication.outcomes import joined
from robocov_app.replication.pages import Image
from robocov_app.sweep.study import Study, tasks_of

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tiny-beyond")]

PLAN = replace(TINY, duration=3.0, generated=(1,), beyond=TINY_BEYOND)


@pytest.fixture(scope="module", autouse=True)
def small_parts():
    """Try two sets of each rival's gains; time steps of teams that are small, and few of them."""
    with pytest.MonkeyPatch.context() as patch:
        two = {name: (grid[0], grid[-1]) for name, grid in rival_gains.GRIDS.items()}
        patch.setattr(rival_gains, "GRIDS", two)
        patch.setattr(steps, "BLOCK", 3)
        for module in (beyond, evidence, goals, beyond_writing):
            patch.setattr(module, "LARGE", 8)
        for module in (beyond, goals, beyond_writing):
            patch.setattr(module, "HUGE", 10)
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of the study, and what it gave."""
    with shared(tmp_path_factory, "tiny-beyond") as root:
        folder = root / "out"
        studying.begun(folder, PLAN)
        return folder, studied_beyond(folder, PLAN, means(), None)


@pytest.fixture(scope="module")
def material(study):
    return study[1]


@pytest.fixture(scope="module")
def content(material):
    """The page, with pictures that nobody has drawn."""
    images = {name: Image(name, 2148, 900, words) for name, words in WORDS.items()}
    return beyond_page(images, material)


def written(material) -> str:
    """Return the claims as text: one that is not a number equals itself there."""
    return json.dumps([claim.to_json() for claim in beyond_claims(material)])


class TestRuns:
    def test_as_many_as_were_forecast(self, study, tmp_path):
        folder, material = study
        expected = forecast_beyond(tmp_path, PLAN, 2, alone=False)
        assert expected.left == expected.runs == material.runs
        assert expected.seconds > 0.0 and set(expected.each) == set(CONTROLLERS)
        assert material.failed == 0
        again = forecast_beyond(folder, PLAN, 2, alone=True)
        assert (again.left, again.seconds, again.runs) == (0, 0.0, material.runs + 2 * 3 * 4)

    def test_who_has_done_the_papers_grid_has_its_best_gains_to_run_too(self, tmp_path, monkeypatch):
        monkeypatch.setattr("robocov_app.sweep.performing.perform", lambda task: None)
        without = forecast_beyond(tmp_path, PLAN, 2, alone=True)
        for task in tasks_of(planned.gains_study(PLAN)):
            (tmp_path / "studies" / "gains" / "runs" / task.name).mkdir(parents=True)
        expected = forecast_beyond(tmp_path, PLAN, 2, alone=True)
        assert expected.runs == expected.left == without.runs + 2 * 3 * 2  # RAPF's and RPF's

    def test_rivals_have_the_gains_that_were_best_on_the_maps_of_the_tuning(self, study):
        folder, material = study
        assert set(material.gains) == {law.controller for law in beyond_studies.rivals()}
        table = read_results(folder / "studies" / "rivals").to_table().to_pylist()
        for name, grid in material.gains.items():
            assert [tuple(each) for each in grid.scenarios] == [
                ("generated-101", start, PLAN.tuning_seed) for start in PLAN.tuning_starts
            ]
            best = grid.gains[int(np.argmin(grid.excess.mean(axis=1)))]
            for row in table:
                if row["controller"] == name:
                    assert {gain: row[gain] for gain in best} == best

    def test_every_registered_controller_has_a_row(self, material):
        rows = evidence_rows(material.outcomes, material.contenders, material.steps)
        assert {row.controller for row in rows} == set(CONTROLLERS)
        medians = [row.law.gap.estimate for row in rows]
        assert medians == sorted(medians)
        for row in rows:
            assert set(row.steps) == {6, 8}
            assert all(ratio > 0.0 for ratio in row.steps.values())
            assert row.law.runs == 2

    def test_the_same_call_does_nothing_again_and_gives_the_same(self, study):
        folder, material = study
        rows = sorted((folder / "studies").glob("*/runs/*/row.json"))
        before = [path.stat().st_mtime_ns for path in rows]
        again = studied_beyond(folder, PLAN, means(), None)
        assert [path.stat().st_mtime_ns for path in rows] == before
        assert written(again) == written(material)

    def test_what_is_lost_is_done_again_and_gives_the_same(self, study, tmp_path):
        folder, material = study
        out = tmp_path / "out"
        shutil.copytree(folder, out)
        lost = sorted((out / "studies" / "rivals" / "runs").iterdir())[::5]
        lost += sorted((out / "studies").glob("conditions-*/runs/*"))[::6]
        for path in lost:
            shutil.rmtree(path)
        (lost[0].parent / f".{lost[0].name}.part").mkdir()  # as one that was killed leaves it
        assert written(studied_beyond(out, PLAN, means(), None)) == written(material)
        for name in ("rivals", "conditions-loss"):
            table = f"studies/{name}/results.csv"
            assert (out / table).read_bytes() == (folder / table).read_bytes()

    def test_nothing_is_done_after_ctrl_c(self, study, tmp_path):
        stopped = means()
        stopped.stop.requested = True
        with pytest.raises(studying.Stopped):
            swept_together(beyond_studies.all_studies(PLAN), tmp_path, stopped, "x")
        assert not list(tmp_path.glob("studies/*/runs/*"))
        shutil.copytree(study[0] / "references", tmp_path / "references")
        with pytest.raises(studying.Stopped):
            beyond.timed(tmp_path, PLAN, stopped)

    def test_a_task_of_two_studies_is_done_once(self, tmp_path):
        maps = beyond_studies.small_maps(PLAN)
        common = {"maps": maps, "duration": 0.2, "lattice": 8, "starts": ("corner",)}
        studies = {"one": Study(controllers=("rpf",), **common)}
        studies["two"] = Study(controllers=("rpf", "lloyd"), **common)
        swept_together(studies, tmp_path, means(), "x")
        tables = [read_results(tmp_path / "studies" / name).to_table() for name in studies]
        assert [len(table) for table in tables] == [2, 4]
        finals = [
            dict(zip(t["run"].to_pylist(), t["mean_distance_m"].to_pylist(), strict=True)) for t in tables
        ]
        assert finals[0].items() <= finals[1].items()


class TestReading:
    def test_outcomes_are_joined_by_scenario(self, material):
        left = material.outcomes.among(np.array([True, False]))
        right = material.outcomes.among(np.array([False, True]))
        whole = joined([left, right])
        assert whole.scenarios == material.outcomes.scenarios
        for key, values in material.outcomes.values.items():
            assert np.array_equal(whole.values[key], values, equal_nan=True)
        half = joined([material.outcomes, left])
        assert half.scenarios == material.outcomes.scenarios

    def test_the_papers_runs_count_where_rivals_ran(self, material):
        fewer = replace(PLAN, beyond=replace(TINY_BEYOND, generated=()))
        assert set(among_rivals(material.outcomes, fewer).maps) == {"blocks-a"}
        assert set(material.outcomes.starts) == {"corner"}

    def test_both_runs_are_judged_by_the_density(self, study, material):
        from robocov.cost import CoverageCost

        known, ignored = material.weighed.pictures
        assert not known.record.environment.density.uniform
        assert ignored.record.environment.density is None
        assert known.record.positions[0] == pytest.approx(ignored.record.positions[0])
        judge = CoverageCost(known.record.environment, PLAN.lattice)
        costs = [judge(each.record.positions[-1]).mean_distance for each in (known, ignored)]
        assert material.weighed.costs == pytest.approx(tuple(costs))
        table = read_results(study[0] / "studies" / "density").to_table().to_pylist()
        finals = material.weighed.outcomes.of("known", "final")
        assert finals == pytest.approx([row["mean_distance_m"] for row in table])

    def test_mixed_teams_are_judged_by_time(self, material):
        for law in beyond_studies.TEAMS:
            seconds, metres = (material.teams.of(law.key, measure) for measure in ("final", "distance"))
            assert (seconds > metres).all() and (seconds < 4.0 * metres + 1e-9).all()

    def test_degradations_have_every_value_of_every_axis(self, material):
        conditions = beyond_studies.conditions_plan(PLAN)
        wanted = {(axis, value) for axis, values in conditions.axes.items() for value in values}
        assert {(each.axis, each.value) for each in material.degradations} == wanted
        assert all(each.ratio.estimate == 1.0 for each in material.degradations if each.value in (None, 0.0))


class TestFigures:
    @pytest.mark.parametrize("theme", ["light", "dark"])
    def test_all_are_drawn(self, material, theme):
        drawn = beyond_figures(material, theme)
        assert set(drawn) == set(WORDS)
        for name in ("beyond-gaps", "beyond-density"):
            figure = drawn[name]()
            assert figure.axes

    def test_gaps_are_sorted_and_whole(self, material):
        samples = gap_samples(material)
        assert len(samples) == len(material.contenders)
        medians = [float(np.median(sample.values)) for sample in samples]
        assert medians == sorted(medians)
        figure = beyond_figures(material, "light")["beyond-gaps"]()
        low, high = figure.axes[0].get_xlim()
        assert low < min(sample.values.min() for sample in samples)
        assert high > max(sample.values.max() for sample in samples)

    def test_what_goes_wrong_and_pairs_are_drawn(self, material):
        drawn = beyond_figures(material, "dark")
        assert len(drawn["beyond-conditions"]().axes) == 6
        labels = [text.get_text() for text in drawn["beyond-pairs"]().axes[0].get_yticklabels()]
        assert len(labels) == len(material.contenders) - 1


class _Tags(HTMLParser):
    def __init__(self, content: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(content)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


class TestPage:
    def test_every_controller_has_its_section(self, content):
        ids = {attributes.get("id") for _, attributes in _Tags(content).found}
        assert {f"controller-{name}" for name in CONTROLLERS} <= ids
        assert content.count('<svg class="strips"') == len(CONTROLLERS)

    def test_links_lead_somewhere_and_ids_are_unique(self, content):
        tags = _Tags(content).found
        ids = [str(attributes["id"]) for _, attributes in tags if "id" in attributes]
        assert len(ids) == len(set(ids))
        for _, attributes in tags:
            for target in (attributes.get("href"), f"#{attributes.get('aria-labelledby')}"):
                if target and target.startswith("#") and target != "#None":
                    assert target[1:] in ids, target

    def test_it_asks_for_no_network(self, content):
        for _, attributes in _Tags(content).found:
            for name, value in attributes.items():
                assert name == "xmlns" or not re.match(r"(?:https?:)?//", str(value)), value
        assert "@import" not in content and "url(" not in content and "<script" not in content

    def test_it_has_a_heading_of_each_rank_in_turn(self, content):
        ranks = [int(tag[1]) for tag, _ in _Tags(content).found if re.fullmatch(r"h\d", tag)]
        assert ranks[0] == 1 and ranks.count(1) == 1
        assert all(after - before <= 1 for before, after in pairwise(ranks))

    def test_every_claim_and_goal_is_told(self, content, material):
        plain = content.replace("&#39;", "'").replace("\N{NO-BREAK SPACE}", " ")
        claims = beyond_claims(material)
        assert {claim.part for claim in claims} == set(QUESTIONS)
        for claim in claims:
            assert f'id="{claim.key}"' in content and claim.claim in plain
        for goal in beyond_writing.beyond_goals(material):
            assert goal.words in plain
        assert goal_words(beyond_writing.beyond_goals(material)) in plain
        assert goal_words([]) == "Nothing was measured."

    def test_it_says_what_ours_reached_on_maps_that_played_no_part(self, content, material):
        assert {scenario.map for scenario in material.unseen.scenarios} == {"generated-201"}
        assert np.isfinite(material.unseen.of("atlas", "gap")).all()
        heading = "On maps that played no part in its development"
        assert heading in content and "generated maps with seeds 201, on which nothing" in content
        without = replace(material, unseen=None)
        assert heading not in beyond_page({}, without)
        assert "goal-unseen" not in written(without)

    def test_it_says_where_the_gains_of_rivals_come_from(self, content, material):
        plain = content.replace("&#39;", "'").replace("\N{NO-BREAK SPACE}", " ")
        for name, grid in material.gains.items():
            assert rival_gains.gains_words(name, grid) in plain
        assert "on 1 generated maps (seeds 101)" in plain

    def test_the_same_runs_give_the_same_page(self, content, material):
        images = {name: Image(name, 2148, 900, words) for name, words in WORDS.items()}
        assert beyond_page(images, material) == content


@pytest.mark.skipif(not (shutil.which("chromium") and shutil.which("chromedriver")), reason="no browser")
def test_in_a_browser_nothing_sticks_out(content, tmp_path):
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = str(shutil.which("chromium"))
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking"):
        options.add_argument(argument)
    metrics = {"width": 390, "height": 900, "pixelRatio": 1.0}
    options.add_experimental_option("mobileEmulation", {"deviceMetrics": metrics})
    path = tmp_path / "beyond.html"
    path.write_text(content, encoding="utf-8")
    browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    try:
        browser.get(path.as_uri())
        assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
        # what is wider may be scrolled, each in a frame of its own
        script = (
            "const framed = '.scroll, .large, caption';"
            "return [...document.querySelectorAll('main *')].filter(e => !e.closest(framed))"
            ".filter(e => e.getBoundingClientRect().right > 391).map(e => e.outerHTML.slice(0, 120))"
        )
        out = browser.execute_script(script)
        assert out == []
        assert browser.execute_script("return document.querySelectorAll('.strips').length") == len(
            CONTROLLERS
        )
    finally:
        browser.quit()


def test_the_command_does_this_part_alone(study, tmp_path, monkeypatch, capsys):
    """With everything but the drawing of figures, which other tests do."""
    from robocov_app.replication import writing

    monkeypatch.setattr(planned, "QUICK", PLAN)
    images = {f"figure-{k}": Image(f"figure-{k}", 2148, 900, "words") for k in range(1, 9)}
    drawn = {name: Image(name, 2148, 900, words) for name, words in WORDS.items()}
    monkeypatch.setattr(writing, "save_pictures", lambda *_, **__: images)
    monkeypatch.setattr(beyond_writing, "save_beyond_pictures", lambda *_, **__: drawn)
    out = tmp_path / "out"
    shutil.copytree(study[0], out)
    assert main(["paper", "--quick", "--beyond-only", "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    claims = json.loads((out / "claims.json").read_text())
    assert answer["claims"] == claims and answer["runs"] == study[1].runs + 8
    assert [claim["key"] for claim in claims] == [claim.key for claim in beyond_claims(study[1])]
    for claim in claims:
        assert {"claim", "verdict", "estimate", "interval", "runs"} <= set(claim)
    page, front = ((out / name).read_text(encoding="utf-8") for name in ("beyond.html", "index.html"))
    assert 'href="index.html"' in page and 'href="beyond.html"' in front
    assert "without --beyond-only the claims are tested too" in front
    for claim in claims:
        assert f'href="beyond.html#{claim["key"]}"' in front and f'id="{claim["key"]}"' in page
