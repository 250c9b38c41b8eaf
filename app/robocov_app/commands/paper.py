"""`robocov paper`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import InputError, format_count, require_number
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import BOLD, RIGHT, echo, print_answer, print_table

if TYPE_CHECKING:
    from robocov_app.replication.claims import Claim
    from robocov_app.replication.design.plan import Plan
    from robocov_app.replication.execution.forecast import Forecast
    from robocov_app.replication.execution.runner import RunnerOptions
    from robocov_app.replication.results.study_results import BeyondResults, PaperResults

FAILED = 1
"""Exit status of a study with failed runs."""


@dataclass
class Arguments(JsonOption):
    """Draw counterparts of the paper's figures 1 to 8, and test its claims on many maps, starts and seeds.

    The folder contains index.html, a page with each figure next to the paper's claim about it and a plain
    verdict on each claim; beyond.html, with all registered controllers side by side and the questions that
    the paper leaves open; figures/ as PNG, SVG and PDF; claims.json; and studies/, all runs and their tables.
    The command first prints how long it will take. Ctrl+C keeps finished runs; the same command resumes.

    Example: robocov paper --quick --out paper
    """

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder for the results; an unfinished study in it is resumed."""
    quick: bool = False
    """Run a small study of a few minutes as a check; the full one takes two hours or more."""
    figures_only: bool = False
    """Only the figures, without the claims."""
    without_beyond: bool = False
    """Leave out the questions beyond the paper."""
    beyond_only: bool = False
    """Only the figures and the questions beyond the paper; pages and claims.json omit the paper's claims."""
    workers: int | None = None
    """Number of processes on this machine; by default one per processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers execute the runs, as in tcp://host:8786."""
    keep_versions: bool = False
    """Reuse runs of other versions of robocov, numpy, scipy, shapely or pymunk."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024)
        if len(self.selection) > 1:
            raise InputError(f"{self.selection[0]} and {self.selection[1]}: expected one of them")

    @property
    def selection(self) -> list[str]:
        """The given options that select parts of the study."""
        names = ("figures_only", "without_beyond", "beyond_only")
        return [f"--{name.replace('_', '-')}" for name in names if getattr(self, name)]

    @property
    def includes_claims(self) -> bool:
        """Whether the paper's claims are tested."""
        return not (self.figures_only or self.beyond_only)

    @property
    def includes_beyond(self) -> bool:
        """Whether the part "beyond" is included: the questions that the paper leaves open."""
        return not (self.figures_only or self.without_beyond)


@dataclass
class _Outcome:
    """Results of the selected parts of the study."""

    paper: PaperResults | None
    """Results on the paper's claims; None if these were not tested."""
    beyond: BeyondResults | None
    """Results beyond the paper; None if this part was not selected."""
    figure_runs: int
    """Number of runs for the paper's figures."""
    claims: list[Claim]
    """All claims with their verdicts."""

    @property
    def failed(self) -> int:
        """Number of failed runs in all parts."""
        return sum(results.failed for results in (self.paper, self.beyond) if results is not None)

    @property
    def runs(self) -> int:
        """Number of runs in all parts."""
        runs = self.figure_runs
        if self.paper is not None:
            runs = self.paper.runs
        if self.beyond is not None:
            runs += self.beyond.runs
        return runs


def command(options: Arguments) -> int:
    """Run `robocov paper`, and return its exit status."""
    from robocov_app.replication.design.plan import FULL, QUICK
    from robocov_app.replication.execution.forecast import forecast_study
    from robocov_app.replication.execution.runner import RunnerOptions, StudyInterrupted, open_folder
    from robocov_app.sweep.local_pool import count_processors

    plan = QUICK if options.quick else FULL
    out = options.out
    open_folder(out, plan)
    with Interruption() as interruption:
        workers = options.workers or count_processors()
        runner = RunnerOptions(
            workers=workers,
            scheduler=options.scheduler,
            quiet=options.json,
            stop=interruption,
            keep_versions=options.keep_versions,
        )
        if not options.json:
            expected = forecast_study(
                out, plan, workers, claims=options.includes_claims, beyond=options.includes_beyond
            )
            text = _describe_forecast(expected, workers, on_cluster=bool(options.scheduler))
            echo(f"paper ({plan.name}): {text}", to_stderr=True, flush=True)
        try:
            outcome = _run_study(options, plan, runner)
        except StudyInterrupted:
            return _print_interruption(options)
    _print_outcome(options, plan, outcome)
    return FAILED if outcome.failed else 0


def _describe_forecast(expected: Forecast, workers: int, *, on_cluster: bool) -> str:
    """Return the number of runs and the expected computing time as text."""
    from robocov_app.sweep.progress import format_duration

    if not expected.left:
        return f"all {expected.runs:,} runs are done"
    counts = f"{expected.runs:,} runs"
    finished = expected.runs - expected.left
    if finished:
        counts += f", {finished:,} of them already done"
    seconds_per_run = ", ".join(
        f"{name} {seconds:.2f} s" for name, seconds in expected.seconds_per_run.items()
    )
    time = f"{format_duration(expected.seconds)} on {format_count(workers, 'worker')}"
    if on_cluster:
        time = f"{format_duration(expected.seconds * workers)} of computing time on a Dask cluster"
    return f"{counts}, about {time} (measured: {seconds_per_run} per run); Ctrl+C keeps finished runs"


def _run_study(options: Arguments, plan: Plan, runner: RunnerOptions) -> _Outcome:
    """Execute the selected parts of the study, and write their claims, figures and pages.

    The parts are the paper's figures, the paper's claims, and "beyond", the questions that the paper leaves
    open.

    Raises
    ------
    robocov_app.replication.execution.runner.StudyInterrupted
        If the user interrupts the study.
    """
    from robocov_app.replication.claims import judge_beyond_claims, judge_paper_claims
    from robocov_app.replication.execution import parts
    from robocov_app.replication.figures import figure_files
    from robocov_app.replication.pages import study_pages

    out = options.out
    paper: PaperResults | None = None
    beyond: BeyondResults | None = None
    paper_claims: list[Claim] = []
    beyond_claims: list[Claim] = []
    if options.includes_claims:
        paper = parts.run_paper(out, plan, runner)
        paper_claims = judge_paper_claims(paper.convex, paper.claims, paper.limited, paper.gains)
        study_pages.write_claims(out, paper_claims)
        figure_runs = paper.figures
    else:
        figure_runs = parts.run_figures(out, plan, runner)
    if options.includes_beyond:
        beyond = parts.run_beyond(out, plan, runner, paper)
        beyond_claims = list(judge_beyond_claims(beyond))
        study_pages.write_claims(out, (*paper_claims, *beyond_claims))
    figures = figure_files.save_paper_figures(
        out, figure_runs, parts.record_partition(), paper, quiet=options.json
    )
    if beyond is not None:
        beyond_figures = figure_files.save_beyond_figures(out, beyond, quiet=options.json)
        beyond_page = study_pages.build_beyond_page(beyond_figures, beyond)
        study_pages.write_text(out / study_pages.BEYOND_PAGE_FILE, beyond_page)
    page = study_pages.build_paper_page(
        plan, figures, figure_runs, results=paper, claims=paper_claims, beyond=beyond_claims
    )
    study_pages.write_text(out / study_pages.PAGE_FILE, page)
    return _Outcome(
        paper=paper,
        beyond=beyond,
        figure_runs=sum(len(variant) for variant in figure_runs.values()),
        claims=[*paper_claims, *beyond_claims],
    )


def _print_interruption(options: Arguments) -> int:
    """Print where the results of an interrupted study are, and return the exit status."""
    message = f"Interrupted. Partial results are in {options.out}/. Run the same command to resume."
    print_answer(options, {"out": str(options.out), "interrupted": True}, message)
    return INTERRUPTED


def _print_outcome(options: Arguments, plan: Plan, outcome: _Outcome) -> None:
    """Print the verdicts, the names of the written files, and the number of failed runs."""
    if outcome.claims and not options.json:
        _print_claims(outcome.claims)
    pages = ["index.html"]
    if options.includes_beyond:
        pages.append("beyond.html")
    if outcome.claims:
        pages.append("claims.json")
    lines = [f"saved in {options.out}/: {', '.join(pages)}, figures/, studies/"]
    if outcome.failed:
        failed_runs = format_count(outcome.failed, "run")
        lines.append(f"{failed_runs} failed; see the column error in studies/*/results.csv")
    answer = {
        "out": str(options.out),
        "plan": plan.name,
        "interrupted": False,
        "runs": outcome.runs,
        "failed": outcome.failed,
        "page": str(options.out / "index.html"),
        "claims": [claim.to_json() for claim in outcome.claims],
    }
    print_answer(options, answer, *lines)


def _print_claims(claims: Sequence[Claim]) -> None:
    """Print the table of claims with their verdicts."""
    wrapped: dict[str, Any] = {"overflow": "fold"}
    rows = []
    for claim in claims:
        measured = "–"
        if claim.criteria:
            measured = f"{claim.criteria[0].measure}: {claim.criteria[0].result_text}"
        text = claim.text
        if claim.gains:
            text += f" ({claim.gains})"
        rows.append((text, claim.verdict, measured, str(claim.runs)))
    print_table([("claim", wrapped), ("verdict", BOLD), ("measured", wrapped), ("runs", RIGHT)], rows)
