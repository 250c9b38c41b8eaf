"""`robocov check` reports issues with their lines and checks maps again when they are saved."""

import json
import os
import pty
import select
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from command_calls import COMMAND

from robocov.mapfile import list_bundled_maps
from robocov_app.cli import main
from robocov_app.commands.maps import check

GOOD = """{
  "format": "robocov-map", "version": 1,
  "name": "hall",
  "boundary": [[0, 0], [10, 0], [10, 6], [0, 6]],
  "obstacles": [
    {"kind": "circle", "center": [5, 3], "radius": 1},
    {"kind": "circle", "center": [2, 2], "radius": 0.5}
  ]
}
"""
BAD = GOOD.replace('"radius": 1}', '"radius": -1}').replace('[2, 2], "radius"', '[2], "raduis"')


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.json"
    path.write_text(GOOD)
    return path


def test_each_issue_gets_a_line(map_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    map_file.write_text(BAD)
    assert main(["check", str(map_file), "rooms"]) == 2
    output = capsys.readouterr()
    lines = output.err.splitlines()
    assert len(lines) == 4
    assert lines[0].startswith(f"robocov: error: {map_file}:6:52: obstacles[0].radius: expected a number")
    assert lines[1].startswith(
        f"robocov: error: {map_file}:7:5: obstacles[1].radius: missing, expected a number"
    )
    assert lines[2].startswith(f"robocov: error: {map_file}:7:34: obstacles[1].center: expected a point")
    assert lines[3].startswith(
        f"robocov: error: {map_file}:7:39: obstacles[1]: unknown key 'raduis': did you"
    )
    assert output.out.startswith("rooms: valid\n")


def test_json_output_contains_lines_and_columns(map_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    map_file.write_text(BAD)
    assert main(["check", str(map_file), str(map_file.parent / "none.json"), "--json"]) == 2
    invalid, missing = json.loads(capsys.readouterr().out)["maps"]
    assert (invalid["line"], invalid["column"]) == (7, 39)
    assert invalid["error"].startswith(f"{map_file}:7:39: obstacles[1]: unknown key")
    assert "(and 3 more issues)" in invalid["error"]
    second = invalid["issues"][1]
    assert {key: second[key] for key in ("path", "line", "column")} == {
        "path": "obstacles[0].radius",
        "line": 6,
        "column": 52,
    }
    assert second["text"].startswith("obstacles[0].radius: expected a number")
    assert invalid["issues_not_listed"] == 0
    assert missing["line"] is None
    assert missing["issues"] == []
    assert missing["error"] == f"{map_file.parent / 'none.json'}: no such file"


@pytest.mark.parametrize(("count", "summary"), [(30, "and 10 more issues"), (21, "and 1 more issue")])
def test_issues_beyond_the_limit_are_counted(
    map_file: Path, capsys: pytest.CaptureFixture[str], count: int, summary: str
) -> None:
    map_file.write_text(GOOD.replace("[0, 6]]", "[0, 6]" + ", [1]" * count + "]"))
    assert main(["check", str(map_file)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 21
    assert lines[-1] == f"robocov: error: {map_file}: {summary}"


def simulate_saves(*steps: Any) -> Any:
    """Return a replacement of `watch_files` that yields the first file after each step."""

    def watch_files(paths: list[Path]) -> Iterator[tuple[Path, ...]]:
        yield tuple(paths)
        for step in steps:
            step()
            yield (paths[0],)

    return watch_files


def test_changes_since_the_last_valid_map_are_marked(
    map_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = [
        lambda: map_file.write_text(GOOD.replace("[5, 3]", "[5, 4.9]")),
        lambda: map_file.write_text(BAD),
        lambda: map_file.write_text(GOOD.replace("0.5}", "0.7}")),
    ]
    monkeypatch.setattr(check, "watch_files", simulate_saves(*steps))
    assert main(["check", "--watch", str(map_file), "square"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    blocks = output.out.split(": valid")
    assert len(blocks) == 5
    assert "was" not in blocks[1] and "  area " in blocks[2]
    assert "narrowest passage  0.100 m, between" in blocks[3] and ", was 1.500 m, between" in blocks[3]
    assert "warning            the gap between" in blocks[3] and "cannot pass (new)" in blocks[3]
    assert f"{map_file}: invalid\n{map_file}:6:52: obstacles[0].radius: expected a number" in blocks[3]
    assert ", was 0.100 m, between" in blocks[4] and "no longer          the gap between" in blocks[4]
    assert "free area          55.3" in blocks[4]


def test_watching_prints_one_json_object_per_check(
    map_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(check, "watch_files", simulate_saves(lambda: map_file.write_text(BAD)))
    assert main(["check", "--watch", str(map_file), "square", "--json"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(row["map"], row["valid"]) for row in rows] == [
        (str(map_file), True),
        ("square", True),
        (str(map_file), False),
    ]
    assert rows[2]["line"] == 7


def test_the_file_of_a_bundled_map_is_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    watched: list[Path] = []
    monkeypatch.setattr(check, "watch_files", lambda paths: watched.extend(paths) or iter(()))
    assert main(["check", "--watch", "rooms", "no such", "there/none.json"]) == 0
    assert watched == [list_bundled_maps()["rooms"], Path("no such"), Path("there/none.json")]


def read_until(stream: int, expected: bytes, seconds: float = 30.0) -> bytes:
    """Read a stream until it contains some bytes."""
    content = b""
    deadline = time.monotonic() + seconds
    while expected not in content:
        remaining = deadline - time.monotonic()
        assert remaining > 0, content
        if select.select([stream], [], [], remaining)[0]:
            content += os.read(stream, 65536)
    return content


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("terminal", [False, True])
@pytest.mark.slow
def test_a_replaced_file_is_checked_until_ctrl_c(map_file: Path, terminal: bool) -> None:
    open_pair = pty.openpty if terminal else os.pipe
    reader, writer = open_pair()
    process = subprocess.Popen(
        [*COMMAND, "check", "--watch", str(map_file)], stdout=writer, stderr=subprocess.PIPE, text=True
    )
    os.close(writer)
    try:
        first = read_until(reader, b"Press Ctrl+C to stop" if terminal else b"narrowest passage")
        assert (b"\x1b[2J" in first) == terminal
        start = time.monotonic()
        replacement = map_file.with_suffix(".new")
        replacement.write_text(BAD)
        replacement.replace(map_file)
        output = read_until(reader, b"missing, expected")
        assert time.monotonic() - start < 10.0
        assert b"mine.json:6:52: obstacles[0].radius: expected a number" in output
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()
        os.close(reader)
    assert process.returncode == 130
    assert errors == "robocov: stopped\n"


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.slow
def test_watching_takes_little_processor_time(map_file: Path) -> None:
    with subprocess.Popen(
        [*COMMAND, "check", "--watch", str(map_file)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        read_until(process.stdout.fileno(), b"narrowest passage")
        before = _read_processor_seconds(process.pid)
        time.sleep(2.0)
        used = _read_processor_seconds(process.pid) - before
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
    assert used < 0.2


def _read_processor_seconds(pid: int) -> float:
    """Return the processor time that a process has used, s."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        pytest.skip("needs /proc")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
