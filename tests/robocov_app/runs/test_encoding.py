import errno
import itertools
import os
import re
import stat
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from drawn_run import ROOMS, SQUARE, record_walk
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robocov.errors import OutputError, ParameterError
from robocov.metrics import CostHistory
from robocov_app.commands.options import VideoOptions
from robocov_app.runs.encoding import encode_png, find_encoder, save_frames_and_video, save_video
from robocov_app.runs.frames import draw_frames, select_frame_rows
from robocov_app.runs.settings import VideoSettings
from robocov_app.viewer.window.screen_video import ScreenVideo


def generate_frames(count, width=64, height=48):
    """Yield frames of one color each, getting lighter."""
    for k in range(count):
        yield np.full((height, width, 3), 20 * k % 256, dtype=np.uint8)


def read(path):
    """Return the film's frames and what ffmpeg says of it."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    said = done.stderr.decode()
    line = next(line for line in said.splitlines() if "Video:" in line)
    width, height = map(int, re.search(r" (\d+)x(\d+)[, ]", line).groups())
    return list(np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)), line


class TestRows:
    @given(st.integers(2, 200), st.floats(0.5, 60), st.floats(0.1, 20), st.floats(0.01, 0.5))
    def test_film_time_times_speed_is_simulated_time(self, steps, fps, speed, dt):
        time = np.arange(steps) * dt
        rows = select_frame_rows(time, fps, speed)
        wanted = np.minimum(np.arange(len(rows)) * speed / fps, time[-1])
        assert rows[0] == 0 and rows[-1] == steps - 1
        assert (np.diff(rows) >= 0).all()
        assert (time[rows] <= wanted + 1e-6).all()
        assert (time[rows[:-1]] > wanted[:-1] - dt - 1e-6).all()
        assert len(rows) - 1 == pytest.approx(time[-1] * fps / speed, abs=1.0 + 1e-6)

    def test_sums_of_steps_do_not_skip_a_row(self):
        time = np.cumsum(np.full(601, 1 / 30)) - 1 / 30
        assert select_frame_rows(time, 30).tolist() == list(range(601))

    def test_the_end_is_held(self):
        assert select_frame_rows(np.array([0.0, 1.0]), 2, hold=1.0).tolist() == [0, 0, 1, 1, 1]


class TestFrames:
    def test_as_many_as_the_run_lasts_and_lazily(self):
        record = record_walk(ROOMS, 3, steps=31)  # 3 s
        frames = draw_frames(record, VideoSettings(fps=5, speed=2), size=(160, 120))
        assert next(frames).shape == (120, 160, 3)
        assert 1 + sum(1 for _ in frames) == 9

    def test_each_shows_its_moment(self):
        record = record_walk(SQUARE, 3, steps=21)
        frames = list(draw_frames(record, VideoSettings(), size=(320, 240), rows=np.array([0, 10, 20, 20])))
        assert (frames[0] != frames[1]).any() and (frames[1] != frames[2]).any()
        assert (frames[2] == frames[3]).all()

    def test_the_cost_is_the_latest_known(self):
        record = record_walk(SQUARE, 3, steps=21)
        rows = np.array([10])

        def draw_first_frame(times, values):
            mean = np.array(values)
            cost = CostHistory(np.array(times), mean, mean, mean) if times else None
            return next(draw_frames(record, VideoSettings(), size=(480, 240), rows=rows, cost=cost)).tobytes()

        known = draw_first_frame([0.0, 1.0, 1.5], [3.0, 2.0, 1.0])
        assert known == draw_first_frame([0.9], [2.0])
        assert known != draw_first_frame([0.9], [3.0])
        assert draw_first_frame([1.5], [1.0]) == draw_first_frame([], []) == draw_first_frame([0.0], [np.nan])

    def test_the_mean_time_is_told_with_it(self):
        record = record_walk(SQUARE, 3, steps=21)
        options = {"size": (480, 240), "rows": np.array([10])}
        time = np.array([0.0])
        mean = np.array([3.0])
        histories = [CostHistory(time, mean, mean, mean, other) for other in (None, mean, 2.0 * mean)]
        frames = [
            next(draw_frames(record, VideoSettings(), cost=each, **options)).tobytes() for each in histories
        ]
        assert len(set(frames)) == 3

    def test_options_are_checked(self):
        record = record_walk(SQUARE, 3, steps=5)
        with pytest.raises(ParameterError, match="theme"):
            next(draw_frames(record, VideoSettings(theme="pink")))


@settings(deadline=None, max_examples=30)
@given(arrays(np.uint8, st.tuples(st.integers(1, 20), st.integers(1, 20), st.just(3))))
def test_png_holds_every_pixel(frame):
    import io

    surface = pygame.image.load(io.BytesIO(encode_png(frame)), "frame.png")
    back = np.frombuffer(pygame.image.tobytes(surface, "RGB"), np.uint8).reshape(frame.shape)
    assert (back == frame).all()
    assert encode_png(frame) == encode_png(frame.copy())


class TestSaveFrames:
    def test_names(self, tmp_path):
        folder = tmp_path / "new" / "frames"
        save_frames_and_video(generate_frames(3), folder, None)
        assert sorted(path.name for path in folder.iterdir()) == ["000000.png", "000001.png", "000002.png"]

    def test_a_full_disk_is_named_and_leaves_whole_frames_only(self, tmp_path, monkeypatch):
        write = Path.write_bytes
        calls = itertools.count()

        def fail_as_disk_is_full(self, data):
            if next(calls) == 2:
                write(self, data[:10])
                raise OSError(errno.ENOSPC, "No space left on device")
            return write(self, data)

        monkeypatch.setattr(Path, "write_bytes", fail_as_disk_is_full)
        with pytest.raises(OutputError, match=r"000002\.png: cannot be written: No space"):
            save_frames_and_video(generate_frames(5), tmp_path, None)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["000000.png", "000001.png"]

    def test_a_file_in_the_way_is_named(self, tmp_path):
        (tmp_path / "frames").write_text("")
        with pytest.raises(OutputError, match="frames"):
            save_frames_and_video(generate_frames(1), tmp_path / "frames", None)


class TestSaveFilm:
    def test_it_can_be_read_back(self, tmp_path):
        path = tmp_path / "new" / "run.mp4"
        save_video(path, generate_frames(10), fps=25)
        frames, about = read(path)
        assert len(frames) == 10
        assert frames[0].shape == (48, 64, 3)
        assert "h264" in about and "yuv420p(" in about and "25 fps" in about
        for k, frame in enumerate(frames):
            assert np.abs(frame.astype(int) - 20 * k).max() <= 6
        assert [entry.name for entry in path.parent.iterdir()] == ["run.mp4"]

    def test_colors_survive(self, tmp_path):
        colors = [(214, 34, 34), (31, 95, 224), (30, 158, 54), (27, 35, 48)]
        frames = [np.broadcast_to(np.array(c, dtype=np.uint8), (720, 1280, 3)) for c in colors]
        save_video(tmp_path / "a.mp4", frames)
        back, _ = read(tmp_path / "a.mp4")
        for frame, color in zip(back, colors, strict=True):
            assert np.abs(frame[300, 600].astype(int) - color).max() <= 12

    @pytest.mark.parametrize(("width", "height"), [(63, 48), (64, 47), (63, 47)])
    def test_odd_sizes_are_made_even_without_scaling(self, tmp_path, width, height):
        frame = np.zeros((height, width, 3), dtype=np.uint8)
        frame[:, ::8] = frame[:, -1] = 255
        save_video(tmp_path / "odd.mp4", [frame] * 3)
        frames, _ = read(tmp_path / "odd.mp4")
        assert frames[0].shape == (height + height % 2, width + width % 2, 3)
        bright = frames[0][20, :, 1] > 128
        assert np.nonzero(bright)[0].tolist() == [*range(0, width, 8), *range(width - 1, width + width % 2)]

    def test_same_frames_same_bytes(self, tmp_path):
        record = record_walk(ROOMS, 5, steps=12)
        for name in ("a.mp4", "b.mp4"):
            save_video(
                tmp_path / name, draw_frames(record, VideoSettings(fps=10, speed=1.0), size=(320, 180))
            )
        assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()

    @pytest.mark.parametrize("name", ["-dash", "pipe:1", "tcp:x", "a%d b'c"])
    def test_a_name_is_neither_an_option_nor_an_address(self, tmp_path, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        save_video(Path(name) / "run.mp4", generate_frames(3))
        assert len(read(tmp_path / name / "run.mp4")[0]) == 3
        film = ScreenVideo(Path(f"{name}.mp4"), (64, 48), waits=True)
        film.add(pygame.Surface((64, 48)), 0.1)
        film.close()
        assert len(read(tmp_path / f"{name}.mp4")[0]) == 3

    def test_no_frames(self, tmp_path):
        with pytest.raises(ParameterError, match="frames"):
            save_video(tmp_path / "a.mp4", [])
        assert list(tmp_path.iterdir()) == []

    def test_frames_of_different_sizes(self, tmp_path):
        with pytest.raises(ParameterError, match="one size"):
            save_video(tmp_path / "a.mp4", [*generate_frames(2), *generate_frames(1, width=32)])
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError])
    def test_an_interruption_leaves_the_older_film(self, tmp_path, stop):
        path = tmp_path / "run.mp4"
        path.write_bytes(b"older")

        def raise_stop():
            yield from generate_frames(5)
            raise stop

        with pytest.raises(stop):
            save_video(path, raise_stop())
        assert path.read_bytes() == b"older"
        assert list(tmp_path.iterdir()) == [path]

    @pytest.mark.parametrize(
        "script",
        [
            "echo 'av_interleaved_write_frame(): No space left on device' >&2; exit 1",
            "cat > /dev/null; echo 'No space left on device' >&2; exit 1",
        ],
        ids=["at once", "at the end"],
    )
    @pytest.mark.skipif(os.name == "nt", reason="a shell script stands for the encoder")
    def test_a_failing_encoder_leaves_nothing_and_is_quoted(self, tmp_path, monkeypatch, script):
        fake = tmp_path / "ffmpeg"
        fake.write_text(f"#!/bin/sh\n{script}\n")
        fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(fake))
        folder = tmp_path / "out"
        with pytest.raises(OutputError, match=r"run\.mp4: the video encoder failed .*No space left"):
            save_video(folder / "run.mp4", generate_frames(200, width=320, height=240))
        assert list(folder.iterdir()) == []

    def test_a_missing_encoder_is_named(self, tmp_path, monkeypatch):
        def raise_missing():
            raise RuntimeError("No ffmpeg exe could be found.")

        monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", raise_missing)
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(OutputError, match=r"pip install .robocov\[video\]., or set IMAGEIO_FFMPEG_EXE"):
            save_video(tmp_path / "run.mp4", generate_frames(2))
        assert list(tmp_path.iterdir()) == []
        # before a run that would be in vain
        with pytest.raises(OutputError, match="ffmpeg was not found"):
            VideoOptions(video=True)
        (tmp_path / "ffmpeg").write_text("")
        (tmp_path / "ffmpeg").chmod(0o755)
        assert find_encoder() == str(tmp_path / "ffmpeg")

    def test_a_folder_that_cannot_be_made_is_named(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(OutputError, match="file"):
            save_video(tmp_path / "file" / "run.mp4", generate_frames(2))
