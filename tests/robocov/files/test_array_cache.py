"""The cache of arrays: damaged files, limited size and concurrent writers."""

from __future__ import annotations

import multiprocessing
import os
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from property_examples import count_examples

from robocov.files.array_files import ArrayCache

arrays = st.dictionaries(
    st.text("abcdefgh_", min_size=1, max_size=8),
    npst.arrays(
        st.sampled_from([np.float64, np.intp, np.int32, np.bool_]),
        npst.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5),
    ),
    max_size=4,
)
SOME = {"corner": np.arange(7), "length": np.array([[1.5, np.inf], [np.nan, -0.0]])}


def require_equal(one, other):
    assert sorted(one) == sorted(other)
    for name, array in one.items():
        assert array.dtype == other[name].dtype
        assert array.shape == other[name].shape
        assert array.tobytes() == other[name].tobytes()


@settings(max_examples=count_examples(60))
@given(arrays)
def test_saved_arrays_are_loaded_bit_for_bit(tmp_path_factory, given_arrays):
    cache = ArrayCache(tmp_path_factory.mktemp("cache"))
    cache.save("entry", given_arrays)
    loaded = cache.load("entry")
    require_equal(given_arrays, loaded)
    assert not any(array.flags.writeable for array in loaded.values())
    assert len(list(cache.folder.iterdir())) == 1


def test_arrays_that_were_not_saved_are_missing(tmp_path):
    assert ArrayCache(tmp_path / "nowhere").load("entry") is None
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("cut", [0, 1, 16, 17, 33, 40, 0.5, 0.9, -1])
def test_a_truncated_file_counts_as_missing_and_is_removed(tmp_path, cut):
    cache = ArrayCache(tmp_path)
    cache.save("entry", SOME)
    (path,) = tmp_path.iterdir()
    data = path.read_bytes()
    path.write_bytes(data[: int(cut * len(data)) if isinstance(cut, float) else cut])
    assert cache.load("entry") is None
    assert not path.exists()
    cache.save("entry", SOME)
    require_equal(cache.load("entry"), SOME)


def test_a_file_with_any_wrong_byte_counts_as_missing(tmp_path):
    cache = ArrayCache(tmp_path)
    cache.save("entry", {"a": np.arange(3)})
    (path,) = tmp_path.iterdir()
    data = path.read_bytes()
    for offset in range(len(data)):
        path.write_bytes(data[:offset] + bytes([data[offset] ^ 1]) + data[offset + 1 :])
        assert cache.load("entry") is None


def test_objects_are_not_unpickled(tmp_path):
    cache = ArrayCache(tmp_path)
    cache.save("entry", {"a": np.array([print], dtype=object)})
    assert cache.load("entry") is None


def test_a_folder_that_cannot_be_written_is_not_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        cache = ArrayCache(folder)
        cache.save("entry", SOME)
        assert cache.load("entry") is None


def test_the_least_recently_used_file_is_removed_beyond_the_limit(tmp_path):
    one = {"a": np.zeros(1000)}
    cache = ArrayCache(tmp_path, max_bytes=30_000)
    for number, key in enumerate(["old", "used", "newer"]):
        cache.save(key, one)
        (tmp_path / f"{key}.robocov").touch()
        os.utime(tmp_path / f"{key}.robocov", (number, number))
    assert cache.load("old") is not None  # This makes it the newest.
    cache.save("newest", one)
    assert [cache.load(key) is not None for key in ("old", "used", "newer", "newest")] == [
        True,
        False,
        True,
        True,
    ]
    cache.save("too large", {"a": np.zeros(4000)})
    assert cache.load("too large") is None
    assert cache.load("newest") is not None


def test_abandoned_temporary_files_are_removed_after_a_day(tmp_path):
    cache = ArrayCache(tmp_path)
    stale = tmp_path / ".a.1.part.robocov"
    fresh = tmp_path / ".b.2.part.robocov"
    foreign = tmp_path / "mine.txt"
    for path in (stale, fresh, foreign):
        path.write_text("")
    os.utime(stale, (time.time() - 90_000,) * 2)
    cache.save("entry", SOME)
    assert [path.exists() for path in (stale, fresh, foreign)] == [False, True, True]


def _write(folder, value):
    cache = ArrayCache(folder)
    for _ in range(30):
        cache.save("entry", {"a": np.full(20_000, value)})


@pytest.mark.slow
def test_concurrent_writers_leave_a_complete_entry(tmp_path):
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=_write, args=(tmp_path, value)) for value in (1.0, 2.0)]
    for writer in writers:
        writer.start()
    cache = ArrayCache(tmp_path)
    while any(writer.is_alive() for writer in writers):
        loaded = cache.load("entry")
        if loaded is not None:
            assert len(set(loaded["a"].tolist())) == 1
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    assert len(cache.load("entry")["a"]) == 20_000


def test_keys_differ_for_different_values_and_types():
    keys = [
        ArrayCache.compute_key(*parts)
        for parts in ([1], [1.0], ["1"], [b"1"], [1, 1], [11], ["1", ""], [0.1 + 0.2], [0.3], [-0.0], [0.0])
    ]
    assert len(set(keys)) == len(keys)
    assert ArrayCache.compute_key("a", 0.5, b"x") == ArrayCache.compute_key("a", 0.5, b"x")


def test_the_default_folder_can_be_changed_or_switched_off(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path / "there"))
    assert ArrayCache.open_default().folder == tmp_path / "there"
    monkeypatch.setenv("ROBOCOV_CACHE", "")
    assert ArrayCache.open_default() is None
    monkeypatch.delenv("ROBOCOV_CACHE")
    assert "robocov" in str(ArrayCache.open_default().folder)
