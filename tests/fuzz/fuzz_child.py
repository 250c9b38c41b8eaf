"""The process in which inputs are read: it may hang, die or eat its memory, and only it.

A line of JSON on its input says what to read; a line on its output says what came of it.
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

MEMORY = 800_000_000
"""Bytes of addresses that a case may take beside what the process has before."""


class WrongError(AssertionError):
    """Something came of an input that may not."""


def main() -> None:
    """Answer until there is nothing more to read."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints goes elsewhere
    _load()
    _limit()
    print(json.dumps({"outcome": "ready"}), file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=answers, flush=True)


def answer(job: dict[str, Any]) -> dict[str, Any]:
    """Return what comes of reading a file: a map, a refusal in one line, or what should not be."""
    from robocov.errors import RobocovError

    began = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                found = {"outcome": "read", "words": _READ[job["kind"]](Path(job["file"]), job)}
            except RobocovError as error:
                _require_one_line(str(error))
                found = {"outcome": "refused", "words": str(error)}
    except MemoryError as error:
        found = _build_finding("memory", error)
    except (Exception, SystemExit) as error:
        found = _build_finding("error", error)
    return {**found, "seconds": time.process_time() - began}


def _build_finding(kind: str, error: BaseException) -> dict[str, Any]:
    """Return a finding, with the place in the project's own code that it comes from."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "robocov" in frame.filename] or frames
    place = f"{Path(ours[-1].filename).name}:{ours[-1].name}" if ours else ""
    return {
        "outcome": kind,
        "words": f"{type(error).__name__}: {error}"[:500],
        "signature": f"{kind}-{type(error).__name__}-{place}",
        "traceback": "".join(traceback.format_exception(error))[-8000:],
    }


def _require_one_line(message: str) -> None:
    if not message.isprintable() or not message or len(message) > 2000:
        raise WrongError(f"expected a message of one line: {message[:300]!r}")


def _require_map(environment: Any) -> str:
    """Check that a map is one that can be saved and loaded again."""
    from robocov.environment import Environment
    from robocov.mapfile import dump_map, from_json, parse_map, to_json
    from robocov.mapfile.check import check_map

    if not isinstance(environment, Environment):
        raise WrongError(f"expected a map: {type(environment).__name__}")
    if from_json(to_json(environment)) != environment:
        raise WrongError("the map is another one after it was written and read")
    text = dump_map(environment)
    if dump_map(parse_map(text, "again")) != text:
        raise WrongError("the text of the map is another one after it was read and written")
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
    """Import the folder that a file is in, or an archive."""
    return _import(path if path.suffix == ".zip" else path.parent, job)


def _map(path: Path, job: dict[str, Any]) -> str:
    from robocov.mapfile import load_map

    return _require_map(load_map(path))


def _study(path: Path, job: dict[str, Any]) -> str:
    from robocov_app.sweep.study_file import read_study

    study = read_study(path)
    return f"{len(study.maps)} maps, {len(study.controllers)} controllers"


def _check(path: Path, job: dict[str, Any]) -> str:
    from robocov_app.cli import main as command

    out = io.StringIO()
    err = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = command(["check", str(path), *job["options"].get("words", ())])
    lines = err.getvalue().splitlines()
    if status not in (0, 2) or any(not line.startswith("robocov: error: ") for line in lines):
        raise WrongError(f"status {status}: {err.getvalue()[-1500:]}")
    if "--json" in job["options"].get("words", ()):
        (row,) = json.loads(out.getvalue())["maps"]
        if row["valid"] != (status == 0):
            raise WrongError(f"status {status}, but valid is {row['valid']}")
    elif (status == 2) != bool(lines):
        raise WrongError(f"status {status} with {len(lines)} errors")
    return "valid" if status == 0 else "invalid"


def _misbehave(path: Path, job: dict[str, Any]) -> str:
    """Do what a file says: what the harness must find."""
    from robocov.errors import MapError

    word = path.read_text().strip()
    if "hang" in word:
        time.sleep(3600)
    if "crash" in word:
        os.abort()
    if "memory" in word:
        bytearray(100 * MEMORY)
    if "lines" in word:
        raise MapError("one\ntwo")
    if "warning" in word:
        warnings.warn("something is odd", RuntimeWarning, stacklevel=1)
    if "refused" in word:
        raise MapError(f"{path.name}: refused")
    if "error" in word:
        raise KeyError(word)
    return "fine"


_READ = {
    "import": _import,
    "folder": _import_folder,
    "map": _map,
    "study": _study,
    "check": _check,
    "misbehaving": _misbehave,
}


def _load() -> None:
    """Load what reading needs, so that neither time nor memory for that counts."""
    import robocov_app.commands.maps.check
    import robocov_app.formats
    import robocov_app.sweep.study_file  # noqa: F401


def _limit() -> None:
    """Bound the memory of this process where the system can."""
    try:
        import resource
    except ImportError:
        return
    now = 0
    with contextlib.suppress(OSError, ValueError, StopIteration):
        status = Path("/proc/self/status").read_text().splitlines()
        now = 1024 * int(next(line for line in status if line.startswith("VmSize")).split()[1])
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, now + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
