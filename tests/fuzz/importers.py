"""Fuzz everything that reads foreign files: all importers, map files, study files, and `robocov check`.

    python tests/fuzz/importers.py --minutes 10 svg dxf

The command needs the test dependencies: ``pip install --editable ".[test]"``. It reads mutated seeds and
generated documents in a process of its own. An input has to give a valid map or an error message of one line,
within limits of time and memory. Everything else is a finding, which is shrunk and saved with its traceback.
"""

import argparse
import hashlib
import json
import re
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzz_mutations import mutate
from fuzz_reading import MAX_CPU_S, Job, Outcome, Reader
from fuzz_seeds import SEEDS, Case
from fuzz_shrinking import shrink

MAX_CORPUS_CASES = 300
"""Maximum number of read cases in a corpus, and of rejected ones."""

_READ_FRACTION = 0.6
"""Fraction of the mutated cases that were read before."""

_BATCH_CASES = 100
"""Number of mutated or generated cases in a batch. Batches of both alternate."""

MAX_SHRINK_S = 30.0
"""Maximum time to shrink a finding."""

_OPTIONS: dict[str, list[Any]] = {
    "cell": [0.05, 0.5, 1.0, 3.0],
    "unknown": ["obstacle", "free", "cut"],
    "threshold": [0.0, 0.2, 0.5, 1.0],
    "invert": [True, False],
    "trees": ["obstacle", "free"],
    "water": ["obstacle", "free"],
    "anywhere": [True],
    "scale": [0.001, 0.5, 1.0, 100.0],
    "units": ["meters", "degrees"],
    "thickness": [0.01, 0.2, 5.0],
    "pillar": [0.01, 0.3],
    "outlines": ["free", "solid", "nested"],
    "boundary": ["boundary", "desk", "nobody"],
    "around": [0.01, 1.0, 50.0],
    "snap": [0.0, 0.05, 1.0],
    "only": [["walls"], ["desk", "boundary"]],
    "skip": [["walls"], ["boundary"]],
    "hatches": [True],
    "level": ["0", "1", "-1", "G", "nan"],
    "free_color": [["white"], ["#c8c8c8", "black"], ["no color"], ["#fffffff"]],
    "solid_color": [["white"], ["#777"], ["rgb(1,2,3)"]],
    "ignore_color": [["black"], ["red", "rgba(0,0,0,.5)"], []],
    "color_tolerance": [0.0, 40.0, 255.0],
    "min_stroke": ["0.05", "3px", "1m", "0", "-1", "150px"],
}
_SHAPING: dict[str, list[Any]] = {
    "simplify": [0.0, 0.02, 0.5, 10.0],
    "specks": [0.01, 1.0, 100.0],
    "keep": ["all"],
    "inside": [[1.0, 1.0], [5.0, 2.0]],
    "hull": [True],
    "margin": [0.1, 2.0],
    "radius": [0.01, 0.5, 3.0],
    "default_start": ["uniform"],
}


_REQUIRED_OPTIONS = {"image": "cell", "svg": "scale"}
"""Options without which the seeds are rejected."""


def list_targets() -> list[str]:
    """Return everything that can be fuzzed: the importers, and the readers of formats of this project."""
    from robocov_app.formats import IMPORTERS

    return ["map", "study", "check", *IMPORTERS]


def build_usual_job(target: str) -> Job:
    """Return the job by which the seeds of a target are read."""
    if target in ("map", "study", "check"):
        return Job(target)
    if target == "imdf":
        return Job("folder", target)
    options = {_REQUIRED_OPTIONS[target]: 0.5} if target in _REQUIRED_OPTIONS else {}
    return Job("import", target, options)


def draw_job(target: str, random: Random) -> Job:
    """Draw the job of a case. Most of its options have their default values."""
    if target in ("map", "study"):
        return Job(target)
    if target == "check":
        is_json = random.random() < 0.3
        return Job(target, options={"arguments": ["--json"]} if is_json else {})
    from robocov_app.formats import IMPORTERS

    options = {}
    for name in sorted(IMPORTERS[target].options):
        if name not in _OPTIONS:
            continue
        probability = 0.9 if _REQUIRED_OPTIONS.get(target) == name else 0.15
        if random.random() < probability:
            options[name] = random.choice(_OPTIONS[name])
    shaping = {name: random.choice(values) for name, values in _SHAPING.items() if random.random() < 0.08}
    kind = "folder" if target == "imdf" else "import"
    is_format_known = random.random() < 0.9
    return Job(kind, target if is_format_known else None, options, shaping)


@dataclass
class Tally:
    """Outcomes of the cases of a target.

    Attributes
    ----------
    target : str
    counts : Counter
        Number of cases by outcome.
    kinds : set of str
        Distinct outcomes: descriptions, and error messages without names and numbers.
    findings : dict
        Case, job and outcome by signature.
    unread_seeds : list of Outcome
        Outcomes of the seeds that were not read.
    slowest : float, s
        Maximum time of a case.
    """

    target: str
    counts: Counter[str] = field(default_factory=Counter)
    kinds: set[str] = field(default_factory=set)
    findings: dict[str, tuple[Case, Job, Outcome]] = field(default_factory=dict)
    unread_seeds: list[Outcome] = field(default_factory=list)
    slowest: float = 0.0

    def note(self, case: Case, job: Job, outcome: Outcome) -> bool:
        """Count an outcome, and return whether it is of a new kind."""
        self.counts[outcome.outcome] += 1
        self.slowest = max(self.slowest, outcome.seconds)
        if not outcome.is_expected:
            self.findings.setdefault(outcome.signature, (case, job, outcome))
        kind = outcome.text
        if outcome.outcome == "rejected":
            kind = re.sub(r"'[^']*'|\"[^\"]*\"|[-+\d.]+", "#", kind.partition(": ")[2])[:80]
        is_new = outcome.is_expected and kind not in self.kinds
        self.kinds.add(kind)
        return is_new

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in sorted(self.counts.items()))
        total = sum(self.counts.values())
        return (
            f"{self.target:<10} {total} cases: {counts}; {len(self.kinds)} distinct outcomes, "
            f"slowest {self.slowest:.2f} s"
        )


@dataclass
class Corpus:
    """Cases to mutate.

    Attributes
    ----------
    read : list of Case
        Cases that were read, including the seeds.
    rejected : list of Case
    """

    read: list[Case]
    rejected: list[Case] = field(default_factory=list)

    def keep(self, case: Case, outcome: Outcome, random: Random) -> None:
        """Add a case. It replaces another one if the corpus is full."""
        cases = self.read if outcome.outcome == "read" else self.rejected
        if len(cases) < MAX_CORPUS_CASES:
            cases.append(case)
        else:
            cases[random.randrange(len(cases))] = case

    def draw(self, random: Random) -> Case:
        """Draw a case."""
        is_read = random.random() < _READ_FRACTION or not self.rejected
        return random.choice(self.read if is_read else self.rejected)


def fuzz(
    target: str,
    reader: Reader,
    seed: int,
    enough: Callable[[Tally], bool],
    batch_cases: int = _BATCH_CASES,
) -> Tally:
    """Read mutated and generated cases of a target until it is enough, and return their outcomes.

    Batches of mutated and of generated cases alternate. Cases with new outcomes are mutated in turn.
    """
    tally = Tally(target)
    random = Random(f"{target} {seed}")
    corpus = Corpus([*SEEDS[target]])
    for case in SEEDS[target]:
        job = build_usual_job(target)
        outcome = reader.read(case, job)
        tally.note(case, job, outcome)
        if outcome.outcome != "read":
            tally.unread_seeds.append(outcome)
    number = 0
    while not enough(tally):
        cases: Iterable[Case]
        if number % 2:
            cases = _generate_structured(target, seed + number, batch_cases)
        else:
            cases = _generate_mutated(target, corpus, random, batch_cases)
        for case in cases:
            job = draw_job(target, random)
            outcome = reader.read(case, job)
            if tally.note(case, job, outcome):
                corpus.keep(case, outcome, random)
            if enough(tally):
                break
        number += 1
    return tally


def _generate_mutated(target: str, corpus: Corpus, random: Random, count: int) -> Iterator[Case]:
    for _ in range(count):
        yield mutate(corpus.draw(random), target, corpus.read, random)


def _generate_structured(target: str, seed: int, count: int) -> list[Case]:
    """Generate cases by a hypothesis strategy, or none if the target has no strategy."""
    import hypothesis
    from fuzz_structures import STRUCTURES

    cases: list[Case] = []
    if target in STRUCTURES:
        settings = hypothesis.settings(
            max_examples=count,
            database=None,
            deadline=None,
            derandomize=False,
            phases=[hypothesis.Phase.generate],
            suppress_health_check=list(hypothesis.HealthCheck),
        )

        def collect(case: Case) -> None:
            cases.append(case)

        hypothesis.seed(seed)(settings(hypothesis.given(STRUCTURES[target])(collect)))()
    return cases


def save(folder: Path, target: str, case: Case, job: Job, outcome: Outcome) -> Path:
    """Save the files, the job and the outcome of a finding, and return its folder."""
    key = hashlib.sha256(outcome.signature.encode()).hexdigest()[:8]
    finding = folder / target / f"{outcome.outcome}-{key}"
    finding.mkdir(parents=True, exist_ok=True)
    for name, content in case.files.items():
        (finding / name).write_bytes(content)
    document = {"files": list(case.files), "job": vars(job), "signature": outcome.signature}
    (finding / "finding.json").write_text(json.dumps(document, indent=1))
    (finding / "finding.txt").write_text(f"{outcome.signature}\n{outcome.text}\n\n{outcome.traceback}")
    return finding


def read_saved(folder: Path) -> tuple[Case, Job]:
    """Read the case and the job of a saved finding."""
    document = json.loads((folder / "finding.json").read_text())
    case = Case({name: (folder / name).read_bytes() for name in document["files"]})
    return case, Job(**document["job"])


def main(arguments: list[str] | None = None) -> int:
    """Fuzz, save the findings, and return 1 if there are any."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("formats", nargs="*", metavar="FORMAT", help="formats to fuzz (default: all)")
    parser.add_argument(
        "--minutes", type=float, default=1.0, help="time for each format, min (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=int(time.time()), help="random seed (default: the time)")
    parser.add_argument("--out", type=Path, default=Path("fuzz-findings"), help="folder for findings")
    parser.add_argument(
        "--again",
        type=Path,
        nargs="+",
        metavar="FINDING",
        help="only read these saved findings again",
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=MAX_CPU_S,
        help="maximum processor time of a case, s (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    known = list_targets()
    for name in options.formats:
        if name not in known:
            parser.error(f"unknown format {name!r} (known: {', '.join(known)})")
    warnings.simplefilter("ignore")
    with Reader(options.seconds) as reader:
        if options.again:
            return 1 if _read_findings(options.again, reader) else 0
        count = 0
        for target in options.formats or known:
            count += _fuzz_target(target, reader, options)
    return 1 if count else 0


def _read_findings(folders: list[Path], reader: Reader) -> int:
    """Read saved findings again, print their outcomes, and return the number of those that remain."""
    count = 0
    for folder in folders:
        outcome = reader.read(*read_saved(folder))
        print(f"{outcome.outcome:<8} {folder}\n    {outcome.text.partition(chr(10))[0]}", flush=True)
        if not outcome.is_expected:
            count += 1
    return count


def _fuzz_target(target: str, reader: Reader, options: argparse.Namespace) -> int:
    """Fuzz a target, save the findings, and return their number."""
    if target not in SEEDS:
        print(f"{target:<10} has no seeds", flush=True)
        return 1
    deadline = time.monotonic() + 60.0 * options.minutes
    tally = fuzz(target, reader, options.seed, lambda _: time.monotonic() > deadline)
    print(f"{tally}  (seed {options.seed})", flush=True)
    for case, job, outcome in tally.findings.values():
        small = _shrink(case, job, outcome, reader)
        folder = save(options.out, target, small, job, outcome)
        print(f"  {outcome.outcome}: {outcome.text.partition(chr(10))[0]}\n    {folder}", flush=True)
    return len(tally.findings)


def _shrink(case: Case, job: Job, outcome: Outcome, reader: Reader) -> Case:
    def fails(smaller: Case) -> bool:
        return reader.read(smaller, job).signature == outcome.signature

    return shrink(case, fails, MAX_SHRINK_S)


if __name__ == "__main__":
    sys.exit(main())
