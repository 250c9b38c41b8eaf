"""The whole study of the paper, as small as possible: runs, interruptions, tables, figures and pages."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from small_studies import DirectExecutor
from tiny_paper import TINY, build_options
from tiny_paper_command import SAVED_FIGURES

from robocov.controllers import CONTROLLERS
from robocov.cost import CoverageCost
from robocov.errors import InputError
from robocov.metrics.results import read_results
from robocov_app.cli import main
from robocov_app.evaluation.reference_search import ReferenceSearch
from robocov_app.figures.files import save_figure
from robocov_app.replication.claims import judge_beyond_claims, judge_paper_claims
from robocov_app.replication.claims.claim import EXTENSIONS, GOALS, RIVALS
from robocov_app.replication.claims.goals import describe_goal, summarize_goals
from robocov_app.replication.claims.registration import load_registration
from robocov_app.replication.design import contenders, studies, study_maps
from robocov_app.replication.design import plan as planned
from robocov_app.replication.design.contenders import GAIN_GRIDS, LABELS, TEAMS
from robocov_app.replication.evidence import describe_tuning, rank_contenders, summarize_contenders
from robocov_app.replication.execution import parts, runner
from robocov_app.replication.execution.forecast import forecast_study
from robocov_app.replication.execution.runner import StudyInterrupted, open_folder
from robocov_app.replication.figures import figure_files
from robocov_app.replication.figures.beyond_plots import build_gap_samples, prepare_beyond_plots
from robocov_app.replication.figures.figure_files import FigureFile
from robocov_app.replication.figures.paper_figures import CAPTIONS, describe_figure, find_arrival_time
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.pages import study_pages
from robocov_app.replication.results import controller_speed, references
from robocov_app.sweep import sweeping
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import generate_tasks

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tiny-paper")]

FIRST = parts.record_partition()
RUN_COUNT = 142
"""Number of runs of the tiny study without those beyond the paper."""
TINY_COMMAND = Path(__file__).parents[1] / "tiny_paper_command.py"


def search_in_this_process(queries, workers, stop):
    """Yield the answers of a reference search in this process."""
    search = ReferenceSearch()
    for name, query in queries.items():
        if stop.requested:
            return
        yield name, search([query], None)


@pytest.fixture(scope="module", autouse=True)
def reduced_study():
    """Reduce the gain grids and speed measurements to a minimum, and run tasks in this process."""
    grids = {name: grid[:1] for name, grid in GAIN_GRIDS.items()}
    for name in ("dispersion", "range-limited"):  # the fastest
        grids[name] = (GAIN_GRIDS[name][0], GAIN_GRIDS[name][-1])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contenders, "GAIN_GRIDS", grids)
        patch.setattr(controller_speed, "STEPS_PER_BLOCK", 1)
        # Without starting processes, whose imports take longer than their runs and searches.
        patch.setattr(references, "answer_queries", search_in_this_process)
        patch.setattr(runner, "LocalPool", DirectExecutor)
        patch.setattr(sweeping, "LocalPool", DirectExecutor)
        yield


def save_selected_image(figure, path):
    """Save light PNG images and `SAVED_FIGURES`; `test_quick_study` saves all figures."""
    if (path.suffix == ".png" and not path.stem.endswith("-dark")) or path.name in SAVED_FIGURES:
        save_figure(figure, path)
    else:
        path.touch()


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder, the results of both parts, and the images of the paper's page."""
    folder = tmp_path_factory.mktemp("tiny-paper") / "out"
    open_folder(folder, TINY)
    paper = parts.run_paper(folder, TINY, build_options())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure_files, "save_figure", save_selected_image)
        images = figure_files.save_paper_figures(folder, paper.figures, FIRST, paper, quiet=True)
    claims = judge_paper_claims(paper.convex, paper.claims, paper.limited, paper.gains)
    study_pages.write_claims(folder, claims)
    page = study_pages.build_paper_page(TINY, images, paper.figures, results=paper, claims=claims)
    study_pages.write_text(folder / study_pages.PAGE_FILE, page)
    beyond = parts.run_beyond(folder, TINY, build_options(), paper)
    return folder, paper, beyond, images


DRAWN = {
    name: FigureFile(name, 2148, 900, words) for name, words in CAPTIONS.items() if name.startswith("beyond")
}


@pytest.fixture(scope="module")
def folder(study):
    return study[0]


@pytest.fixture(scope="module")
def paper(study):
    return study[1]


@pytest.fixture(scope="module")
def beyond(study):
    return study[2]


@pytest.fixture(scope="module")
def paper_page(folder):
    return (folder / "index.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def beyond_page(beyond):
    return study_pages.build_beyond_page(DRAWN, beyond)


def format_claims(claims) -> str:
    """Return claims as text: one that is not a number equals itself there."""
    return json.dumps([claim.to_json() for claim in claims])


def test_the_page_says_why_limited_ranges_do_not_change_rpf(paper_page):
    assert "At the limited ranges, RPF with shared gains moves as without limits" in paper_page
    assert "its repulsion reaches 2 m, which is not farther than either range" in paper_page


class TestRuns:
    def test_the_forecast_is_the_number_of_runs(self, folder, paper, beyond, tmp_path):
        expected = forecast_study(tmp_path, TINY, 2, claims=True, beyond=True)
        # The tiny grid does not contain the shared gains.
        assert expected.left == expected.runs == paper.runs + beyond.runs
        assert paper.failed == beyond.failed == 0
        assert expected.seconds > 0.0 and set(expected.seconds_per_run) == set(CONTROLLERS)
        again = forecast_study(folder, TINY, 2, claims=True, beyond=True)
        assert (again.left, again.seconds) == (0, 0.0)
        assert forecast_study(folder, TINY, 2, claims=False, beyond=False).runs == 16

    def test_the_forecast_includes_the_best_gains_of_a_finished_grid(self, tmp_path, monkeypatch):
        monkeypatch.setattr("robocov_app.sweep.worker.perform", lambda task: None)
        without = forecast_study(tmp_path, TINY, 2, claims=False, beyond=True)
        for task in generate_tasks(studies.build_gains_study(TINY)):
            (tmp_path / "studies" / "gains" / "runs" / task.name).mkdir(parents=True)
        # Runs of an earlier version are in the same folder.
        (tmp_path / "studies" / "gains" / "runs" / "of-a-former-version").mkdir()
        expected = forecast_study(tmp_path, TINY, 2, claims=False, beyond=True)
        assert expected.runs == expected.left == without.runs + 2 * 3 * 2  # RAPF's and RPF's

    def test_a_finished_study_repeats_no_runs(self, folder, paper, beyond):
        rows = sorted((folder / "studies").glob("*/runs/*/row.json"))
        before = [path.stat().st_mtime_ns for path in rows]
        again = parts.run_paper(folder, TINY, build_options())
        alone = parts.run_beyond(folder, TINY, build_options(), None)
        assert [path.stat().st_mtime_ns for path in rows] == before
        assert again.contenders == paper.contenders and again.references == paper.references
        paper_claims = judge_paper_claims(paper.convex, paper.claims, paper.limited, paper.gains)
        assert format_claims(
            judge_paper_claims(again.convex, again.claims, again.limited, again.gains)
        ) == format_claims(paper_claims)
        assert format_claims(judge_beyond_claims(alone)) == format_claims(judge_beyond_claims(beyond))

    def test_lost_runs_are_repeated_with_equal_results(self, folder, paper, beyond, tmp_path):
        out = tmp_path / "out"
        shutil.copytree(folder, out)
        lost = sorted((out / "studies" / "rivals" / "runs").iterdir())[::5]
        lost += sorted((out / "studies").glob("conditions-*/runs/*"))[::6]
        for path in lost:
            shutil.rmtree(path)
        (lost[0].parent / f".{lost[0].name}.part").mkdir()  # as a killed run leaves it
        again = parts.run_beyond(out, TINY, build_options(), paper)
        assert format_claims(judge_beyond_claims(again)) == format_claims(judge_beyond_claims(beyond))
        for name in ("rivals", "conditions-loss"):
            table = f"studies/{name}/results.csv"
            assert (out / table).read_bytes() == (folder / table).read_bytes()

    def test_the_best_gains_have_the_lowest_mean_relative_cost(self, folder, paper, beyond):
        contenders_by_key = {each.key: each for each in paper.contenders}
        for controller, grid in paper.gains.items():
            assert (
                contenders_by_key[f"{controller}-best"].gains
                == grid.gains[int(np.argmin(grid.relative_costs.mean(axis=1)))]
            )
        assert set(beyond.gains) == set(GAIN_GRIDS)
        table = list(read_results(folder / "studies" / "rivals").rows())
        for name, grid in beyond.gains.items():
            assert {(each.map, each.seed) for each in grid.instances} == {("generated-101", TINY.tuning_seed)}
            best = grid.gains[int(np.argmin(grid.relative_costs.mean(axis=1)))]
            for row in table:
                if row["controller"] == name:
                    assert {gain: row[gain] for gain in best} == best

    def test_all_contenders_start_from_the_same_positions(self, folder):
        starts: dict = {}
        for path in folder.glob("studies/claims/runs/*/run.json"):
            run = json.loads(path.read_text())
            places = starts.setdefault((run["map"]["name"], run["start"], run["seed"]), set())
            places.add(json.dumps(run["starts_m"]))
        assert len(starts) == 6
        assert all(len(places) == 1 for places in starts.values())

    def test_the_worst_runs_are_those_of_rapf_on_each_map(self, paper):
        gap = paper.claims.get_values("rapf-shared", "gap")
        assert len({scenario.map for scenario, _ in paper.worst}) == len(paper.worst) == 2
        first, record = paper.worst[0]
        k = paper.claims.instances.index(first)
        assert gap[k] == gap.max()
        assert record.positions[-1] == pytest.approx(paper.claims.values["rapf-shared", "placement"][k])
        assert record.gains["k_att"] == 3.0

    def test_figures_contain_their_runs(self, paper):
        assert set(paper.figures[""]) == {
            f"{case}/{controller}"
            for case in ("convex", "a", "b", "other")
            for controller in ("rapf", "lloyd" if case == "convex" else "rpf")
        }
        other = paper.figures[""]["other/rapf"].record
        same = paper.figures[""]["b/rpf"].record
        assert (other.start, same.start) == ("other", "paper")
        assert same.positions[0] == pytest.approx(paper.figures[""]["a/rapf"].record.positions[0])

    def test_figures_4_to_8_also_contain_the_best_gains(self, paper):
        best = paper.figures["best"]
        contenders_by_key = {each.key: each for each in paper.contenders}
        assert set(best) == {
            f"{case}/{controller}" for case in ("a", "b", "other") for controller in ("rapf", "rpf")
        }
        for name, run in best.items():
            assert dict(run.record.gains) == contenders_by_key[f"{name.partition('/')[2]}-best"].all_gains
            assert run.record.positions[0] == pytest.approx(paper.figures[""][name].record.positions[0])

    def test_a_run_that_two_studies_share_is_executed_once(self, tmp_path):
        common = {
            "maps": study_maps.build_generated_maps(TINY.beyond.maps),
            "duration": 0.2,
            "lattice": 8,
            "starts": ("corner",),
        }
        both = {"one": Study(controllers=("rpf",), **common)}
        both["two"] = Study(controllers=("rpf", "lloyd"), **common)
        runner.run_studies(both, tmp_path, build_options(), "x")
        tables = [list(read_results(tmp_path / "studies" / name).rows()) for name in both]
        assert [len(table) for table in tables] == [2, 4]
        finals = [{row["run"]: row["mean_distance_m"] for row in table} for table in tables]
        assert finals[0].items() <= finals[1].items()


class TestBeyond:
    def test_every_registered_controller_has_a_row(self, beyond):
        rows = rank_contenders(beyond)
        assert {row.contender.controller for row in rows} == set(CONTROLLERS)
        medians = [row.gap.estimate for row in rows]
        assert medians == sorted(medians)
        for row in rows:
            assert all(beyond.steps[size].compute_ratio(row.contender.controller).estimate for size in (6, 8))
            assert row.runs == 2
        samples = build_gap_samples(beyond)
        assert [sample.label for sample in samples] == [row.contender.label for row in rows]

    def test_runs_of_the_paper_count_on_the_maps_of_the_baselines(self, paper):
        fewer = replace(TINY, beyond=replace(TINY.beyond, generated=()))
        outcomes = parts.select_baseline_outcomes(paper.claims, fewer)
        assert set(outcomes.maps) == {"blocks-a"} and set(outcomes.starts) == {"corner"}

    def test_runs_with_and_without_the_density_are_rated_by_it(self, folder, beyond):
        known, ignored = beyond.density.figure_runs
        assert not known.record.environment.density.is_uniform
        assert ignored.record.environment.density is None
        assert known.record.positions[0] == pytest.approx(ignored.record.positions[0])
        judge = CoverageCost(known.record.environment, TINY.lattice)
        costs = [judge(each.record.positions[-1]).mean_distance for each in (known, ignored)]
        assert beyond.density.costs == pytest.approx(tuple(costs))
        table = list(read_results(folder / "studies" / "density").rows())
        finals = beyond.density.outcomes.get_values("known", "final")
        assert finals == pytest.approx([row["mean_distance_m"] for row in table])

    def test_mixed_teams_are_rated_by_travel_time(self, beyond):
        for team in TEAMS:
            seconds = beyond.teams.get_values(team.key, "time")
            meters = beyond.teams.get_values(team.key, "final")
            assert (seconds > meters).all() and (seconds < 4.0 * meters + 1e-9).all()

    def test_degradations_have_every_value_of_every_axis(self, beyond):
        axes = studies.list_disturbances(TINY)["conditions"].axes.items()
        wanted = {("ideal", None)} | {(axis, value) for axis, values in axes for value in values}
        for name in CONTROLLERS:
            own = [each for each in beyond.degradations if each.controller == name]
            assert {(each.axis, each.value) for each in own} == wanted and len(own) == len(wanted)
            best = [each for each in own if each.value in (None, 0.0) and each.axis != "ideal"]
            assert all(each.ratio.estimate == 1.0 for each in best)

    def test_all_figures_are_drawn(self, beyond):
        drawn = prepare_beyond_plots(beyond, "dark")
        assert set(drawn) == set(DRAWN)
        (axes,) = drawn["beyond-gaps"]().axes
        low, high = axes.get_xlim()
        samples = build_gap_samples(beyond)
        assert low < min(sample.values.min() for sample in samples)
        assert high > max(sample.values.max() for sample in samples)
        assert len(drawn["beyond-conditions"]().axes) == 6
        assert len(drawn["beyond-density"]().axes) >= 2
        labels = drawn["beyond-pairs"]().axes[0].get_yticklabels()
        assert len(labels) == len(beyond.contenders) - 1


def start_study(*words: str) -> subprocess.Popen[str]:
    """Start the command with the tiny study in its own process."""
    return subprocess.Popen(
        [sys.executable, str(TINY_COMMAND), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def count_finished_runs(out: Path) -> int:
    return len(list(out.glob("studies/*/runs/[!.]*")))


def wait_for_runs(out: Path, count: int, process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 300.0  # Two busy cores need a fifth of this time.
    while count_finished_runs(out) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def assert_same_files(folder: Path, other: Path, names: list[str]) -> None:
    """Check that files of two folders are the same byte for byte."""
    for name in names:
        assert (folder / name).read_bytes() == (other / name).read_bytes(), name


class TestStopping:
    def test_an_interrupted_and_killed_study_ends_like_an_undisturbed_one(self, folder, paper_page, tmp_path):
        out = tmp_path / "out"
        process = start_study("--out", str(out), "--workers", "2")
        wait_for_runs(out, 12, process)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        output, messages = process.communicate(timeout=300)
        assert process.returncode == 130
        forecast = next(line for line in messages.splitlines() if line.startswith("paper"))
        assert forecast.startswith(f"paper (quick): {RUN_COUNT} runs, about ")
        assert re.search(r"on 2 workers \(measured: rapf \d", forecast)
        assert "Ctrl+C keeps finished runs" in forecast
        assert f"Partial results are in {out}/. Run the same command to resume." in output
        finished_count = count_finished_runs(out)
        assert 12 <= finished_count < RUN_COUNT

        process = start_study("--out", str(out), "--workers", "2")
        wait_for_runs(out, finished_count + 12, process)
        process.kill()
        process.communicate(timeout=300)

        process = start_study("--out", str(out), "--workers", "2", "--json")
        output, messages = process.communicate(timeout=500)
        assert process.returncode == 0, messages
        answer = json.loads(output)
        assert (answer["runs"], answer["failed"], answer["interrupted"]) == (RUN_COUNT, 0, False)
        assert (out / "index.html").read_text(encoding="utf-8") == paper_page
        assert {path.name for path in (out / "figures").iterdir()} == set(SAVED_FIGURES)
        tables = [f"studies/{name}/results.csv" for name in ("gains", "convex", "claims")]
        figures = [f"figures/{name}" for name in SAVED_FIGURES]
        assert_same_files(out, folder, ["claims.json", *tables, *figures])

    def test_no_run_starts_after_ctrl_c(self, folder, tmp_path):
        open_folder(tmp_path / "out", TINY)
        stopped = build_options()
        stopped.stop.requested = True
        with pytest.raises(StudyInterrupted):
            parts.run_paper(tmp_path / "out", TINY, stopped)
        with pytest.raises(StudyInterrupted):
            runner.run_studies(studies.build_conditions_studies(TINY), tmp_path, stopped, "x")
        assert not list(tmp_path.glob("studies/*/runs/*"))
        with pytest.raises(StudyInterrupted):
            parts.time_steps(tmp_path, TINY, stopped)


class TestTables:
    def test_the_table_has_a_row_for_each_contender(self, paper):
        rows = summarize_contenders(paper.claims, paper.contenders, TINY.duration)
        assert [row.contender for row in rows] == list(paper.contenders)
        for row in rows:
            gap = paper.claims.get_values(row.contender.key, "gap")
            assert row.gap.estimate == pytest.approx(np.median(gap))
            assert row.quartiles[0] <= row.gap.estimate <= row.quartiles[1]
            assert 0.0 <= row.contact_fraction <= 1.0
            assert np.isnan(row.blocked_fraction) == (row.contender.controller == "rpf")
            assert (
                row.medians["final"] < row.medians["over_run"] and 0.0 < row.medians["path"] < TINY.duration
            )
            work = paper.claims.get_values(row.contender.key, "work")
            assert row.medians["work"] == np.median(work) and work.min() > 0.0
            assert row.rest_time <= TINY.duration or (row.rest_time == np.inf and row.rest_fraction <= 0.5)

    def test_the_table_has_a_row_for_each_map(self, paper, paper_page):
        (table,) = re.findall(r"<caption><span>Map by map.*?</table>", paper_page, re.DOTALL)
        assert re.findall(r'<th scope="row">(.*?)</th>', table) == ["blocks-a", "generated-1"]
        here = [scenario.map == "blocks-a" for scenario in paper.claims.instances]
        gaps = [
            format_amount(np.median(paper.claims.get_values(controller, "gap")[here]), "%")
            for controller in LABELS
        ]
        reference = paper.references["blocks-a"]
        cells = [f"{reference.mean_distance:.3f} m", format_amount(reference.agreement, "%"), *gaps]
        row = table.partition("blocks-a</th>")[2].partition("</tr>")[0]
        assert re.findall(r"<td.*?>(.*?)</td>", remove_escapes(row)) == cells


class TestWords:
    def test_descriptions_of_figures_match_the_data(self, paper):
        def describe(number: int) -> str:
            return describe_figure(number, paper.figures[""], FIRST)

        for case, number in (("convex", 2), ("a", 4), ("b", 6)):
            final = paper.figures[""][f"{case}/rapf"].history.mean_distance[-1]
            assert f"{final:.3f} m" in describe(number)
            assert re.search(r"RAPF's cost is lower \S+% of the time", describe(number + 1))
        assert re.search(r"are \S+ m from those of figure 6 with RAPF, and \S+ m with RPF", describe(8))
        assert "“Pentagon”" in describe(1)

    def test_the_cost_stays_near_its_end_after_the_arrival_time(self, paper):
        history = paper.figures[""]["a/rapf"].history
        time = find_arrival_time(history)
        later = history.mean_distance[history.time >= time]
        assert (np.abs(later / later[-1] - 1.0) <= 0.05).all()
        assert time in history.time


class _Tags(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def select(self, *names):
        return [attributes for tag, attributes in self.tags if tag in names]


def remove_escapes(text: str) -> str:
    return text.replace("&#39;", "'").replace("\N{NO-BREAK SPACE}", " ")


class TestPages:
    @pytest.fixture(params=["paper_page", "beyond_page"])
    def page(self, request):
        return request.getfixturevalue(request.param)

    def test_links_have_targets_and_ids_are_unique(self, page):
        tags = _Tags(page).tags
        ids = [str(attributes["id"]) for _, attributes in tags if "id" in attributes]
        assert len(ids) == len(set(ids))
        for _, attributes in tags:
            for target in (attributes.get("href"), f"#{attributes.get('aria-labelledby')}"):
                if target and target.startswith("#") and target != "#None":
                    assert target[1:] in ids, target

    def test_pages_load_nothing_from_the_network(self, page):
        for _, attributes in _Tags(page).tags:
            for name, value in attributes.items():
                assert name == "xmlns" or not re.match(r"(?:https?:)?//", str(value)), value
        assert "@import" not in page and "url(" not in page

    def test_no_level_of_headings_is_skipped(self, page):
        ranks = [int(tag[1]) for tag, _ in _Tags(page).tags if re.fullmatch(r"h\d", tag)]
        assert ranks[0] == 1 and ranks.count(1) == 1
        assert all(after - before <= 1 for before, after in pairwise(ranks))

    def test_claims_are_listed_as_registered(self, folder, paper_page, paper):
        claims = json.loads((folder / "claims.json").read_text())
        assert [claim["key"] for claim in claims] == list(load_registration().claims)
        for claim in claims:
            assert {"claim", "verdict", "estimate", "interval", "runs"} <= set(claim)
            assert claim["verdict"] == "undecided"  # Two maps are too few for a decision.
            assert claim["claim"] in remove_escapes(paper_page)
            p = {criterion["p"] for criterion in claim["criteria"]}
            assert claim["p"] == max(p) and (claim["p_adjusted"] or 1.0) >= claim["p"]
            assert format_amount(claim["p"]) in remove_escapes(paper_page)
        assert all(claim["p_adjusted"] is not None for claim in claims)
        assert {claim["question"] for claim in claims} == set(range(1, GOALS))
        ratio = paper.claims.compare("rapf-shared", "rpf-shared").median_ratio
        shared = next(claim for claim in claims if claim["key"] == "nonconvex-final-shared")
        assert (shared["estimate"], shared["interval"]) == (ratio.estimate, [ratio.low, ratio.high])

    def test_every_image_exists_and_has_a_description(self, folder, paper_page):
        images = _Tags(paper_page).select("img")
        assert len(images) == 26
        for image in images:
            assert (folder / str(image["src"])).is_file()
            assert len(str(image["alt"])) > 20
            assert int(str(image["width"])) in (1050, 2148)
        for link in _Tags(paper_page).select("a", "source"):
            target = str(link.get("href") or link.get("srcset"))
            if not target.startswith("#"):
                assert (folder / target).is_file(), target
        names = [f"figure-{k}" for k in range(1, 9)]
        names += [f"figure-{k}-{variant}" for k in range(4, 9) for variant in ("best", "limited")]
        for name in (*names, "figure-4-half-step", "figure-5-half-step"):
            assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
            for suffix in ("svg", "pdf"):
                assert (folder / "figures" / f"{name}.{suffix}").is_file()

    def test_results_of_the_best_gains_are_next_to_those_of_the_shared_gains(self, paper_page, paper):
        for number, case in ((4, "a"), (6, "b"), (8, "other")):
            part = paper_page.partition(f'id="figure-{number}"')[2].partition("</section>")[0]
            for variant in ("", "best", "limited"):
                runs = paper.figures[variant]
                rapf_cost, rpf_cost = (
                    runs[f"{case}/{controller}"].history.mean_distance[-1] for controller in ("rapf", "rpf")
                )
                text = remove_escapes(part)
                assert f"RAPF ends with a mean distance of {rapf_cost:.3f} m, " in text
                assert f" RPF ({rpf_cost:.3f} m)." in text
            assert part.count("<img") == (4 if number == 4 else 3)

    def test_the_protocol_states_all_parameters(self, paper_page, paper):
        text = remove_escapes(paper_page)
        for words in (
            f"{paper.runs} runs; 0 failed",
            *(
                "0.05 s",
                "1 s each",
                "(seeds 101, 102)",
                "with polygons (seeds 1)",
                "k_rep 0.3, 3 N m³",
                "rho_0 2 m",
            ),
            *("RAPF (k_rep 1, rho_0 2, k_att 3, no limit); RPF (k_rep 1, rho_0 2)", "attraction_limit 2"),
            *("equal within 2%", "(28)", "(18)", "2.0542, 1.6190", "robocov "),
        ):
            assert words in text, words
        assert "all non-convex ones except campus" not in text

    def test_the_page_contains_every_claim_and_goal(self, beyond_page, beyond):
        text = remove_escapes(beyond_page)
        ids = {attributes.get("id") for _, attributes in _Tags(beyond_page).tags}
        assert {f"controller-{name}" for name in CONTROLLERS} <= ids
        assert beyond_page.count('<svg class="strips"') == len(CONTROLLERS) and "<script" not in beyond_page
        claims = judge_beyond_claims(beyond)
        assert {claim.question for claim in claims} == {GOALS, RIVALS, EXTENSIONS}
        for claim in claims:
            assert claim.key in ids and claim.text in text
        goals = [claim for claim in claims if claim.key.startswith("goal-") and claim.key != "goal-unseen"]
        assert all(describe_goal(goal) in text for goal in goals)
        assert summarize_goals(goals) in text
        assert all(describe_tuning(name, grid) in text for name, grid in beyond.gains.items())
        assert "on 1 generated maps (seeds 101)" in text
        quick = replace(beyond, plan=replace(TINY, beyond=replace(TINY.beyond, tuning=())))
        text = remove_escapes(study_pages.build_beyond_page({}, quick))
        assert "default gains, found by the full study" in text and "120 s on 4 generated maps" in text

    def test_energies_have_a_unit(self, beyond_page, beyond):
        for row in rank_contenders(beyond):
            assert format_amount(row.medians["work"], "J") in remove_escapes(beyond_page)
        assert "in joules" in beyond_page and "before any limit" in beyond_page

    def test_every_controller_has_a_row_of_degradations(self, beyond_page, beyond):
        table = beyond_page.partition('class="evidence heat"')[2].partition("</table>")[0]
        known = {(each.controller, each.axis, each.value): each for each in beyond.degradations}
        assert table.count('<th scope="row">') == len(CONTROLLERS)
        for name in CONTROLLERS:
            row = table.partition(f'href="#controller-{name}"')[2].partition("</tr>")[0]
            at = ("ideal", None), *((axis, values[2]) for axis, values in studies.AXES.items())
            cells = [f"{known[name, *each].ratio.estimate:.2f}" for each in at]
            assert re.findall(r"<td.*?>(.*?)</td>", row) == [*cells, "1"]
        many = replace(TINY.beyond, conditions_maps=tuple("abcdefghijkl"))
        page = study_pages.build_beyond_page({}, replace(beyond, plan=replace(TINY, beyond=many)))
        assert (
            "<small>"
            in page.partition('class="evidence heat"')[2].partition("<tbody>")[2].partition("</table>")[0]
        )

    def test_the_page_contains_the_results_on_maps_of_other_families(self, beyond_page, beyond):
        assert {scenario.map for scenario in beyond.unseen.instances} == {
            f"{kind}-301" for kind in planned.UNSEEN
        }
        assert np.isfinite(beyond.unseen.get_values("atlas", "gap")).all()
        heading = "On generated blocks, rooms, caves, mazes"
        assert (
            f"<caption>{heading}" in beyond_page
            and "blocks, rooms, caves, mazes (robocov generate), seeds 301" in beyond_page
        )
        without = replace(beyond, unseen=None)
        assert f"<caption>{heading}" not in study_pages.build_beyond_page({}, without)
        assert "goal-unseen" not in format_claims(judge_beyond_claims(without))

    def test_equal_runs_give_equal_pages(self, study, paper_page, beyond_page):
        _, paper, beyond, images = study
        claims = judge_paper_claims(paper.convex, paper.claims, paper.limited, paper.gains)
        assert (
            study_pages.build_paper_page(TINY, images, paper.figures, results=paper, claims=claims)
            == paper_page
        )
        assert study_pages.build_beyond_page(DRAWN, beyond) == beyond_page

    @pytest.mark.skipif(not (shutil.which("chromium") and shutil.which("chromedriver")), reason="no browser")
    @pytest.mark.parametrize("width", [390, 1280])
    def test_nothing_is_wider_than_the_browser(self, folder, beyond_page, width):
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service

        chosen = Options()
        chosen.binary_location = str(shutil.which("chromium"))
        for argument in (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
        ):
            chosen.add_argument(argument)
        metrics = {"width": width, "height": 900, "pixelRatio": 1.0}
        chosen.add_experimental_option("mobileEmulation", {"deviceMetrics": metrics})
        chosen.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        browser = webdriver.Chrome(options=chosen, service=Service(shutil.which("chromedriver")))
        try:
            browser.get((folder / "index.html").as_uri())
            assert browser.execute_script("return document.documentElement.scrollWidth") <= width
            broken = browser.execute_async_script(
                "const done = arguments[0], images = [...document.images];"
                "Promise.all(images.map(image => {image.loading = 'eager'; return image.decode()"
                ".then(() => null, () => image.src)})).then(found => done(found.filter(Boolean)))"
            )
            assert broken == []
            canvases = "return document.querySelectorAll('.robocov-replay canvas').length"
            assert browser.execute_script(canvases) > 0
            assert browser.get_log("browser") == []
            path = folder.parent / f"more-{width}.html"
            path.write_text(beyond_page, encoding="utf-8")
            browser.get(path.as_uri())
            # Wider content is in frames that can be scrolled.
            out = browser.execute_script(
                "const framed = '.scroll, .large, caption';"
                "return [...document.querySelectorAll('main *')].filter(e => !e.closest(framed))"
                ".filter(e => e.getBoundingClientRect().right > arguments[0] + 1)"
                ".map(e => e.outerHTML.slice(0, 120))",
                width,
            )
            assert out == []
        finally:
            browser.quit()


class TestCommand:
    def test_figures_only(self, tmp_path, monkeypatch, capsys):
        monkeypatch.setattr(planned, "QUICK", TINY)
        monkeypatch.setattr(figure_files, "save_figure", lambda figure, path: path.touch())
        out = tmp_path / "out"
        assert main(["paper", "--quick", "--figures-only", "--out", str(out), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert (answer["runs"], answer["claims"]) == (16, [])
        assert not (out / "claims.json").exists()
        assert len(list((out / "figures").glob("*.pdf"))) == 15
        paper_page = (out / "index.html").read_text(encoding="utf-8")
        assert paper_page.count("<img") == 15 and "Best gains" not in paper_page
        assert "Verdicts" not in paper_page and "Only the figures were requested" in paper_page

    def test_beyond_only(self, study, tmp_path, monkeypatch, capsys):
        """With everything but the drawing of figures, which other tests do."""
        monkeypatch.setattr(planned, "QUICK", TINY)
        images = {f"figure-{k}": FigureFile(f"figure-{k}", 2148, 900, "words") for k in range(1, 9)}
        monkeypatch.setattr(figure_files, "save_paper_figures", lambda *_, **__: images)
        monkeypatch.setattr(figure_files, "save_beyond_figures", lambda *_, **__: DRAWN)
        out = tmp_path / "out"
        shutil.copytree(study[0], out)
        assert main(["paper", "--quick", "--beyond-only", "--out", str(out), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        claims = json.loads((out / "claims.json").read_text())
        assert answer["claims"] == claims and answer["runs"] == study[2].runs + 16
        assert [claim["key"] for claim in claims] == [claim.key for claim in judge_beyond_claims(study[2])]
        page = (out / "beyond.html").read_text(encoding="utf-8")
        front = (out / "index.html").read_text(encoding="utf-8")
        assert 'href="index.html"' in page and 'href="beyond.html"' in front
        assert "Without --beyond-only, the claims are tested, too" in front
        for claim in claims:
            assert f'href="beyond.html#{claim["key"]}"' in front and f'id="{claim["key"]}"' in page


def test_other_folders_are_not_used(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="expected an empty folder or a study of the paper"):
        open_folder(tmp_path, TINY)
    (tmp_path / "paper.json").write_text("[]")
    with pytest.raises(InputError, match="expected an empty folder or a study of the paper"):
        open_folder(tmp_path, TINY)


def test_quick_and_full_studies_do_not_share_a_folder(tmp_path):
    open_folder(tmp_path / "out", TINY)
    open_folder(tmp_path / "out", TINY)
    with pytest.raises(InputError, match="expected the full study, got the quick one; choose another --out"):
        open_folder(tmp_path / "out", replace(TINY, name="full"))
