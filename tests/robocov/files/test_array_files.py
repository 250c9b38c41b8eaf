"""Files of arrays: reading, and rejecting damaged or malicious ones."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from robocov.errors import InputError
from robocov.files.array_files import read_arrays

CLAIMED_BYTES = 1_600_000_000
"""Size of an array according to its header."""


def save_arrays(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def read(content: bytes, max_bytes: int = 1_000_000_000) -> dict[str, np.ndarray]:
    return read_arrays(io.BytesIO(content), "x.npz", max_bytes)


def build_header(size: int) -> bytes:
    """Return the `.npy` header of a float64 array with `size` bytes of data."""
    head = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": (size // 8,)}
    np.lib.format.write_array_header_1_0(head, header)
    return head.getvalue()


def write_zeros(path: Path, arrays: int) -> None:
    """Write an `.npz` file with arrays of zeros that really have `CLAIMED_BYTES` bytes each."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    head = packer.compress(build_header(CLAIMED_BYTES)) + packer.flush(zlib.Z_FULL_FLUSH)
    million = packer.compress(bytes(1_000_000)) + packer.flush(zlib.Z_FULL_FLUSH)
    stream = head + million * (CLAIMED_BYTES // 1_000_000) + packer.flush()
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(arrays):
            archive.writestr(f"a{k}.npy", stream + bytes(7_000_000 - len(stream)))
        for entry in archive.infolist():
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.file_size = CLAIMED_BYTES + len(build_header(CLAIMED_BYTES))


def test_files_of_numpy_are_read() -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.asfortranarray(np.eye(3)), "c": np.array([], "i4")}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    for content in (save_arrays(**arrays), buffer.getvalue()):
        loaded = read(content)
        assert list(loaded) == list(arrays)
        for name, values in arrays.items():
            np.testing.assert_array_equal(loaded[name], values)
            assert loaded[name].dtype == values.dtype


def patch_directory(content: bytes, **changes: object) -> bytes:
    """Return a zip file with changes to the last entry of its directory."""
    buffer = io.BytesIO(content)
    with zipfile.ZipFile(buffer, "a") as archive:
        for name, value in changes.items():
            setattr(archive.infolist()[-1], name, value)
        # A new comment makes `zipfile` write the directory again.
        archive.comment = b"patched"
    return buffer.getvalue()


def test_damage_without_a_message_is_named() -> None:
    # The entry claims to be longer than the file, for which `zipfile` raises an error without a message.
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("a.npy", build_header(4000))
    size = len(buffer.getvalue())
    content = patch_directory(buffer.getvalue(), compress_size=size, file_size=size)
    with pytest.raises(InputError, match=r"^x\.npz: cannot be read: EOFError$"):
        read(content)


TWO = save_arrays(a=np.zeros(20_000), b=np.ones(20_000))


def test_an_archive_is_read_after_its_directory_is_rewritten() -> None:
    assert sorted(read(patch_directory(TWO))) == ["a", "b"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not a zip file"),
        (TWO[:-30], "not a zip file"),
        (TWO[:200] + b"x" + TWO[201:], "CRC"),
        (save_arrays(a=np.array([print], dtype=object)), "Object arrays cannot be loaded"),
        (patch_directory(TWO, file_size=CLAIMED_BYTES), "arrays too large"),
        (patch_directory(TWO, file_size=150_000), "'b.npy'"),
        (patch_directory(TWO, header_offset=0, filename="a.npy"), "duplicate entry 'a'"),
        (patch_directory(TWO, compress_type=99), "compression"),
        (
            patch_directory(TWO, compress_type=zipfile.ZIP_LZMA),
            "entry 'b.npy' uses an unsupported compression method",
        ),
        (patch_directory(TWO, filename="a"), "duplicate entry 'a'"),
        (TWO.replace(b", }", b", y", 1), "EOF in multi-line statement"),
        (patch_directory(TWO, flag_bits=1), "encrypted"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_damaged_files_are_rejected_in_one_line(content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=r"^x\.npz: cannot be read: .+$") as caught:
        read(content)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -4)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (True,)}",
        "{[]: 1}",
        "{" * 60_000,
        "[]",
        "print(1)",
    ],
)
def test_invalid_headers_are_rejected(header: str) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        text = f"{header}\n".encode()
        archive.writestr("a.npy", b"\x93NUMPY\x02\x00" + len(text).to_bytes(4, "little") + text + bytes(32))
    with pytest.raises(InputError, match=r"^x\.npz: cannot be read: "):
        read(buffer.getvalue())


@pytest.mark.slow
@pytest.mark.parametrize("hostile", ["ratio", "size", "entries"])
def test_files_that_expand_to_gigabytes_are_rejected_early(tmp_path: Path, hostile: str) -> None:
    """Files of 7 and 35 MB that expand to 1.6 and 8 GB, and an archive with 250,000 entries.

    Each is read in its own process.
    """
    path = tmp_path / "x.npz"
    if hostile == "ratio":
        write_zeros(path, 1)
    elif hostile == "size":
        write_zeros(path, 5)
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("a.npy", b"")
            archive.filelist *= 250_000
    assert path.stat().st_size > 5_000_000
    script = (
        "import sys, tracemalloc\n"
        "from robocov.errors import InputError\n"
        "from robocov.files.array_files import read_arrays\n"
        "tracemalloc.start()\n"
        "try:\n"
        "    with open(sys.argv[1], 'rb') as file:\n"
        "        read_arrays(file, 'x')\n"
        "except InputError:\n"
        "    print(tracemalloc.get_traced_memory()[1])\n"
    )
    done = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 100e6
