"""Process that reads inputs, so that only this process crashes, hangs or runs out of memory.

It reads jobs from standard input, and writes their outcomes to standard output, as a line of JSON each.
"""

import contextlib
import io
import json
import os
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

MAX_MEMORY_BYTES = 800_000_000
"""Maximum address space of a case, in addition to that of the process before."""
MAX_MESSAGE_CHARS = 2000
MAX_TEXT_CHARS = 500
MAX_TRACEBACK_CHARS = 8000


class UnexpectedEffectError(AssertionError):
    """An input has an effect that it must not have."""


def main() -> None:
    """Answer jobs until standard input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # Libraries may print to standard output, which is redirected to standard error.
    os.dup2(2, 1)
    _load()
    _limit()
    print(json.dumps({"outcome": "ready"}), file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=answers, flush=True)


def answer(job: dict[str, Any]) -> dict[str, Any]:
    """Read a file, and return the outcome: read, rejected with a message of one line, or a finding."""
    from robocov.errors import RobocovError

    start_time = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                text = _READERS[job["kind"]](Path(job["file"]), job)
                outcome = {"outcome": "read", "text": text}
            except RobocovError as error:
                _require_one_line(str(error))
                outcome = {"outcome": "rejected", "text": str(error)}
    except MemoryError as error:
        outcome = _build_finding("memory", error)
    except (Exception, SystemExit) as error:
        outcome = _build_finding("error", error)
    return {**outcome, "seconds": time.process_time() - start_time}


def _build_finding(kind: str, error: BaseException) -> dict[str, Any]:
    """Return a finding, with the innermost function of the project in its signature."""
    frames = traceback.extract_tb(error.__traceback__)
    own_frames = [frame for frame in frames if "robocov" in frame.filename] or frames
    place = ""
    if own_frames:
        place = f"{Path(own_frames[-1].filename).name}:{own_frames[-1].name}"
    return {
        "outcome": kind,
        "text": f"{type(error).__name__}: {error}"[:MAX_TEXT_CHARS],
        "signature": f"{kind}-{type(error).__name__}-{place}",
        "traceback": "".join(traceback.format_exception(error))[-MAX_TRACEBACK_CHARS:],
    }


def _require_one_line(message: str) -> None:
    if not message.isprintable() or not message or len(message) > MAX_MESSAGE_CHARS:
        raise UnexpectedEffectError(f"expected a message of one line: {message[:300]!r}")


def _require_map(environment: Any) -> str:
    """Check that a map can be saved and loaded, and return its description."""
    from robocov.environment import Environment
    from robocov.mapfile import dump_map, from_json, parse_map, to_json
    from robocov.mapfile.check import check_map

    if not isinstance(environment, Environment):
        raise UnexpectedEffectError(f"expected a map: {type(environment).__name__}")
    if from_json(to_json(environment)) != environment:
        raise UnexpectedEffectError("the map changes when it is written and read")
    text = dump_map(environment)
    if dump_map(parse_map(text, "again")) != text:
        raise UnexpectedEffectError("the text of the map changes when it is read and written")
    report = check_map(environment)
    json.dumps(report.to_dict(), allow_nan=False)
    counts = f"{report.obstacle_count} obstacles, {report.vertex_count} vertices"
    return f"{counts}, {len(report.components)} components"


def _import(path: Path, job: dict[str, Any]) -> str:
    from robocov_app.formats import ReadOptions, Shaping, import_map

    options = {
        key: tuple(value) if isinstance(value, list) else value for key, value in job["options"].items()
    }
    environment, report, _ = import_map(
        path, format=job["format"], options=ReadOptions(**options), shaping=Shaping(**job["shaping"])
    )
    json.dumps(report.to_dict(), allow_nan=False)
    for line in report.format_lines():
        _require_one_line(line)
    return _require_map(environment)


def _import_folder(path: Path, job: dict[str, Any]) -> str:
    """Import the folder of a file, or an archive."""
    return _import(path if path.suffix == ".zip" else path.parent, job)


def _map(path: Path, job: dict[str, Any]) -> str:
    from robocov.mapfile import load_map

    return _require_map(load_map(path))


def _study(path: Path, job: dict[str, Any]) -> str:
    from robocov_app.sweep.study.study_file import read_study

    study = read_study(path)
    return f"{len(study.maps)} maps, {len(study.controllers)} controllers"


def _check(path: Path, job: dict[str, Any]) -> str:
    from robocov_app.cli import main as command

    out = io.StringIO()
    err = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = command(["check", str(path), *job["options"].get("arguments", ())])
    lines = err.getvalue().splitlines()
    if status not in (0, 2) or any(not line.startswith("robocov: error: ") for line in lines):
        raise UnexpectedEffectError(f"status {status}: {err.getvalue()[-1500:]}")
    if "--json" in job["options"].get("arguments", ()):
        (row,) = json.loads(out.getvalue())["maps"]
        if row["valid"] != (status == 0):
            raise UnexpectedEffectError(f"status {status}, but valid is {row['valid']}")
    elif (status == 2) != bool(lines):
        raise UnexpectedEffectError(f"status {status} with {len(lines)} errors")
    return "valid" if status == 0 else "invalid"


def _misbehave(path: Path, job: dict[str, Any]) -> str:
    """Cause the finding that a file names, to test the harness."""
    from robocov.errors import MapError

    word = path.read_text().strip()
    if "hang" in word:
        time.sleep(3600)
    if "crash" in word:
        os.abort()
    if "memory" in word:
        bytearray(100 * MAX_MEMORY_BYTES)
    if "lines" in word:
        raise MapError("one\ntwo")
    if "warning" in word:
        warnings.warn("something is odd", RuntimeWarning, stacklevel=1)
    if "rejected" in word:
        raise MapError(f"{path.name}: rejected")
    if "error" in word:
        raise KeyError(word)
    return "fine"


_READERS = {
    "import": _import,
    "folder": _import_folder,
    "map": _map,
    "study": _study,
    "check": _check,
    "misbehaving": _misbehave,
}


def _load() -> None:
    """Import the modules that readers need, so that their time and memory are not counted."""
    import robocov_app.commands.maps.check
    import robocov_app.formats
    import robocov_app.sweep.study.study_file  # noqa: F401


def _limit() -> None:
    """Limit the memory of this process if the system supports it."""
    try:
        import resource
    except ImportError:
        return
    current_bytes = 0
    with contextlib.suppress(OSError, ValueError, StopIteration):
        status = Path("/proc/self/status").read_text().splitlines()
        size_line = next(line for line in status if line.startswith("VmSize"))
        current_bytes = 1024 * int(size_line.split()[1])
    max_bytes = current_bytes + MAX_MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (max_bytes, max_bytes))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
