"""Fuzz whatever reads files of others: every importer, map files, study files, `robocov check`.

    python tests/fuzz/importers.py --minutes 10 svg dxf

reads changed seeds and documents made by rule, ten minutes for each format, in a process of their own.
(It needs what the tests need: `pip install --editable ".[test]"`.)
What may come of one is a valid map, or one line that says why not, within seconds and a bounded memory.
Everything else is a finding: it is made as small as can be, and saved with its traceback.
"""

import argparse
import hashlib
import json
import re
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from fuzz_mutations import mutate
from fuzz_reading import SECONDS, Job, Outcome, Reader
from fuzz_seeds import SEEDS, Case
from fuzz_shrinking import shrink

MOST_KEPT = 300
"""Cases that are kept to make others from, of those that were read, and of those that were refused."""

_FROM_READ = 0.6
"""Part of the cases that are made from one that was read."""

_BATCH = 100
"""Cases that are made one way before the other way has its turn."""

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


_MOSTLY = {"picture": "cell", "svg": "scale"}
"""Options without which the seeds would be refused."""


def list_targets() -> list[str]:
    """Return what can be fuzzed: every importer, and what the project's own formats are read by."""
    from robocov_app.formats import IMPORTERS

    return ["map", "study", "check", *IMPORTERS]


def build_usual_job(target: str) -> Job:
    """Return how the seeds of a target are read."""
    if target in ("map", "study", "check"):
        return Job(target)
    if target == "imdf":
        return Job("folder", target)
    return Job("import", target, {_MOSTLY[target]: 0.5} if target in _MOSTLY else {})


def draw_job(target: str, random: Random) -> Job:
    """Return how a case of a target is read; options are the usual ones mostly."""
    if target in ("map", "study"):
        return Job(target)
    if target == "check":
        return Job(target, options={"words": ["--json"]} if random.random() < 0.3 else {})
    from robocov_app.formats import IMPORTERS

    options = {
        name: random.choice(_OPTIONS[name])
        for name in sorted(IMPORTERS[target].options)
        if name in _OPTIONS and random.random() < (0.9 if _MOSTLY.get(target) == name else 0.15)
    }
    shaping = {name: random.choice(values) for name, values in _SHAPING.items() if random.random() < 0.08}
    return Job(
        "folder" if target == "imdf" else "import",
        target if random.random() < 0.9 else None,
        options,
        shaping,
    )


@dataclass
class Tally:
    """What came of the cases of one target.

    Attributes
    ----------
    target : str
    counts : Counter of outcomes
    kinds : set of str
        What was said, of refusals without names and numbers: as many ways as there are to end.
    findings : dict of signature to (Case, Job, Outcome)
    slowest : float, s
    """

    target: str
    counts: Counter[str] = field(default_factory=Counter)
    kinds: set[str] = field(default_factory=set)
    findings: dict[str, tuple[Case, Job, Outcome]] = field(default_factory=dict)
    slowest: float = 0.0

    def note(self, case: Case, job: Job, outcome: Outcome) -> bool:
        """Count an outcome; return whether it is of a new kind."""
        self.counts[outcome.outcome] += 1
        self.slowest = max(self.slowest, outcome.seconds)
        if not outcome.good:
            self.findings.setdefault(outcome.signature, (case, job, outcome))
        kind = outcome.words
        if outcome.outcome == "refused":
            kind = re.sub(r"'[^']*'|\"[^\"]*\"|[-+\d.]+", "#", kind.partition(": ")[2])[:80]
        fresh = outcome.good and kind not in self.kinds
        self.kinds.add(kind)
        return fresh

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in sorted(self.counts.items()))
        total = sum(self.counts.values())
        ways = len(self.kinds)
        return f"{self.target:<10} {total} cases: {counts}; {ways} ways to end, slowest {self.slowest:.2f} s"


@dataclass
class Corpus:
    """Cases that others are made from.

    Attributes
    ----------
    read, refused : list of Case
        What came of them; the seeds are among the first.
    """

    read: list[Case]
    refused: list[Case] = field(default_factory=list)

    def keep(self, case: Case, outcome: Outcome, random: Random) -> None:
        """Add a case; where there are many, it takes the place of another."""
        kept = self.read if outcome.outcome == "read" else self.refused
        if len(kept) < MOST_KEPT:
            kept.append(case)
        else:
            kept[random.randrange(len(kept))] = case

    def drawn(self, random: Random) -> Case:
        """Return one of them."""
        among = self.read if random.random() < _FROM_READ or not self.refused else self.refused
        return random.choice(among)


def fuzz(target: str, reader: Reader, seed: int, enough: Callable[[Tally], bool]) -> Tally:
    """Return what comes of cases of a target, made by a seed until it is enough.

    Changed seeds and documents made by rule take turns. A case that ends in a new way is kept to make
    others from.
    """
    tally = Tally(target)
    random = Random(f"{target} {seed}")
    corpus = Corpus([*SEEDS[target]])
    for case in SEEDS[target]:
        tally.note(case, build_usual_job(target), reader.read(case, build_usual_job(target)))
    number = 0
    while not enough(tally):
        for case in (
            _generate_structured(target, seed + number)
            if number % 2
            else _generate_mutated(target, corpus, random)
        ):
            job = draw_job(target, random)
            outcome = reader.read(case, job)
            if tally.note(case, job, outcome):
                corpus.keep(case, outcome, random)
            if enough(tally):
                break
        number += 1
    return tally


def _generate_mutated(target: str, corpus: Corpus, random: Random) -> Iterator[Case]:
    for _ in range(_BATCH):
        yield mutate(corpus.drawn(random), target, corpus.read, random)


def _generate_structured(target: str, seed: int) -> list[Case]:
    """Return cases made by rule, none where there is no rule."""
    import hypothesis
    from fuzz_structures import STRUCTURES

    made: list[Case] = []
    if target in STRUCTURES:
        settings = hypothesis.settings(
            max_examples=_BATCH,
            database=None,
            deadline=None,
            derandomize=False,
            phases=[hypothesis.Phase.generate],
            suppress_health_check=list(hypothesis.HealthCheck),
        )

        def collect(case: Case) -> None:
            made.append(case)

        hypothesis.seed(seed)(settings(hypothesis.given(STRUCTURES[target])(collect)))()
    return made


def save(folder: Path, target: str, case: Case, job: Job, outcome: Outcome) -> Path:
    """Save a finding: its files, how they are read, and what came of it."""
    key = hashlib.sha256(outcome.signature.encode()).hexdigest()[:8]
    place = folder / target / f"{outcome.outcome}-{key}"
    place.mkdir(parents=True, exist_ok=True)
    for name, content in case.files.items():
        (place / name).write_bytes(content)
    how = {"files": list(case.files), "job": vars(job), "signature": outcome.signature}
    (place / "finding.json").write_text(json.dumps(how, indent=1))
    (place / "finding.txt").write_text(f"{outcome.signature}\n{outcome.words}\n\n{outcome.traceback}")
    return place


def read_saved(place: Path) -> tuple[Case, Job]:
    """Return a finding that was saved."""
    how = json.loads((place / "finding.json").read_text())
    return Case({name: (place / name).read_bytes() for name in how["files"]}), Job(**how["job"])


def main(words: list[str] | None = None) -> int:
    """Fuzz, save what was found, and return 1 where that is anything."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("formats", nargs="*", metavar="FORMAT", help="by default all")
    parser.add_argument("--minutes", type=float, default=1.0, help="for each format (1)")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="by default another one each time")
    parser.add_argument("--out", type=Path, default=Path("fuzz-findings"), help="folder for findings")
    parser.add_argument(
        "--again",
        type=Path,
        nargs="+",
        metavar="FINDING",
        help="read these saved findings again, and no more",
    )
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, help=f"of a processor for a case ({SECONDS:g})"
    )
    given = parser.parse_args(words)
    known = list_targets()
    for name in given.formats:
        if name not in known:
            parser.error(f"unknown format {name!r} (known: {', '.join(known)})")
    warnings.simplefilter("ignore")
    found = 0
    with Reader(given.seconds) as reader:
        for place in given.again or ():
            outcome = reader.read(*read_saved(place))
            print(f"{outcome.outcome:<8} {place}\n    {outcome.words.partition(chr(10))[0]}", flush=True)
            found += not outcome.good
        if given.again:
            return 1 if found else 0
        for target in given.formats or known:
            if target not in SEEDS:
                print(f"{target:<10} has no seeds", flush=True)
                found += 1
                continue
            tally = _fuzz_for(target, reader, given.seed, 60.0 * given.minutes)
            print(f"{tally}  (seed {given.seed})", flush=True)
            for case, job, outcome in tally.findings.values():
                small = _shrink(case, job, outcome, reader)
                place = save(given.out, target, small, job, outcome)
                print(f"  {outcome.outcome}: {outcome.words.partition(chr(10))[0]}\n    {place}", flush=True)
                found += 1
    return 1 if found else 0


def _shrink(case: Case, job: Job, outcome: Outcome, reader: Reader) -> Case:
    def fails(smaller: Case) -> bool:
        return reader.read(smaller, job).signature == outcome.signature

    return shrink(case, fails, 30.0)


def _fuzz_for(target: str, reader: Reader, seed: int, seconds: float) -> Tally:
    deadline = time.monotonic() + seconds
    return fuzz(target, reader, seed, lambda _: time.monotonic() > deadline)


if __name__ == "__main__":
    sys.exit(main())
