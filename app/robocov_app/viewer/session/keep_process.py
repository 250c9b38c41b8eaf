"""The process that saves a run: ``python -m robocov_app.viewer.session.keep_process``, for a `Keeper` only.

It hears all before it begins, and then goes on to the end whatever happens to its parent.
"""

from __future__ import annotations

import traceback
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from robocov.errors import RobocovError
from robocov.files.result_folder import ResultFolder, results
from robocov_app.runs.compare import begin_comparison, folder_names, save_comparison
from robocov_app.runs.cost import built_cost
from robocov_app.runs.options import RunOptions
from robocov_app.runs.run import evaluated, save_numbers, save_pictures
from robocov_app.terminal.interruption import Interruption
from robocov_app.toolkit.worker import own_streams, receive, send
from robocov_app.viewer.session.kept import Job, Kept, Moments, NotKept, Retracing, records_of, remarks_on

if TYPE_CHECKING:
    from robocov.cost import CoverageCost
    from robocov.record import Record
    from robocov_app.runs.run import Run


def main() -> None:
    """Save one run, and say how it went."""
    source, target = own_streams()
    answer = kept(source)
    with suppress(OSError), target:  # nobody may be there any more
        if answer is not None:
            send(target, answer)


def kept(source: BinaryIO) -> Kept | NotKept | None:
    """Save what comes from a stream; None when not all came, because nobody is there any more."""
    job = receive(source)
    if job is None:
        return None
    folder = Path(job.folder)
    try:
        records = heard(job, source)
        if records is None:
            return None
        with results(folder, overwrite=False) as result:
            (_save_run if len(records) == 1 else _save_comparison)(records, result, job.lattice)
        remarks = dict.fromkeys(remark for record in records for remark in remarks_on(record))
        return Kept(tuple(remarks))
    except RobocovError as error:
        return NotKept(str(error))
    except Exception as error:
        traceback.print_exc()
        return NotKept(f"{type(error).__name__}: {error}")
    finally:
        with suppress(OSError):
            folder.rmdir()  # fails, as it should, where there is something in it


def heard(job: Job, source: BinaryIO) -> list[Record] | None:
    """Return the records that the moments make which come from a stream; None when not all come."""
    retracings = [Retracing(part, job.dt) for part in job.parts]
    count = 0
    while count < job.moments:
        moments: Moments | None = receive(source)
        if moments is None:
            return None
        for k, step in enumerate(moments.steps.tolist()):
            for pane, retracing in enumerate(retracings):
                retracing.take(step, moments.positions[pane][k], moments.velocities[pane][k])
        count += len(moments.steps)
    return records_of(job, retracings)


def _save_run(records: list[Record], result: ResultFolder, lattice: int) -> None:
    """Write what ``robocov run`` writes."""
    (record,) = records
    run, cost = _numbers(record, result, "", lattice)
    save_pictures([run], cost, result.new, RunOptions(lattice=lattice, json=True))


def _save_comparison(records: list[Record], result: ResultFolder, lattice: int) -> None:
    """Write what ``robocov compare`` writes."""
    names = folder_names([record.controller for record in records])
    begin_comparison(result.new, names)
    runs: dict[str, Run] = {}
    costs: list[CoverageCost] = []
    for name, record in zip(names, records, strict=True):
        runs[name], cost = _numbers(record, result, name, lattice)
        costs.append(cost)
    save_comparison(runs, costs[0], result.new, RunOptions(lattice=lattice, json=True))


def _numbers(record: Record, result: ResultFolder, part: str, lattice: int) -> tuple[Run, CoverageCost]:
    """Evaluate a record and write its numbers; the record first, whatever happens to its evaluation."""
    record.save(result.new / part)
    result.keep()
    cost = built_cost(record.environment, lattice, quiet=True)
    run = evaluated(record, cost, Interruption(), quiet=True)
    save_numbers(run, result.new / part, lattice)
    result.keep()
    return run, cost


if __name__ == "__main__":
    main()
