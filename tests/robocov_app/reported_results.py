"""Results for the tests of reports: synthetic ones in memory, or saved ones in folders."""

from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from drawn_run import ROOMS, SQUARE

from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.metrics import CostHistory, compute_cost_history, summarize
from robocov.record import Record
from robocov.team import Team
from robocov_app.report.results.result import (
    METRIC_NAMES,
    Gains,
    ReportedResult,
    ReportedRun,
    ResultKind,
    TeamParameters,
)
from robocov_app.runs.execution import Run, save_numbers
from robocov_app.runs.saved_runs import SavedRun
from robocov_app.terminal.output import replace_non_finite, write_json

HOSTILE = "</script><!--\u2028'\"><img src=x onerror=alert(1)>&amp;{{7*7}}"
"""A name that would add elements and scripts to a page that did not escape it."""

LABELS = {"rapf": "RAPF", "rpf": "RPF", "lloyd": "Lloyd"}


def build_record(
    environment: Environment = ROOMS,
    *,
    controller: str = "rapf",
    label: str | None = None,
    robots: int = 4,
    seconds: float = 6.0,
    hz: float = 10.0,
    seed: int = 0,
    gains: dict[str, float | None] | None = None,
) -> Record:
    """Return a synthetic record, in which each robot moves along an arc between two free positions."""
    start = environment.start("spread").sample(robots, seed)
    end = environment.start("spread").sample(robots, seed + 1000)
    time = np.arange(round(seconds * hz) + 1) / hz
    fraction = (time / max(seconds, 1e-9))[:, None, None]
    bend = np.random.default_rng(seed).normal(size=(1, robots, 2)) * 0.4
    positions = start + (end - start) * fraction + bend * np.sin(np.pi * fraction)
    low = environment.region.vertices.min(axis=0)
    high = environment.region.vertices.max(axis=0)
    positions = np.clip(positions, low + 0.1, high - 0.1)
    unknown = np.full_like(positions, np.nan)
    return Record(
        environment=environment,
        team=Team.homogeneous(robots),
        controller=controller,
        label=LABELS.get(controller, controller) if label is None else label,
        gains={} if gains is None else gains,
        start="spread",
        seed=seed,
        dt=1.0 / hz,
        time=time,
        positions=positions,
        velocities=np.zeros_like(positions),
        forces=np.zeros_like(positions),
        goals=unknown if controller == "rpf" else np.broadcast_to(end, positions.shape).copy(),
        obstacle_points=unknown,
    )


def build_history(record: Record, final: float, hz: float = 10.0) -> CostHistory:
    """Return a synthetic cost that falls from 6 m to `final`, m."""
    time = record.time[:: max(round(1.0 / record.dt / hz), 1)]
    if time[-1] != record.time[-1]:
        time = np.append(time, record.time[-1])
    duration = max(float(time[-1]), 1e-9)
    distance = final + (6.0 - final) * (1.0 - time / duration) ** 2
    return CostHistory(time, distance, 50.0 * distance, np.zeros_like(time))


def build_run(
    controller: str = "rapf",
    seed: int = 0,
    final: float | None = 2.0,
    *,
    map_name: str = "rooms",
    robots: int = 4,
    gains: Gains = (),
    team: TeamParameters = (),
    start: str | None = "spread",
    error: str | None = None,
    **metrics: float | None,
) -> ReportedRun:
    """Return a run of a result."""
    all_metrics = dict.fromkeys(METRIC_NAMES) | {"mean_distance_m": final, "contacts": 0} | metrics
    properties = (map_name, controller, robots, start, seed, gains, team)
    folder_name = "-".join(map(str, properties)).replace("/", "-")
    return ReportedRun(
        map=map_name,
        controller=controller,
        label=LABELS.get(controller, controller),
        robots=robots,
        team=team,
        start=start,
        seed=seed,
        gains=gains,
        metrics={} if error else all_metrics,
        error=error,
        folder=Path(folder_name),
    )


def build_result(
    runs: list[ReportedRun],
    *,
    kind: ResultKind = "sweep",
    loaded: dict[Path, SavedRun] | None = None,
    maps: dict[str, Environment] | None = None,
    expected_count: int | None = None,
    gain_units: dict[str, str] | None = None,
) -> ReportedResult:
    """Return a result with these runs."""
    return ReportedResult(
        kind=kind,
        folder=Path("study"),
        runs=tuple(runs),
        maps=dict.fromkeys((run.map for run in runs), ROOMS) if maps is None else maps,
        expected_count=len(runs) if expected_count is None else expected_count,
        gain_units=gain_units or {},
        gain_meanings={},
        facts={"duration_s": 6.0, "dt_s": 0.1, "lattice": 16},
        loaded=loaded or {},
    )


def build_recorded_result(
    runs: list[ReportedRun], environment: Environment = ROOMS, **options: float
) -> ReportedResult:
    """Return a result whose runs have synthetic records and costs, with options of `build_record`."""
    loaded = {}
    for run in runs:
        if run.error is not None:
            continue
        record = build_record(
            environment,
            controller=run.controller,
            label=run.label,
            robots=run.robots,
            seed=run.seed or 0,
            **options,
        )
        final = 2.0 if np.isnan(run.final_distance) else run.final_distance
        loaded[run.folder] = SavedRun(run.folder, record, build_history(record, final))
    return build_result(runs, loaded=loaded, maps=dict.fromkeys((run.map for run in runs), environment))


def save_run(folder: Path, record: Record) -> Run:
    """Write the folder of a run with its real cost."""
    folder.mkdir(parents=True)
    history = compute_cost_history(record, CoverageCost(record.environment, 16), 5.0)
    run = Run(record, history, summarize(record, history))
    save_numbers(run, folder, 16)
    return run


def save_comparison(folder: Path, controllers: tuple[str, ...] = ("rapf", "rpf")) -> None:
    """Write the folder of a comparison."""
    runs = {}
    for controller in controllers:
        runs[controller] = save_run(folder / controller, build_record(SQUARE, controller=controller))
    rows = [{"controller": controller, **run.summary} for controller, run in runs.items()]
    content = {"format": "robocov-comparison", "version": 1, "folders": list(runs), "runs": rows}
    write_json(folder / "comparison.json", replace_non_finite(content))


class Page(HTMLParser):
    """A parsed page: its elements with their attributes, its texts and its scripts.

    Raises AssertionError if tags are not nested correctly or attributes are repeated.
    """

    VOID = frozenset("area base br col embed hr img input link meta source track wbr".split())

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.scripts: list[str] = []
        self.open_tags: list[str] = []
        self.feed(html)
        self.close()
        assert self.open_tags == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        assert len(dict(attributes)) == len(attributes), (tag, attributes)
        self.elements.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open_tags.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open_tags, tag
        assert self.open_tags.pop() == tag

    def handle_data(self, data: str) -> None:
        is_script = bool(self.open_tags) and self.open_tags[-1] in ("script", "style")
        if is_script:
            self.scripts.append(data)
        else:
            self.texts.append(data)

    def find_all(self, tag: str) -> list[dict[str, str | None]]:
        """Return the attributes of all elements with a tag."""
        return [attributes for name, attributes in self.elements if name == tag]
