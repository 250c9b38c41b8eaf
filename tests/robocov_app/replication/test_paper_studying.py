"""A whole study, as small as it can be: done, gone on with, stopped, read, drawn and written."""

import json
import os
import pickle
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
from tiny_paper import TINY, means, shared

from robocov.errors import InputError
from robocov_app.replication import plan as planned
from robocov_app.replication import studying
from robocov_app.replication.asking import QUESTIONS, asked
from robocov_app.replication.claims import compared
from robocov_app.replication.tables import ORDER, law_rows, map_rows
from robocov_app.replication.words import arrival, seen
from robocov_app.replication.writing import page, save_claims, save_page, save_pictures
from robocov_app.sweep.study import tasks_of

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("tiny-paper")]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of the study, what it gave, and its page with the pictures on it."""
    with shared(tmp_path_factory, "tiny-paper") as root:
        folder, kept = root / "out", root / "images"
        studying.begun(folder, TINY)
        material = studying.studied(folder, TINY, means())
        if not kept.exists():
            claims = asked(material.convex, material.claims, material.gains)
            first = studying.first_record()
            images = save_pictures(folder, material.figures, first, material, quiet=True)
            save_claims(folder, claims)
            save_page(folder, TINY, images, material.figures, first, material, claims)
            kept.write_bytes(pickle.dumps(images))
    return (
        folder,
        material,
        (folder / "index.html").read_text(encoding="utf-8"),
        pickle.loads(kept.read_bytes()),
    )


@pytest.fixture
def folder(study):
    return study[0]


@pytest.fixture
def material(study):
    return study[1]


@pytest.fixture
def content(study):
    return study[2]


TINY_COMMAND = (
    "import sys; sys.path.insert(0, sys.argv.pop(1))\n"
    "from tiny_paper import TINY\n"
    "from robocov_app.replication import plan\n"
    "plan.QUICK = TINY\n"
    "from robocov_app.cli import main\n"
    "sys.exit(main(['paper', '--quick', *sys.argv[1:]]))\n"
)


def test_runs_of_a_former_study_do_not_count(tmp_path: Path) -> None:
    """They lie there where a folder is gone on with by a newer version; the grid is complete all the same."""
    tuning = planned.gains_study(TINY)
    for task in tasks_of(tuning):
        (tmp_path / "studies/gains/runs" / task.name).mkdir(parents=True)
    (tmp_path / "studies/gains/runs/of-a-former-version").mkdir()
    assert studying.runs_there(tmp_path, "gains", tuning) == len(tuning)
    assert studying.runs_there(tmp_path, "gains") == len(tuning) + 1


def begun(*words: str) -> subprocess.Popen[str]:
    """Start the command with the tiny study in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", TINY_COMMAND, str(Path(__file__).parents[1]), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finished_runs(out: Path) -> int:
    return len(list(out.glob("studies/*/runs/[!.]*")))


def wait_for_runs(out: Path, count: int, process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 60.0
    while finished_runs(out) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


class TestRuns:
    def test_as_many_as_were_forecast(self, folder, material, tmp_path):
        expected = studying.forecast(tmp_path, TINY, 2)
        assert expected.left == expected.runs
        # none of the tiny grid's gains are the shared ones
        assert material.runs == expected.runs
        assert material.failed == 0
        assert set(expected.each) == {"rapf", "rpf", "lloyd"}
        assert expected.seconds > 0.0

    def test_what_is_there_is_forecast_to_take_no_time(self, folder, material):
        again = studying.forecast(folder, TINY, 2)
        assert (again.left, again.seconds) == (0, 0.0)

    def test_the_same_call_does_nothing_again_and_gives_the_same(self, folder, material):
        rows = sorted((folder / "studies").glob("*/runs/*/row.json"))
        before = [path.stat().st_mtime_ns for path in rows]
        again = studying.studied(folder, TINY, means())
        assert [path.stat().st_mtime_ns for path in rows] == before
        for name in ("convex", "claims"):
            first, second = getattr(material, name), getattr(again, name)
            assert first.scenarios == second.scenarios
            for key, values in first.values.items():
                assert np.array_equal(values, second.values[key], equal_nan=True)
        assert again.best == material.best
        assert again.references == material.references

    def test_best_gains_are_those_with_the_least_mean_excess(self, material):
        for law, contender in material.best.items():
            grid = material.gains[law]
            means_ = grid.excess.mean(axis=1)
            assert contender.gains == grid.gains[int(np.argmin(means_))]
            assert contender.key == f"{law}-best"

    def test_all_contenders_began_in_the_same_places(self, folder, material):
        starts: dict = {}
        for path in (folder / "studies" / "claims" / "runs").glob("*/run.json"):
            run = json.loads(path.read_text())
            starts.setdefault((run["map"]["name"], run["start"], run["seed"]), set()).add(
                json.dumps(run["starts_m"])
            )
        assert len(starts) == 6
        assert all(len(places) == 1 for places in starts.values())

    def test_the_worst_runs_are_rapfs_worst_on_each_map(self, material):
        gap = material.claims.of("rapf-shared", "gap")
        assert len({scenario.map for scenario, _ in material.worst}) == len(material.worst) == 2
        first, record = material.worst[0]
        k = material.claims.scenarios.index(first)
        assert gap[k] == gap.max()
        assert record.positions[-1] == pytest.approx(material.claims.placements["rapf-shared"][k])
        assert record.gains["k_att"] == 3.0

    def test_figures_show_their_runs(self, material):
        assert set(material.figures) == {
            f"{case}/{law}"
            for case in ("convex", "a", "b", "other")
            for law in ("rapf", "lloyd" if case == "convex" else "rpf")
        }
        other, same = material.figures["other/rapf"].record, material.figures["b/rpf"].record
        assert (other.start, same.start) == ("other", "paper")
        assert same.positions[0] == pytest.approx(material.figures["a/rapf"].record.positions[0])


class TestStopping:
    def test_a_study_that_was_interrupted_and_killed_ends_as_an_undisturbed_one(
        self, folder, content, tmp_path
    ):
        out = tmp_path / "out"
        process = begun("--out", str(out), "--workers", "2")
        wait_for_runs(out, 12, process)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        said, told = process.communicate(timeout=60)
        assert process.returncode == 130
        first = told.splitlines()[0]
        assert first.startswith("paper (quick): 108 runs, about ")
        assert "on 2 processes (measured: rapf 0." in first and "Ctrl-C keeps what is done" in first
        assert f"to go on: robocov paper --out {out} --quick" in said
        kept = finished_runs(out)
        assert 12 <= kept < 108

        process = begun("--out", str(out), "--workers", "2")
        wait_for_runs(out, kept + 12, process)
        process.kill()
        process.communicate(timeout=60)

        process = begun("--out", str(out), "--workers", "1", "--json")
        said, told = process.communicate(timeout=120)
        assert process.returncode == 0, told
        answer = json.loads(said)
        assert (answer["runs"], answer["failed"], answer["interrupted"]) == (108, 0, False)
        assert (out / "claims.json").read_bytes() == (folder / "claims.json").read_bytes()
        assert (out / "index.html").read_text(encoding="utf-8") == content
        for name in ("gains", "convex", "claims"):
            table = Path("studies") / name / "results.csv"
            assert (out / table).read_bytes() == (folder / table).read_bytes()
        for picture in (folder / "figures").iterdir():
            assert (out / "figures" / picture.name).read_bytes() == picture.read_bytes(), picture.name

    def test_nothing_is_done_after_ctrl_c(self, tmp_path):
        studying.begun(tmp_path / "out", TINY)
        stopped = means()
        stopped.stop.requested = True
        with pytest.raises(studying.Stopped):
            studying.studied(tmp_path / "out", TINY, stopped)

    def test_other_folders_are_left_alone(self, tmp_path):
        (tmp_path / "mine.txt").write_text("mine")
        with pytest.raises(InputError, match="not empty, and what is in it is no study of the paper"):
            studying.begun(tmp_path, TINY)
        (tmp_path / "paper.json").write_text("[]")
        with pytest.raises(InputError, match="is no study of the paper"):
            studying.begun(tmp_path, TINY)

    def test_quick_and_full_do_not_mix(self, tmp_path):
        studying.begun(tmp_path / "out", TINY)
        studying.begun(tmp_path / "out", TINY)
        with pytest.raises(InputError, match="holds the quick study, but the full one was asked for"):
            studying.begun(tmp_path / "out", replace(TINY, name="full"))


class TestTables:
    def test_a_row_for_each_law(self, material):
        rows = law_rows(material.claims)
        assert [row.key for row in rows] == list(ORDER)
        for row in rows:
            gap = material.claims.of(row.key, "gap")
            assert row.gap.estimate == pytest.approx(np.median(gap))
            assert row.quartiles[0] <= row.gap.estimate <= row.quartiles[1]
            assert 0.0 <= row.touched <= 1.0
            assert np.isnan(row.stuck) == row.key.startswith("rpf")

    def test_a_row_for_each_map(self, material):
        rows = map_rows(material.claims, material.references)
        assert [row.map for row in rows] == ["blocks-a", "generated-1"]
        here = [scenario.map == "blocks-a" for scenario in material.claims.scenarios]
        assert rows[0].gaps["lloyd"] == pytest.approx(np.median(material.claims.of("lloyd", "gap")[here]))
        assert rows[0].reference == material.references["blocks-a"].mean_distance


class TestWords:
    def test_what_is_said_of_figures_is_what_they_show(self, material):
        first = studying.first_record()
        for case, numbers in (("convex", (2, 3)), ("a", (4, 5)), ("b", (6, 7))):
            final = material.figures[f"{case}/rapf"].history.mean_distance[-1]
            assert f"{final:.3f} m" in seen(numbers[0], material.figures, first)
            assert re.search(
                r"RAPF's is the lower one \S+ % of the time", seen(numbers[1], material.figures, first)
            )
        assert "robots are" in seen(8, material.figures, first)
        assert "“Pentagon”" in seen(1, material.figures, first)

    def test_a_cost_has_arrived_when_it_stays(self, material):
        history = material.figures["a/rapf"].history
        time = arrival(history)
        later = history.mean_distance[history.time >= time]
        assert (np.abs(later / later[-1] - 1.0) <= 0.05).all()
        assert time in history.time


class _Tags(HTMLParser):
    def __init__(self, content: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(content)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def of(self, *names):
        return [attributes for tag, attributes in self.found if tag in names]


class TestPage:
    def test_claims_are_listed_as_they_were_promised(self, folder, content, material):
        claims = json.loads((folder / "claims.json").read_text())
        assert len(claims) == 15
        for claim in claims:
            assert {"claim", "verdict", "estimate", "interval", "runs"} <= set(claim)
            assert claim["verdict"] == "undecided"  # on two maps nothing is decided
            assert claim["claim"] in content.replace("&#39;", "'")
        assert {claim["question"] for claim in claims} == set(QUESTIONS)
        found = compared(material.claims, "rapf-shared", "rpf-shared")
        assert found is not None
        shared = next(claim for claim in claims if claim["key"] == "nonconvex-final-shared")
        assert shared["estimate"] == found[0].ratio.estimate
        assert shared["interval"] == [found[0].ratio.low, found[0].ratio.high]

    def test_every_picture_is_there_and_said_in_words(self, folder, content):
        images = _Tags(content).of("img")
        assert len(images) == 13
        for image in images:
            assert (folder / str(image["src"])).is_file()
            assert len(str(image["alt"])) > 20
            assert int(str(image["width"])) in (1050, 2148)
        for link in [*_Tags(content).of("a"), *_Tags(content).of("source")]:
            target = str(link.get("href") or link.get("srcset"))
            if not target.startswith("#"):
                assert (folder / target).is_file(), target
        for number in range(1, 9):
            for suffix in ("png", "svg", "pdf"):
                assert (folder / "figures" / f"figure-{number}.{suffix}").stat().st_size > 1000

    def test_links_lead_somewhere_and_ids_are_unique(self, content):
        tags = _Tags(content)
        ids = [str(attributes["id"]) for _, attributes in tags.found if "id" in attributes]
        assert len(ids) == len(set(ids))
        for _, attributes in tags.found:
            for target in (attributes.get("href"), f"#{attributes.get('aria-labelledby')}"):
                if target and target.startswith("#") and target != "#None":
                    assert target[1:] in ids

    def test_it_asks_for_no_network(self, content):
        for _, attributes in _Tags(content).found:
            for name, value in attributes.items():
                assert name == "xmlns" or not re.match(r"(?:https?:)?//", str(value)), value
        assert "@import" not in content and "url(" not in content

    def test_it_has_a_heading_of_each_rank_in_turn(self, content):
        ranks = [int(tag[1]) for tag, _ in _Tags(content).found if re.fullmatch(r"h\d", tag)]
        assert ranks[0] == 1 and ranks.count(1) == 1
        assert all(after - before <= 1 for before, after in pairwise(ranks))

    def test_it_tells_all_that_is_needed_to_do_it_again(self, content):
        for words in ("0.02 s", "6 s each", "101, 102", "k_rep 1, rho_0 2", "Errata"):
            assert words in content.replace("\N{NO-BREAK SPACE}", " ")

    def test_the_same_runs_give_the_same_page(self, study):
        first = studying.first_record()
        _, material, content, images = study
        claims = asked(material.convex, material.claims, material.gains)
        assert page(TINY, images, material.figures, first, material, claims) == content

    @pytest.mark.skipif(not (shutil.which("chromium") and shutil.which("chromedriver")), reason="no browser")
    @pytest.mark.parametrize("width", [390, 1280])
    def test_in_a_browser(self, folder, content, width):
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service

        options = Options()
        options.binary_location = str(shutil.which("chromium"))
        for argument in (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
        ):
            options.add_argument(argument)
        metrics = {"width": width, "height": 900, "pixelRatio": 1.0}
        options.add_experimental_option("mobileEmulation", {"deviceMetrics": metrics})
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        try:
            browser.get((folder / "index.html").as_uri())
            assert browser.execute_script("return document.documentElement.scrollWidth") <= width
            broken = browser.execute_async_script(
                "const done = arguments[0], images = [...document.images];"
                "Promise.all(images.map(image => {image.loading = 'eager'; return image.decode()"
                ".then(() => null, () => image.src)})).then(found => done(found.filter(Boolean)))"
            )
            assert broken == []
            assert (
                browser.execute_script("return document.querySelectorAll('.robocov-replay canvas').length")
                > 0
            )
            assert browser.get_log("browser") == []
        finally:
            browser.quit()
