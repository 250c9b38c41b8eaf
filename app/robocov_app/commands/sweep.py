"""`robocov sweep`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import ParameterError, checked, counted
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED
from robocov_app.terminal.output import tell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov_app.sweep.sweeping import Rehearsal, Totals

FAILED = 1


@dataclass
class Arguments(JsonOption):
    """Many runs in parallel: every combination of what a study file lists, each done once.

    The folder holds results.csv and results.parquet, one row a run, and a folder of each run.
    Whatever ends a sweep, the same command goes on where it was. Runs whose files were damaged, and runs
    of other versions or of other code of your controllers, are done again. For the same map and seed every
    controller begins in the same places. The exit status is 1 when runs have failed.

    A study file: maps = ["rooms", "mine.json"], controllers = ["rapf", "rpf"], seeds = 20, and under
    [gains.rapf] k_rep = [0.1, 1.0]; robots, starts, duration and [team] as the options of robocov run.

    Example: robocov sweep study.toml --out study --dry-run
    """

    study: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="STUDY.toml")]
    """The study file."""
    out: Path | None = None
    """Folder for the results; by default the study file's name without its suffix."""
    workers: int | None = None
    """Processes on this machine; by default one a processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler, as in tcp://host:8786, whose workers do the runs."""
    retry_failed: bool = False
    """Do runs again that have failed."""
    keep_versions: bool = False
    """Use runs that other versions of robocov, numpy, scipy, shapely or pymunk have done."""
    dry_run: bool = False
    """Count the runs, do one, estimate time and disk space for all, and write nothing."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            checked("--workers", self.workers, 1, 1024)
            if self.scheduler is not None:
                raise ParameterError("--workers: those of a cluster are its own, so one of both was wanted")


def command(options: Arguments) -> int:
    from robocov_app.sweep.executors import Cluster, processors
    from robocov_app.sweep.study_file import read_study
    from robocov_app.sweep.sweeping import rehearsed, sweep

    study, out = read_study(options.study), options.out or Path(options.study.stem)
    again: dict[str, Any] = {"retry_failed": options.retry_failed, "keep_versions": options.keep_versions}
    if options.dry_run:
        workers = options.workers or processors()
        if options.scheduler is not None:
            with Cluster(options.scheduler) as cluster:
                workers = max(1, cluster.threads)
        rehearsal = rehearsed(study, out, workers=workers, **again)
        answer = {"out": str(out), "workers": workers, **asdict(rehearsal)}
        tell(options, answer, *_rehearsal_lines(rehearsal, workers))
        return 0
    where: dict[str, Any] = {"workers": options.workers, "scheduler": options.scheduler}
    totals = sweep(study, out, **where, **again, quiet=options.json)
    answer = {"out": str(out), "runs": len(study), **asdict(totals)}
    tell(options, answer, *_totals_lines(totals, len(study), out))
    return INTERRUPTED if totals.interrupted else FAILED if totals.failed else 0


def _totals_lines(totals: Totals, runs: int, out: Path) -> Iterator[str]:
    yield f"{totals.done} runs done" + f", {totals.reused} were there already" * bool(totals.reused)
    if totals.failed:
        yield f"{totals.failed} of {runs} runs failed:"
        yield from (f"  {run}: {error}" for run, error in totals.errors.items())
        yield "--retry-failed does them again; the column error says why each has failed"
    if len(totals.versions) > 1:
        yield "the table has runs of different versions:"
        yield from (f"  {count} of {versions}" for versions, count in totals.versions.items())
    if totals.interrupted:
        rest = runs - totals.done - totals.failed - totals.reused
        yield f"stopped, {rest} runs are left: the same command goes on; what was done is in {out}/"
        if not totals.table_replaced:
            yield "the table stays as it was: it is replaced when all runs are done"
    else:
        yield f"the table is {out / 'results.csv'}, and as Parquet {out / 'results.parquet'}"


def _rehearsal_lines(rehearsal: Rehearsal, workers: int) -> Iterator[str]:
    from robocov_app.sweep.sweeping import duration

    yield from (f"{name:<20} {count:>7}" for name, count in rehearsal.axes.items())
    done = rehearsal.runs - rehearsal.left
    yield f"{'runs':<20} {rehearsal.runs:>7}" + f"   ({done} of them done already)" * bool(done)
    yield from rehearsal.notes
    if rehearsal.error is not None:
        yield f"the run that was tried, {rehearsal.run}, failed: {rehearsal.error}"
    yield f"a run takes {rehearsal.seconds_a_run:.2f} s and {rehearsal.bytes_a_run / 1e3:.0f} kB"
    time, megabytes = duration(rehearsal.seconds), rehearsal.bytes / 1e6
    yield f"all that is left: about {time} on {counted(workers, 'worker')}; {megabytes:.0f} MB in all"
