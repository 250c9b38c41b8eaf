"""`robocov sweep`."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from robocov.errors import ParameterError, format_count, require_number
from robocov.optional_imports import import_optional
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED
from robocov_app.terminal.output import print_answer

FAILED = 1


@dataclass
class Arguments(JsonOption):
    """Many runs in parallel: every combination of what a study file lists, each done once.

    The folder holds results.csv, one row a run, and a folder of each run.
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
    parquet: bool = False
    """Write the table as results.parquet too (pip install "robocov[parquet]")."""
    retry_failed: bool = False
    """Do runs again that have failed."""
    keep_versions: bool = False
    """Use runs that other versions of robocov, numpy, scipy, shapely or pymunk have done."""
    dry_run: bool = False
    """Count the runs, do one, estimate time and disk space for all, and write nothing."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024)
            if self.scheduler is not None:
                raise ParameterError("--workers: cannot be combined with --scheduler")


def command(options: Arguments) -> int:
    if options.parquet:
        import_optional("pyarrow", "parquet")
    from robocov_app.sweep.executors import Cluster, processors
    from robocov_app.sweep.study_file import read_study
    from robocov_app.sweep.sweeping import duration, rehearsed, sweep

    study, out = read_study(options.study), options.out or Path(options.study.stem)
    again: dict[str, Any] = {"retry_failed": options.retry_failed, "keep_versions": options.keep_versions}
    if options.dry_run:
        workers = options.workers or processors()
        if options.scheduler is not None:
            with Cluster(options.scheduler) as cluster:
                workers = max(1, cluster.threads)
        rehearsal = rehearsed(study, out, workers=workers, **again)
        lines = [f"{name:<20} {count:>7}" for name, count in rehearsal.axes.items()]
        done = rehearsal.runs - rehearsal.left
        lines += [f"{'runs':<20} {rehearsal.runs:>7}" + f"   ({done} of them done already)" * bool(done)]
        lines += rehearsal.notes
        if rehearsal.error is not None:
            lines += [f"the run that was tried, {rehearsal.run}, failed: {rehearsal.error}"]
        each, all_ = rehearsal.bytes_a_run / 1e3, rehearsal.bytes / 1e6
        lines += [f"a run takes {rehearsal.seconds_a_run:.2f} s and {each:.0f} kB"]
        words = f"{duration(rehearsal.seconds)} on {format_count(workers, 'worker')}; {all_:.0f} MB in all"
        lines += [f"all that is left: about {words}"]
        print_answer(options, {"out": str(out), "workers": workers, **asdict(rehearsal)}, *lines)
        return 0
    where: dict[str, Any] = {"workers": options.workers, "scheduler": options.scheduler}
    how: dict[str, Any] = {**where, **again, "parquet": options.parquet, "quiet": options.json}
    totals, runs = sweep(study, out, **how), len(study)
    lines = [f"{totals.done} runs done" + f", {totals.reused} were there already" * bool(totals.reused)]
    if totals.failed:
        lines += [f"{totals.failed} of {runs} runs failed:"]
        lines += [f"  {run}: {error}" for run, error in totals.errors.items()]
        lines += ["--retry-failed does them again; the column error says why each has failed"]
    if len(totals.versions) > 1:
        lines += ["the table has runs of different versions:"]
        lines += [f"  {count} of {versions}" for versions, count in totals.versions.items()]
    if totals.interrupted:
        rest = runs - totals.done - totals.failed - totals.reused
        lines += [f"stopped, {rest} runs are left: the same command goes on; what was done is in {out}/"]
        if not totals.table_replaced:
            lines += ["the table stays as it was: it is replaced when all runs are done"]
    else:
        parquet = out / "results.parquet"
        lines += [f"the table is {out / 'results.csv'}" + f", and as Parquet {parquet}" * parquet.exists()]
    print_answer(options, {"out": str(out), "runs": runs, **asdict(totals)}, *lines)
    return INTERRUPTED if totals.interrupted else FAILED if totals.failed else 0
