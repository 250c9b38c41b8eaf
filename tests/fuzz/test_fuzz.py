"""A short part of the fuzzing of `importers.py`, and that it finds what it is there for."""

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

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="waits for pipes as POSIX does")]

FEW = {"dxf": 60}
"""Cases of formats whose libraries are slow."""


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    with Reader() as reading:
        yield reading


def test_everything_that_reads_files_of_others_has_seeds() -> None:
    assert set(SEEDS) == set(importers.list_targets())


@pytest.mark.parametrize("target", SEEDS)
def test_every_seed_is_read(target: str, reader: Reader) -> None:
    for case in SEEDS[target]:
        outcome = reader.read(case, importers.build_usual_job(target))
        assert outcome.outcome == "read", f"{outcome.words}\n{outcome.traceback}"


@pytest.mark.parametrize("target", SEEDS)
def test_nothing_comes_of_some_inputs_but_maps_and_refusals(
    target: str, reader: Reader, tmp_path: Path
) -> None:
    many = FEW.get(target, 220)
    tally = importers.fuzz(target, reader, 0, lambda tally: sum(tally.counts.values()) >= many)
    for case, job, outcome in tally.findings.values():
        place = importers.save(tmp_path, target, case, job, outcome)
        print(f"{place}\n{outcome.signature}\n{outcome.words}\n{outcome.traceback}")
    assert not tally.findings
    assert sum(tally.counts.values()) == many
    assert len(tally.kinds) > 1


# The harness finds what it is there for


def read_word(word: str, reader: Reader) -> Outcome:
    return reader.read(Case({"word.txt": word.encode()}), Job("misbehaving"))


@pytest.mark.parametrize(
    ("word", "outcome", "words"),
    [
        ("fine", "read", "fine"),
        ("refused", "refused", "word.txt: refused"),
        ("error", "error", "KeyError: 'error'"),
        ("warning", "error", "RuntimeWarning: something is odd"),
        ("lines", "error", "WrongError: expected a message of one line"),
        ("memory", "memory", "MemoryError"),
        ("crash", "crash", "status -6"),
    ],
)
def test_what_may_not_be_is_found(word: str, outcome: str, words: str, reader: Reader) -> None:
    found = read_word(word, reader)
    assert found.outcome == outcome
    assert found.words.startswith(words)
    assert found.good == (outcome in ("read", "refused")) == (not found.signature)
    # and it goes on after that
    assert read_word("fine", reader).outcome == "read"


def test_what_hangs_is_ended() -> None:
    with Reader(seconds=0.3) as reader:
        assert read_word("fine", reader).outcome == "read"
        found = read_word("hang", reader)
        assert found.outcome == "hang"
        assert read_word("fine", reader).outcome == "read"
        assert reader.started == 2


def test_the_same_fault_is_one_finding_however_often() -> None:
    tally = importers.Tally("map")
    for k in range(3):
        tally.note(Case({"a": b"x"}), Job("map"), Outcome("error", f"KeyError: {k}", "error-here"))
    assert tally.note(Case({"a": b"x"}), Job("map"), Outcome("refused", "a: name: expected a string"))
    assert not tally.note(Case({"a": b"x"}), Job("map"), Outcome("refused", "b: name: expected a string"))
    assert list(tally.findings) == ["error-here"]
    assert tally.counts == {"error": 3, "refused": 2}


def test_findings_are_made_small() -> None:
    big = Case({"plan.svg": b"line\n" * 50 + b"some <bad> words\n" + b"more\n" * 50, "beside": b"long\n" * 9})
    small = shrink(big, lambda case: b"<bad>" in case.files["plan.svg"], 10.0)
    assert small.files == {"plan.svg": b"<bad>", "beside": b""}
    assert shrink(big, lambda case: False, 10.0) == big
    assert shrink(big, lambda case: True, 0.0) == big


def test_changes_are_by_chance_and_can_be_had_again() -> None:
    for target, seeds in SEEDS.items():
        made = []
        for _ in range(2):
            random = Random(7)
            made.append([mutate(random.choice(seeds), target, seeds, random) for _ in range(40)])
        assert made[0] == made[1]
        assert sum(case not in seeds for case in made[0]) > 25
        assert all(set(case.files) in [set(seed.files) for seed in seeds] for case in made[0])


def test_a_finding_is_saved_so_that_it_can_be_read_again(tmp_path: Path) -> None:
    outcome = Outcome("error", "KeyError: 'x'", "error-KeyError-wkt.py:read", "Traceback ...")
    place = importers.save(tmp_path, "wkt", SEEDS["wkt"][0], Job("import", "wkt", {"scale": 2.0}), outcome)
    assert (place / "plan.wkt").read_bytes() == SEEDS["wkt"][0].files["plan.wkt"]
    assert importers.read_saved(place) == (SEEDS["wkt"][0], Job("import", "wkt", {"scale": 2.0}))
    assert "Traceback" in (place / "finding.txt").read_text()


def test_findings_are_read_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = []
    for word in ("fine", "error"):
        case = Case({"word.txt": word.encode()})
        places.append(importers.save(tmp_path, "map", case, Job("misbehaving"), Outcome("error", word, word)))
    assert importers.main(["--again", *map(str, places)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"read     {places[0]}"
    assert lines[2] == f"error    {places[1]}"
    assert importers.main(["--again", str(places[0])]) == 0


@pytest.mark.slow
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert importers.main(["map", "--minutes", "0.01", "--seed", "5", "--out", str(tmp_path / "found")]) == 0
    assert capsys.readouterr().out.startswith("map ")
    assert not (tmp_path / "found").exists()
    with pytest.raises(SystemExit):
        importers.main(["mapp"])
    assert "unknown format 'mapp' (known: map, study, check, " in capsys.readouterr().err
