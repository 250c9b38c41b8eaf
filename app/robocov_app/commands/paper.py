"""`robocov paper`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from robocov.errors import InputError, format_count, require_number
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import BOLD, RIGHT, echo, print_answer, print_table


@dataclass
class Arguments(JsonOption):
    """Run the paper's figures 1 to 8 and test its claims over many maps, starts and seeds.

    The folder gets index.html, a page with every figure beside what the paper claims of it and a plain
    verdict on every claim; beyond.html, with every registered controller side by side and what the paper
    leaves to others; figures/ as PNG, SVG and PDF; claims.json; and studies/, all runs and their tables. How
    long it takes is told before it begins. Ctrl-C keeps what is done, and the same command goes
    on from there.

    Example: robocov paper --quick --out paper
    """

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder for the results; one that holds a part of the same study is gone on with."""
    quick: bool = False
    """A small study of some minutes, to see that all is well; the full one takes two hours or more."""
    figures_only: bool = False
    """Only the figures, without the claims."""
    without_beyond: bool = False
    """Leave out what goes beyond the paper."""
    beyond_only: bool = False
    """Only the figures and what goes beyond the paper: pages and claims.json leave the paper's claims out."""
    workers: int | None = None
    """Processes; by default one a processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler, as in tcp://host:8786, whose workers do the runs."""
    keep_versions: bool = False
    """Use runs that other versions of robocov, numpy, scipy, shapely or pymunk have done."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024)
        if len(self.parts) > 1:
            raise InputError(f"{self.parts[0]} and {self.parts[1]}: expected one of them")

    @property
    def parts(self) -> list[str]:
        names = ("figures_only", "without_beyond", "beyond_only")
        return [f"--{name.replace('_', '-')}" for name in names if getattr(self, name)]


def command(options: Arguments) -> int:
    from robocov_app.replication import claims, pages, results
    from robocov_app.replication.plan import FULL, QUICK
    from robocov_app.replication.results import Interrupted, RunnerOptions, forecast, open_folder
    from robocov_app.sweep.executors import processors
    from robocov_app.sweep.sweeping import duration

    plan = QUICK if options.quick else FULL
    out, quiet = options.out, options.json
    open_folder(out, plan)
    with_claims = not (options.figures_only or options.beyond_only)
    with_beyond = not (options.figures_only or options.without_beyond)
    found, more = list[Any](), tuple[Any, ...]()  # claims
    paper = beyond = None
    with Interruption() as stop:
        workers, scheduler = options.workers or processors(), options.scheduler
        runner = RunnerOptions(workers, scheduler, quiet, stop, options.keep_versions)
        if not quiet:
            expected = forecast(out, plan, workers, claims=with_claims, beyond=with_beyond)
            words, done = f"all {expected.runs:,} runs are there", expected.runs - expected.left
            if expected.left:
                there = f", {done:,} of them there already" if done else ""
                each = ", ".join(f"{law} {seconds:.2f} s" for law, seconds in expected.each.items())
                long = f"{duration(expected.seconds)} on {workers} processes"
                if scheduler:
                    long = f"{duration(expected.seconds * workers)} of computing, on a Dask cluster"
                words = f"{expected.runs:,} runs{there}, about {long} (measured: {each} a run)"
                words += "; Ctrl-C keeps what is done"
            echo(f"paper ({plan.name}): {words}", to_stderr=True, flush=True)
        try:
            if with_claims:
                paper = results.run_paper(out, plan, runner)
                found = claims.paper_claims(paper.convex, paper.claims, paper.gains)
                pages.save_claims(out, found)
            runs = paper.figures if paper else results.run_figures(out, plan, runner)
            if with_beyond:
                beyond = results.run_beyond(out, plan, runner, paper)
                more = claims.beyond_claims(beyond)
                pages.save_claims(out, (*found, *more))
            first = results.partition_record()
            images = pages.save_paper_figures(out, runs, first, paper, quiet=quiet)
            if beyond is not None:
                drawn = pages.save_beyond_figures(out, beyond, quiet=quiet)
                pages.save(out / pages.BEYOND_PAGE, pages.beyond_page(drawn, beyond))
            pages.save(out / pages.PAGE, pages.paper_page(plan, images, runs, first, paper, found, more))
        except Interrupted:
            again = " ".join(["--out", str(out), *["--quick"] * options.quick, *options.parts])
            print_answer(
                options, {"out": str(out), "interrupted": True}, f"stopped; to go on: robocov paper {again}"
            )
            return INTERRUPTED
    failed, verdicts = sum(part.failed for part in (paper, beyond) if part), (*found, *more)
    if verdicts and not quiet:
        fold, rows = {"overflow": "fold"}, []
        for claim in verdicts:
            measured = f"{claim.criteria[0].text}: {claim.criteria[0].found}" if claim.criteria else "–"
            rows.append((claim.claim, claim.verdict, measured, str(claim.runs)))
        print_table([("claim", fold), ("verdict", BOLD), ("measured", fold), ("runs", RIGHT)], rows)
    written = ["index.html", *["beyond.html"] * with_beyond, *["claims.json"] * bool(verdicts)]
    lines = [f"saved in {out}/: {', '.join(written)}, figures/, studies/"]
    if failed:
        lines += [f"{format_count(failed, 'run')} failed: the column error in studies/*/results.csv says why"]
    answer = {"out": str(out), "plan": plan.name, "interrupted": False}
    answer["runs"] = (paper.runs if paper else len(runs)) + (beyond.runs if beyond else 0)
    answer |= {"failed": failed, "page": str(out / "index.html")}
    print_answer(options, answer | {"claims": [claim.to_json() for claim in verdicts]}, *lines)
    return int(failed > 0)
