"""`robocov paper`."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from robocov.errors import InputError, checked, counted
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.interruption import INTERRUPTED

if TYPE_CHECKING:
    from robocov_app.replication.figures import Shown
    from robocov_app.replication.studying import Forecast, Means
    from robocov_app.replication.verdicts import Claim


_MOST_WORKERS = 1024


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
    """A small study of three to four minutes, to see that all is well; the full one takes an hour or more."""
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
            checked("--workers", self.workers, 1, _MOST_WORKERS)
        chosen = [option for option, wanted in self._parts().items() if wanted]
        if len(chosen) > 1:
            raise InputError(f"{chosen[0]} and {chosen[1]}: one of them was wanted")

    def _parts(self) -> dict[str, bool]:
        return {
            "--figures-only": self.figures_only,
            "--without-beyond": self.without_beyond,
            "--beyond-only": self.beyond_only,
        }

    @property
    def part(self) -> str:
        """The option that says which part is wanted, with a space before it; empty where all is."""
        return "".join(f" {option}" for option, wanted in self._parts().items() if wanted)


def command(options: Arguments) -> int:
    """Run the study and write all that comes of it."""
    from robocov_app.replication.asking import asked
    from robocov_app.replication.beyond import forecast_beyond, studied_beyond
    from robocov_app.replication.beyond_writing import beyond_claims, save_beyond_page, save_beyond_pictures
    from robocov_app.replication.plan import FULL, QUICK
    from robocov_app.replication.studying import (
        Means,
        Stopped,
        begun,
        first_record,
        forecast,
        studied,
        studied_figures,
        together,
    )
    from robocov_app.replication.writing import save_claims, save_page, save_pictures
    from robocov_app.sweep.executors import processors
    from robocov_app.terminal.interruption import Interruption
    from robocov_app.terminal.output import finite

    plan = QUICK if options.quick else FULL
    out, quiet = options.out, options.json
    begun(out, plan)
    workers = options.workers or processors()
    claims: Sequence[Claim] = ()
    more: Sequence[Claim] = ()
    material = beyond = None
    wanted = plan.beyond is not None and not (options.figures_only or options.without_beyond)
    alone = options.beyond_only
    with Interruption() as stop:
        means = Means(workers, options.scheduler, quiet, stop, options.keep_versions)
        if not quiet:
            expected = [forecast(out, plan, workers, figures_only=options.figures_only or alone)]
            if wanted:
                expected.append(forecast_beyond(out, plan, workers, alone=alone))
            _announce(together(expected), plan.name, means)
        try:
            runs: Mapping[str, Shown]
            if options.figures_only or alone:
                runs = studied_figures(out, plan, means)
            else:
                material = studied(out, plan, means)
                runs = material.figures
                claims = asked(material.convex, material.claims, material.gains)
                save_claims(out, claims)
            if wanted:
                beyond = studied_beyond(out, plan, means, material)
                more = beyond_claims(beyond)
                save_claims(out, [*claims, *more])
            first = first_record()
            images = save_pictures(out, runs, first, material, quiet=quiet)
            if beyond is not None:
                save_beyond_page(out, save_beyond_pictures(out, beyond, quiet=quiet), beyond)
            save_page(out, plan, images, runs, first, material, claims, more)
        except Stopped:
            return _stopped(options)
    failed = (material.failed if material else 0) + (beyond.failed if beyond else 0)
    if options.json:
        answer = {
            "out": str(out),
            "plan": plan.name,
            "interrupted": False,
            "runs": (material.runs if material else len(runs)) + (beyond.runs if beyond else 0),
            "failed": failed,
            "page": str(out / "index.html"),
            "claims": [claim.to_json() for claim in (*claims, *more)],
        }
        print(json.dumps(finite(answer)))
        return int(failed > 0)
    if claims or more:
        print_claims((*claims, *more))
    written = ["index.html", *["beyond.html"] * wanted, *["claims.json"] * bool(claims or more)]
    print(f"saved in {out}/: {', '.join(written)}, figures/, studies/")
    if failed:
        print(f"{counted(failed, 'run')} failed: the column error in studies/*/results.csv says why")
    return int(failed > 0)


def print_claims(claims: Sequence[Claim]) -> None:
    """Print the verdicts for people."""
    from robocov_app.terminal.tables import BOLD, RIGHT, print_table

    fold = {"overflow": "fold"}
    print_table(
        [("claim", fold), ("verdict", BOLD), ("measured", fold), ("runs", RIGHT)],
        (
            (
                claim.claim,
                claim.verdict,
                f"{claim.criteria[0].text}: {claim.criteria[0].found}" if claim.criteria else "–",
                str(claim.runs),
            )
            for claim in claims
        ),
    )


def _announce(forecast: Forecast, name: str, means: Means) -> None:
    from robocov_app.sweep.sweeping import duration

    if forecast.left == 0:
        words = f"all {forecast.runs:,} runs are there"
    else:
        there = (
            f", {forecast.runs - forecast.left:,} of them there already"
            if forecast.left < forecast.runs
            else ""
        )
        each = ", ".join(f"{law} {seconds:.2f} s" for law, seconds in forecast.each.items())
        if means.scheduler:
            long = f"about {duration(forecast.seconds * means.workers)} of computing, on a Dask cluster"
        else:
            long = f"about {duration(forecast.seconds)} on {means.workers} processes"
        words = f"{forecast.runs:,} runs{there}, {long} (measured: {each} a run); Ctrl-C keeps what is done"
    sys.stderr.write(f"paper ({name}): {words}\n")
    sys.stderr.flush()


def _stopped(options: Arguments) -> int:
    if options.json:
        print(json.dumps({"out": str(options.out), "interrupted": True}))
    else:
        quick = " --quick" if options.quick else ""
        print(f"stopped; to go on: robocov paper --out {options.out}{quick}{options.part}")
    return INTERRUPTED
