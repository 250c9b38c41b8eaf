"""`robocov sweep`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from robocov.errors import ParameterError, format_count, require_number
from robocov.files.result_names import SWEEP_PARQUET_FILE, SWEEP_TABLE_FILE
from robocov.optional_imports import import_optional
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED
from robocov_app.terminal.output import print_answer

if TYPE_CHECKING:
    from robocov_app.sweep.estimate import SweepEstimate
    from robocov_app.sweep.study.study import Study
    from robocov_app.sweep.sweeping import Totals

FAILED = 1
"""Exit status of a sweep with failed runs."""

_AXIS_LABELS = {
    "robots": "numbers of robots",
    "teams": "team settings",
    "starts": "starts, summed over maps",
}
"""Labels of the parameters of a study whose names would be misunderstood in an estimate."""


@dataclass
class Arguments(JsonOption):
    """Run every combination of the values in a study file, in parallel on all cores.

    The folder contains results.csv, with one row per run, and a folder for each run. For the same map and
    seed, all controllers start from the same positions.

    After any interruption, the same command resumes the sweep. A run is executed again if its files are
    damaged, or if the version of robocov or the code of your controller has changed since. The exit status is
    1 if runs have failed.

    A study file contains, for example:

      maps = ["rooms", "mine.json"]
      controllers = ["rapf", "rpf"]
      seeds = 20
      [gains.rapf]
      k_rep = [0.1, 1.0]

    The keys robots, starts, duration and those of [team] correspond to the options of robocov run.

    Example: robocov sweep study.toml --out study
    """

    study: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="STUDY.toml")]
    """Study file."""
    out: Path | None = None
    """Folder for the results; by default the study file's name without its suffix."""
    workers: int | None = None
    """Number of processes on this machine; by default one per processor."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers execute the runs, as in tcp://host:8786."""
    parquet: bool = False
    """Write the table as results.parquet, too (pip install "robocov[parquet]")."""
    retry_failed: bool = False
    """Repeat failed runs."""
    keep_versions: bool = False
    """Reuse runs of other versions of robocov, numpy, scipy, shapely or pymunk."""
    dry_run: bool = False
    """Count the runs, time one of each controller, estimate time and disk space, and write nothing."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            require_number("--workers", self.workers, 1, 1024)
            if self.scheduler is not None:
                raise ParameterError("--workers: cannot be combined with --scheduler")


def command(options: Arguments) -> int:
    """Run `robocov sweep`, and return its exit status."""
    if options.parquet:
        import_optional("pyarrow", "parquet")
    from robocov_app.sweep.study.study_file import read_study

    study = read_study(options.study)
    out = options.out or Path(options.study.stem)
    if options.dry_run:
        _estimate(options, study, out)
        return 0
    return _sweep(options, study, out)


def _estimate(options: Arguments, study: Study, out: Path) -> None:
    """Time one run of each controller, and print an estimate for all runs."""
    from robocov_app.sweep.estimate import estimate_sweep

    workers = _count_workers(options)
    estimate = estimate_sweep(
        study,
        out,
        workers=workers,
        retry_failed=options.retry_failed,
        keep_versions=options.keep_versions,
    )
    answer = {"out": str(out), "workers": workers, **asdict(estimate)}
    print_answer(options, answer, *_describe_estimate(estimate, workers))


def _count_workers(options: Arguments) -> int:
    """Return the number of runs that are executed in parallel."""
    from robocov_app.sweep.cluster import Cluster
    from robocov_app.sweep.local_pool import count_processors

    if options.scheduler is None:
        return options.workers or count_processors()
    with Cluster(options.scheduler) as cluster:
        return max(1, cluster.threads)


def _describe_estimate(estimate: SweepEstimate, workers: int) -> list[str]:
    """Return the estimate of a sweep as lines of text."""
    from robocov_app.sweep.progress import format_duration

    counts = {_AXIS_LABELS.get(name, name): count for name, count in estimate.axes.items()}
    counts["runs"] = estimate.runs
    width = max(len(label) for label in counts)
    lines = [f"{label:<{width}} {count:>7}" for label, count in counts.items()]
    finished = estimate.runs - estimate.left
    if finished:
        lines[-1] += f"   ({finished} of them already done)"
    lines += estimate.notes
    for controller, trial in estimate.controllers.items():
        if trial.error is not None:
            lines.append(f"the trial run of {controller}, {trial.run}, failed: {trial.error}")
    width = max(len(controller) for controller in ("controller", *estimate.controllers))
    lines.append(f"{'controller':<{width}}  runs left  s per run  kB per run")
    for controller, trial in estimate.controllers.items():
        lines.append(
            f"{controller:<{width}} {trial.left:>10} {trial.seconds_per_run:>10.2f} "
            f"{trial.bytes_per_run / 1e3:>11.0f}"
        )
    lines.append(
        f"all remaining runs: about {format_duration(estimate.seconds)} on "
        f"{format_count(workers, 'worker')}; {estimate.total_bytes / 1e6:.0f} MB in all"
    )
    return lines


def _sweep(options: Arguments, study: Study, out: Path) -> int:
    """Execute the runs of the study, print their totals, and return the exit status."""
    from robocov_app.sweep.sweeping import sweep

    totals = sweep(
        study,
        out,
        workers=options.workers,
        scheduler=options.scheduler,
        retry_failed=options.retry_failed,
        keep_versions=options.keep_versions,
        parquet=options.parquet,
        quiet=options.json,
    )
    runs = len(study)
    lines = _describe_totals(totals, runs)
    if totals.interrupted:
        lines += _describe_interruption(totals, runs, out)
    else:
        lines.append(_describe_tables(out))
    print_answer(options, {"out": str(out), "runs": runs, **asdict(totals)}, *lines)
    if totals.interrupted:
        return INTERRUPTED
    return FAILED if totals.failed else 0


def _describe_totals(totals: Totals, runs: int) -> list[str]:
    """Return the totals of a sweep as lines of text."""
    counts = f"{format_count(totals.done, 'run')} done"
    if totals.reused:
        counts += f", {totals.reused} reused"
    lines = [counts]
    if totals.failed:
        lines.append(f"{totals.failed} of {runs} runs failed:")
        lines += [f"  {run}: {error}" for run, error in totals.errors.items()]
        lines.append("--retry-failed runs them again; the column error has the reasons")
    if len(totals.versions) > 1:
        lines.append("the table has runs of different versions:")
        lines += [f"  {count} of {versions}" for versions, count in totals.versions.items()]
    return lines


def _describe_interruption(totals: Totals, runs: int, out: Path) -> list[str]:
    """Return the remaining work of an interrupted sweep as lines of text."""
    left = runs - totals.done - totals.failed - totals.reused
    lines = [
        f"Interrupted with {left} runs left. Partial results are in {out}/. Run the same command to resume."
    ]
    if not totals.table_replaced:
        lines.append("The earlier table is kept until all runs are done.")
    return lines


def _describe_tables(out: Path) -> str:
    """Return a line of text with the paths of the written tables."""
    text = f"table: {out / SWEEP_TABLE_FILE}"
    parquet = out / SWEEP_PARQUET_FILE
    if parquet.exists():
        text += f"; as Parquet: {parquet}"
    return text
