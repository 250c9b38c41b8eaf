"""Reads hostile files in a process of its own, and measures the time for each and the memory for all.

    python hostile_files.py FILE ...

prints a JSON object: for each file its CPU seconds and what was printed, and by how many MB the peak of the
memory grew.
"""

import importlib
import json
import sys
import time
from pathlib import Path


def read_peak_mb() -> float:
    """Return the most memory that this process has had, in MB; 0 where that is not known."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def main(paths: list[str]) -> None:
    from robocov.errors import RobocovError
    from robocov_app.formats import IMPORTERS, ReadOptions, detect_format, files

    importlib.import_module("pyproj")  # imported in advance: its memory does not count for files
    importlib.import_module("ezdxf")
    for suffix in ("svg", "wkt"):
        warm = Path(paths[0]).with_name(f"warm.{suffix}")
        warm.write_text(
            "POLYGON((0 0,9 0,9 9,0 9,0 0))" if suffix == "wkt" else "<svg><path d='M0 0h9v9z'/></svg>"
        )
        detect_format(warm).read(warm, ReadOptions(scale=1.0))
    before = read_peak_mb()
    answer = {}
    for name in paths:
        path = Path(name)
        begin = time.process_time()
        try:
            named = [kind for kind in IMPORTERS.values() if path.suffix in kind.suffixes]
            known = (kind for kind in IMPORTERS.values() if kind.sniff(path, files.read_head(path)))
            chosen = next(known, named[0])
            options = ReadOptions(scale=1.0) if "scale" in chosen.options else ReadOptions()
            chosen.read(path, options)
            message = "taken"
        except RobocovError as error:
            message = str(error)
        answer[path.name] = (time.process_time() - begin, message)
    print(json.dumps({"files": answer, "grown_mb": read_peak_mb() - before}))


if __name__ == "__main__":
    main(sys.argv[1:])
