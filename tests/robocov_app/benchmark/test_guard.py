"""The guard of controllers: channels to other processes are reported, and what Python needs is allowed."""

from __future__ import annotations

import json
import os
import py_compile
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from robocov_app.benchmark.verification import controller_process

CODE = """
import importlib.util
import json
import os
import sys
from importlib.machinery import FileFinder, SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path

from robocov.compiled import import_numba
from robocov_app.benchmark import suite
from robocov_app.benchmark.verification.guard import install_guard

import_numba()
from numba.core.caching import IndexDataCacheFile
from numba.core.ir import Loc

FOLDER = sys.argv[1]
sys.path.append(sys.argv[2])
CACHE = os.environ["NUMBA_CACHE_DIR"]
REFERENCES = str(suite.SUITE_FILE)
violations = []
readings = []

class Text(str):
    def startswith(self, *arguments):
        return True

class TwoPaths:
    calls = 0

    def __fspath__(self):
        self.calls += 1
        return REFERENCES if self.calls == 1 else os.__file__

def list_open_folder():
    folder = os.open(FOLDER, os.O_RDONLY)
    os.listdir(folder)

def list_by_import():
    FileFinder(FOLDER, (SourceFileLoader, [".py"])).find_spec("x")

def create_semaphore():
    import _multiprocessing
    _multiprocessing.SemLock(1, 1, 1, "/robocov-test", True)

def create_shared_memory():
    import _posixshmem
    _posixshmem.shm_open("/robocov-test", os.O_CREAT | os.O_RDWR, 0o600)

def create_fifo_by_posix():
    import posix
    posix.mkfifo(f"{FOLDER}/b")

def look_up_a_function():
    import ctypes
    ctypes.pythonapi.mkfifo

def open_through_a_path_object():
    import io
    io.FileIO(TwoPaths())

def read_references_in_a_folder():
    folder = os.open(Path(suite.__file__).parents[1], os.O_RDONLY)
    os.open(f"benchmark/{suite.SUITE_FILE.name}", os.O_RDONLY, dir_fd=folder)

def read_references_by_import():
    sys.path_hooks.insert(0, open)
    sys.path.insert(0, REFERENCES)
    try:
        import robocov_has_no_such_module
    except (AttributeError, ImportError):
        sys.path_importer_cache[REFERENCES].read()
    finally:
        del sys.path_hooks[0], sys.path[0]

def import_missing_module():
    try:
        import robocov_has_no_such_module
    except ImportError:
        pass

def import_invalid_module(name):
    try:
        importlib.import_module(name)
    except ImportError:
        pass

def call_if_installed(module_name, name, *arguments):
    # If the function does not exist, there is nothing to forbid.
    try:
        function = getattr(importlib.import_module(module_name), name)
    except (AttributeError, ImportError):
        violations.append("not installed")
        return
    function(*arguments)

def start_a_program():
    import _posixsubprocess
    _posixsubprocess.fork_exec()

def start_a_program_by_subprocess():
    import subprocess
    subprocess._fork_exec()

def start_a_thread():
    import threading
    threading.Thread(target=print).start()

def import_with(name, **settings):
    # Settings of sys have other values during the import.
    previous = {key: getattr(sys, key) for key in settings}
    for key, value in settings.items():
        setattr(sys, key, value)
    try:
        importlib.import_module(name)
    finally:
        for key, value in previous.items():
            setattr(sys, key, value)

ATTEMPTS = {
    "write by the cache of numba": lambda: IndexDataCacheFile(FOLDER, "a", 1).save("k", b"data"),
    "read references by numba": lambda: Loc(REFERENCES, 1).strformat(),
    "read references by a special string": lambda: open(Text(REFERENCES)),
    "read references through a path object": open_through_a_path_object,
    "read references by Python's import": read_references_by_import,
    "read references in an open folder": read_references_in_a_folder,
    "look up an open file of another process": lambda: os.stat(f"/proc/{os.getppid()}/fd/0"),
    "follow a link of another process": lambda: os.readlink(f"/proc/{os.getppid()}/cwd"),
    "look up a process below a link": lambda: os.access(f"/proc/self/root/proc/{os.getppid()}", os.R_OK),
    "create a FIFO": lambda: os.mkfifo(f"{FOLDER}/a"),
    "create a FIFO by another module": create_fifo_by_posix,
    "create a node": lambda: os.mknod(f"{FOLDER}/c"),
    "start a process group": lambda: os.setpgrp(),
    "set the priority": lambda: os.setpriority(os.PRIO_PROCESS, 0, 1),
    "set the affinity": lambda: os.sched_setaffinity(0, os.sched_getaffinity(0)),
    "create a semaphore": create_semaphore,
    "create shared memory": create_shared_memory,
    "open a process": lambda: call_if_installed("os", "pidfd_open", os.getppid()),
    "write a history": lambda: call_if_installed("readline", "write_history_file", f"{FOLDER}/d"),
    "append to a history": lambda: call_if_installed("readline", "append_history_file", 1, f"{FOLDER}/d"),
    "read a history": lambda: call_if_installed("readline", "read_history_file", f"{FOLDER}/d"),
    "read settings of a history": lambda: call_if_installed("readline", "read_init_file", f"{FOLDER}/d"),
    "open a database": lambda: call_if_installed("_gdbm", "open", f"{FOLDER}/e", "c"),
    "open another database": lambda: call_if_installed("_dbm", "open", f"{FOLDER}/f", "c"),
    "create a Tcl interpreter": lambda: call_if_installed("_tkinter", "create"),
    "load a library": lambda: call_if_installed("_cffi_backend", "load_library", None, 0),
    "write names of functions": lambda: call_if_installed("sys", "activate_stack_trampoline", "perf"),
    "start a program": start_a_program,
    "start a program by subprocess": start_a_program_by_subprocess,
    "start a thread": start_a_thread,
    "write bytecode": lambda: import_with(
        "colorsys", dont_write_bytecode=False, pycache_prefix=f"{FOLDER}/g"
    ),
    "list a folder": lambda: os.listdir(FOLDER),
    "scan a folder": lambda: os.scandir(FOLDER),
    "list an open folder": list_open_folder,
    "list a folder by Python's import": list_by_import,
    "look up a function": look_up_a_function,
    "look up files": lambda: (os.stat(FOLDER), os.readlink("/proc/self/exe"), Path(FOLDER).exists()),
    "list an installed package": lambda: os.listdir(Path(suite.__file__).parent),
    "look for installed packages": lambda: entry_points(group="robocov"),
    "look for a module": lambda: importlib.util.find_spec("robocov.no_such_module"),
    "import a missing module": import_missing_module,
    "import a module without source": lambda: importlib.import_module("robocov_test_bytecode"),
    "import an extension module": lambda: import_invalid_module("robocov_test_extension"),
    "prepare parallel loops": lambda: import_numba().set_num_threads(1),
    "write to the own cache by numba": lambda: IndexDataCacheFile(CACHE, "a", 1).save("k", b"data"),
}
install_guard(violations.append, readings.append)
found = {}
for name, attempt in ATTEMPTS.items():
    violations.clear()
    try:
        attempt()
    except PermissionError:
        pass
    found[name] = violations[:1]
print(json.dumps({"violations": found, "readings": readings}))
"""
ALLOWED = (
    "look up files",
    "list an installed package",
    "look for installed packages",
    "look for a module",
    "import a missing module",
    "import a module without source",
    "import an extension module",
    "prepare parallel loops",
    "write to the own cache by numba",
)


def build_modules_without_source(folder: Path) -> list[Path]:
    """Create a module of bytecode, and an extension module that is invalid, and return their files."""
    source = folder.parent / "robocov_test_bytecode.py"
    source.write_text("")
    bytecode = folder / "robocov_test_bytecode.pyc"
    py_compile.compile(str(source), cfile=str(bytecode))
    extension = folder / f"robocov_test_extension{EXTENSION_SUFFIXES[0]}"
    extension.write_bytes(b"")
    return [bytecode, extension]


@pytest.mark.skipif(sys.platform != "linux", reason="calls functions that only Linux has")
def test_channels_are_reported(tmp_path: Path) -> None:
    for name in ("shared", "cache", "modules"):
        (tmp_path / name).mkdir()
    modules = build_modules_without_source(tmp_path / "modules")
    process = subprocess.run(
        [sys.executable, "-c", CODE, str(tmp_path / "shared"), str(tmp_path / "modules")],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    found = json.loads(process.stdout)
    for name, violations in found["violations"].items():
        assert bool(violations) != (name in ALLOWED), (name, violations)
    assert list((tmp_path / "shared").iterdir()) == []
    # Opening a folder for reading is no violation, but is reported.
    assert str(tmp_path / "shared") in found["readings"]
    # A result does not identify modules without source code, so they are reported, too.
    assert set(map(str, modules)) <= set(found["readings"])
    assert all(reading.startswith(str(tmp_path)) for reading in found["readings"])


def test_each_process_has_a_copy_of_the_machine_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that changes its cached code does not change it for other processes."""
    shared = tmp_path / "robocov-1"
    shared.mkdir()
    (shared / "kernel.nbi").write_text("code")
    monkeypatch.setattr(controller_process, "open_cache_folder", lambda: shared)
    first, second = (controller_process._create_cache(tmp_path) for _ in range(2))
    assert first != second
    (first / "robocov-1" / "kernel.nbi").write_text("changed")
    assert (second / "robocov-1" / "kernel.nbi").read_text() == "code"
    assert (shared / "kernel.nbi").read_text() == "code"
