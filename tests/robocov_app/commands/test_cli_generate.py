"""`robocov generate`: single maps, folders of maps, the maps of the paper's study, and invalid options."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from command_calls import COMMAND, read_error, read_json

from robocov.generator import GENERATORS, generate_map
from robocov.mapfile import dump_map, list_bundled_maps, load_map
from robocov_app.cli import main
from robocov_app.commands.maps.generate import KindName
from robocov_app.replication.design.plan import FAMILIES, QUICK
from robocov_app.replication.design.study_maps import (
    build_claim_maps,
    build_convex_maps,
    build_tuning_maps,
)


def test_every_kind_of_map_can_be_generated() -> None:
    assert KindName.__args__ == tuple(GENERATORS)  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", GENERATORS)
def test_a_map_is_printed_or_saved(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    expected = generate_map(5, kind=kind)
    assert main(["generate", "--kind", kind, "--seed", "5"]) == 0
    output = capsys.readouterr()
    assert (output.out, output.err) == (dump_map(expected), "")
    json.loads(output.out)
    out = tmp_path / "map.json"
    assert main(["generate", "--kind", kind, "--seed", "5", "-o", str(out)]) == 0
    assert load_map(out) == expected
    assert capsys.readouterr().out.startswith(f"{out}: ")


def test_every_option_is_passed_to_the_generator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "map.json"
    arguments = "--kind rooms --seed 3 --obstacles 8 --area 0.15 --gap 0.7 --width 12 --height 9"
    summary = read_json(capsys, "generate", *arguments.split(), "--out", str(out))
    expected = generate_map(3, kind="rooms", obstacles=8, area=0.15, gap=0.7, width=12, height=9)
    assert load_map(out) == expected
    assert summary["out"] == str(out)
    (generated,) = summary["maps"]
    assert generated["file"] == str(out)
    assert generated["area_m2"] == 108.0
    assert generated["narrowest_gap_m"] >= 0.7
    assert generated["warnings"] == []
    assert main(["generate", "--side", "8", "--out", str(out), "--overwrite"]) == 0
    assert load_map(out) == generate_map(0, side=8.0)


def test_several_maps_are_saved_in_a_folder_with_an_overview_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new" / "maps"
    sheet = tmp_path / "sheet.png"
    arguments = ["generate", "--kind", "mazes", "--count", "4", "--seed", "8", "--out", str(folder)]
    assert main([*arguments, "--plot", str(sheet), "--theme", "dark"]) == 0
    output = capsys.readouterr()
    assert output.err.startswith("generating: 4 of 4 in ")
    assert len(output.out.splitlines()) == 4
    names = ["mazes-08.json", "mazes-09.json", "mazes-10.json", "mazes-11.json"]
    assert sorted(path.name for path in folder.iterdir()) == names
    for seed, name in enumerate(names, start=8):
        assert load_map(folder / name) == generate_map(seed, kind="mazes")
    assert sheet.read_bytes().startswith(b"\x89PNG")
    assert read_error(capsys, *arguments).startswith(
        f"{folder}: the folder is not empty; choose another --out or"
    )


def test_overwriting_replaces_only_maps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["generate", "--count", "2", "--out", str(tmp_path), "--overwrite"]
    other = tmp_path / "other.json"
    mine = tmp_path / "polygons-1.json"
    other.write_text("mine")
    assert main([*arguments, "--gap", "0.5"]) == 0
    assert main(arguments) == 0
    assert load_map(tmp_path / "polygons-1.json") == generate_map(1)
    capsys.readouterr()
    mine.write_text("{}")
    assert main(arguments) == 2
    assert f"{mine}: is not a map of robocov, and --overwrite does not replace it" in capsys.readouterr().err
    assert (other.read_text(), mine.read_text()) == ("mine", "{}")


@pytest.mark.slow
def test_the_maps_of_the_paper_are_generated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = read_json(capsys, "generate", "--study", "quick", "--out", str(tmp_path))["maps"]
    study_maps = [*build_claim_maps(QUICK), *build_tuning_maps(QUICK), *build_convex_maps(QUICK)]
    maps = {each.name: each.environment for each in study_maps}
    generated = {name: environment for name, environment in maps.items() if name not in list_bundled_maps()}
    polygon_maps = len(QUICK.generated) + len(QUICK.tuning) + len(QUICK.convex_generated)
    other_maps = len(FAMILIES) * (len(QUICK.families) + len(QUICK.tuning_families))
    assert len(generated) == polygon_maps + other_maps
    assert [Path(row["file"]).stem for row in rows] == list(generated)
    for name, environment in generated.items():
        assert load_map(tmp_path / f"{name}.json") == environment
    # The options in the file generate the same map, except for its starts.
    parameters = generated["generated-2"].extra["generator"]
    arguments = [f"--{name}={parameters[name]}" for name in ("kind", "seed", "obstacles", "area")]
    out = tmp_path / "again.json"
    read_json(
        capsys,
        "generate",
        *arguments,
        f"--gap={parameters['gap_m']}",
        f"--side={parameters['width_m']}",
        "-o",
        str(out),
    )
    assert load_map(out).obstacles == generated["generated-2"].obstacles


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "--kind mases",
            "--kind: expected polygons, blocks, rooms, mazes or caves, got 'mases'",
        ),
        ("--seed -1", "--seed: expected a whole number of at least 0, got -1"),
        ("--seed x", "--seed: expected a whole number, got 'x'"),
        ("--obstacles 0", "--obstacles: expected a whole number from 1 to 100000, got 0"),
        ("--area 2", "--area: expected a number from 0.01 to 0.9, got 2.0"),
        ("--area nan", "--area: expected a number from"),
        ("--area 0.8", "--area: found no 10 x 10 m layout of 6 obstacles with a blocked fraction of 0.8"),
        ("--gap 0.1", "--gap: expected a number from 0.21 to 3.33333, got 0.1"),
        ("--side 0", "--side: expected a number from 1 to 1000, got 0.0"),
        ("--width 5", "--width: requires --height"),
        ("--height 5", "--height: requires --width"),
        ("--width 5 --height 2000", "--height: expected a number from 1 to 1000, got 2000.0"),
        ("--side 5 --width 5 --height 5", "--side: cannot be combined with --width and --height, got 5"),
        ("--count 0 --out maps", "--count: expected a number from 1 to 10000, got 0"),
        ("--count 3", "--out: --count and --study require a folder for the maps"),
        ("--study full", "--out: --count and --study require a folder for the maps"),
        (
            "--study full --gap 0.7 --out maps",
            "--gap: cannot be combined with --study, which gives its value; got 0.7",
        ),
        (
            "--study full --count 3 --out maps",
            "--count: cannot be combined with --study, which gives its value; got 3",
        ),
        ("--study half", "--study: expected full or quick, got 'half'"),
        ("--plot sheet.gif", "sheet.gif: expected .png, .svg or .pdf, got suffix '.gif'"),
        ("--plot none/sheet.png", "none/sheet.png: cannot be written: there is no folder none"),
        ("--out .", "--out: expected the name of a file (--count makes a folder), got '.'"),
        ("--out none/map.json", "none/map.json: cannot be written: No such file or directory"),
    ],
)
def test_invalid_options_are_reported_by_name(
    arguments: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert read_error(capsys, "generate", *arguments.split()).startswith(message)
    assert not list(tmp_path.iterdir())


def test_the_seed_without_a_layout_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--count", "2", "--seed", "4", "--area", "0.8", "--out", str(tmp_path / "maps")]
    assert main(["generate", *arguments]) == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith("or another number of obstacles (seed 4)")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--seed -1", "--seed: expected a whole number of at least 0, got -1"),
        ("--width 5 --height 5000", "--height: expected a number from 1 to 1000, got 5000.0"),
    ],
)
def test_errors_that_do_not_depend_on_the_seed_do_not_name_it(
    arguments: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "maps")
    assert main(["generate", "--count", "2", "--out", out, *arguments.split()]) == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith(message)


def test_an_existing_file_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "map.json"
    file.write_text("mine")
    assert "already exists; choose another --out or pass --overwrite" in read_error(
        capsys, "generate", "-o", str(file)
    )
    assert file.read_text() == "mine"
    assert "cannot be used for maps: " in read_error(
        capsys, "generate", "--count", "2", "-o", str(file / "x")
    )


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.slow
def test_ctrl_c_keeps_finished_maps(tmp_path: Path) -> None:
    arguments = ["generate", "--kind", "caves", "--count", "5000", "--out", str(tmp_path / "maps")]
    process = subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 60
    while len(list(tmp_path.glob("maps/caves-*.json"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "robocov: stopped"
    files = sorted(tmp_path.glob("maps/*"))
    assert len(files) >= 2
    for file in files:
        assert load_map(file).name.startswith("caves ")
    assert not list(tmp_path.glob("maps/.*"))
