"""A short run of `importers.py`, and tests of the fuzzer itself."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from random import Random

import importers
import pytest
from fuzz_mutations import mutate
from fuzz_reading import Job, Outcome, Reader
from fuzz_seeds import SEEDS, Case
from fuzz_shrinking import shrink

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name == "nt", reason="select() works with pipes on POSIX only"),
]

CASE_COUNT = 30
"""Number of cases of a format, in addition to its seeds."""
CASE_COUNTS = {"dxf": 10, "coverage-control": 10}
"""Fewer cases for formats that take long to read."""
BATCHES_PER_FORMAT = 2
"""One of mutated seeds, and one of generated documents."""


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    with Reader() as reader:
        yield reader


def test_every_target_has_seeds() -> None:
    assert set(SEEDS) == set(importers.list_targets())


@pytest.mark.parametrize("target", SEEDS)
def test_seeds_are_read_and_fuzzed_files_are_read_or_rejected(
    target: str, reader: Reader, tmp_path: Path
) -> None:
    case_count = CASE_COUNTS.get(target, CASE_COUNT)
    total_count = len(SEEDS[target]) + case_count
    tally = importers.fuzz(
        target,
        reader,
        seed=0,
        enough=lambda tally: sum(tally.counts.values()) >= total_count,
        batch_cases=case_count // BATCHES_PER_FORMAT,
    )
    for case, job, outcome in tally.findings.values():
        folder = importers.save(tmp_path, target, case, job, outcome)
        print(f"{folder}\n{outcome.signature}\n{outcome.text}\n{outcome.traceback}")
    assert not tally.unread_seeds
    assert not tally.findings
    assert sum(tally.counts.values()) == total_count
    assert len(tally.kinds) > 1


# Tests of the fuzzer


def read_misbehaving_file(word: str, reader: Reader) -> Outcome:
    """Read a file whose word makes the reading process misbehave."""
    return reader.read(Case({"word.txt": word.encode()}), Job("misbehaving"))


@pytest.mark.parametrize(
    ("word", "kind", "text"),
    [
        ("fine", "read", "fine"),
        ("rejected", "rejected", "word.txt: rejected"),
        ("error", "error", "KeyError: 'error'"),
        ("warning", "error", "RuntimeWarning: something is odd"),
        ("lines", "error", "UnexpectedEffectError: expected a message of one line"),
        ("memory", "memory", "MemoryError"),
        ("crash", "crash", "status -6"),
    ],
)
def test_unexpected_effects_are_findings(word: str, kind: str, text: str, reader: Reader) -> None:
    outcome = read_misbehaving_file(word, reader)
    assert outcome.outcome == kind
    assert outcome.text.startswith(text)
    assert outcome.is_expected == (kind in ("read", "rejected"))
    assert bool(outcome.signature) == (not outcome.is_expected)
    # Further files can be read.
    assert read_misbehaving_file("fine", reader).outcome == "read"


def test_a_hanging_process_is_restarted(reader: Reader, monkeypatch: pytest.MonkeyPatch) -> None:
    assert read_misbehaving_file("fine", reader).outcome == "read"
    start_count = reader.start_count
    monkeypatch.setattr(reader, "seconds", 0.3)
    assert read_misbehaving_file("hang", reader).outcome == "hang"
    assert read_misbehaving_file("fine", reader).outcome == "read"
    assert reader.start_count == start_count + 1


def test_findings_with_the_same_cause_are_counted_as_one() -> None:
    tally = importers.Tally("map")
    for k in range(3):
        tally.note(Case({"a": b"x"}), Job("map"), Outcome("error", f"KeyError: {k}", "error-here"))
    assert tally.note(Case({"a": b"x"}), Job("map"), Outcome("rejected", "a: name: expected a string"))
    assert not tally.note(Case({"a": b"x"}), Job("map"), Outcome("rejected", "b: name: expected a string"))
    assert list(tally.findings) == ["error-here"]
    assert tally.counts == {"error": 3, "rejected": 2}


def test_findings_are_shrunk() -> None:
    plan = b"line\n" * 50 + b"some <bad> text\n" + b"more\n" * 50
    case = Case({"plan.svg": plan, "other": b"long\n" * 9})
    shrunk = shrink(case, lambda smaller: b"<bad>" in smaller.files["plan.svg"], 10.0)
    assert shrunk.files == {"plan.svg": b"<bad>", "other": b""}
    assert shrink(case, lambda smaller: False, 10.0) == case
    assert shrink(case, lambda smaller: True, 0.0) == case


def test_mutations_are_random_and_reproducible() -> None:
    def mutate_seeds(target: str) -> list[Case]:
        random = Random(7)
        seeds = SEEDS[target]
        return [mutate(random.choice(seeds), target, seeds, random) for _ in range(40)]

    for target, seeds in SEEDS.items():
        mutated = mutate_seeds(target)
        assert mutated == mutate_seeds(target)
        assert sum(case not in seeds for case in mutated) > 25
        file_names = [set(seed.files) for seed in seeds]
        assert all(set(case.files) in file_names for case in mutated)


def test_a_saved_finding_can_be_loaded(tmp_path: Path) -> None:
    outcome = Outcome("error", "KeyError: 'x'", "error-KeyError-wkt.py:read", "Traceback ...")
    folder = importers.save(tmp_path, "wkt", SEEDS["wkt"][0], Job("import", "wkt", {"scale": 2.0}), outcome)
    assert (folder / "plan.wkt").read_bytes() == SEEDS["wkt"][0].files["plan.wkt"]
    assert importers.read_saved(folder) == (SEEDS["wkt"][0], Job("import", "wkt", {"scale": 2.0}))
    assert "Traceback" in (folder / "finding.txt").read_text()


@pytest.fixture
def shared_process(reader: Reader, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command use the process of the other tests."""
    monkeypatch.setattr(importers, "Reader", lambda seconds: contextlib.nullcontext(reader))


@pytest.mark.usefixtures("shared_process")
def test_saved_findings_are_read_again_by_an_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folders = []
    for word in ("fine", "error"):
        case = Case({"word.txt": word.encode()})
        outcome = Outcome("error", text=word, signature=word)
        folders.append(importers.save(tmp_path, "map", case, Job("misbehaving"), outcome))
    assert importers.main(["--again", *map(str, folders)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"read     {folders[0]}"
    assert lines[2] == f"error    {folders[1]}"
    assert importers.main(["--again", str(folders[0])]) == 0


@pytest.mark.usefixtures("shared_process")
def test_the_command_fuzzes_a_format_and_rejects_unknown_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert importers.main(["map", "--minutes", "0.01", "--seed", "5", "--out", str(tmp_path / "found")]) == 0
    assert capsys.readouterr().out.startswith("map ")
    assert not (tmp_path / "found").exists()
    with pytest.raises(SystemExit):
        importers.main(["mapp"])
    assert "unknown format 'mapp' (known: map, study, check, " in capsys.readouterr().err
