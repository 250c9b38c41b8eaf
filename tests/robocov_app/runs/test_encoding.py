"""Frames of runs, and the files that they are saved to: images and videos."""

import errno
import io
import itertools
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from drawn_run import ROOMS, SQUARE, record_walk
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from property_examples import count_examples

from robocov.errors import OutputError, ParameterError
from robocov.metrics import CostHistory
from robocov_app.commands.options import VideoOptions
from robocov_app.runs.encoding import encode_png, find_encoder, save_frames_and_video, save_video
from robocov_app.runs.frames import draw_frames, select_frame_rows
from robocov_app.runs.settings import VideoSettings
from robocov_app.viewer.window.screen_video import ScreenVideo


def generate_frames(count, width=64, height=48):
    """Yield frames of one gray each, where frame k has 20 k."""
    for k in range(count):
        yield np.full((height, width, 3), 20 * k % 256, dtype=np.uint8)


def list_names(folder):
    return sorted(path.name for path in folder.iterdir())


def read_video(path):
    """Return the frames of a video, and what ffmpeg reports about its stream."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    process = subprocess.run(command, capture_output=True, check=True)
    (report, *_) = [line for line in process.stderr.decode().splitlines() if "Video:" in line]
    size = re.search(r" (\d+)x(\d+)[, ]", report)
    width = int(size[1])
    height = int(size[2])
    frames = np.frombuffer(process.stdout, np.uint8).reshape(-1, height, width, 3)
    return list(frames), report


class TestFrameRows:
    @given(st.integers(2, 200), st.floats(0.5, 60), st.floats(0.1, 20), st.floats(0.01, 0.5))
    def test_each_frame_has_the_latest_row_of_its_time(self, n_rows, fps, speed, dt):
        time = np.arange(n_rows) * dt
        rows = select_frame_rows(time, fps, speed)
        frame_times = np.minimum(np.arange(len(rows)) * speed / fps, time[-1])
        assert (time[rows] <= frame_times + 1e-6).all()
        assert (time[rows[:-1]] > frame_times[:-1] - dt - 1e-6).all()

    @given(st.integers(2, 200), st.floats(0.5, 60), st.floats(0.1, 20), st.floats(0.01, 0.5))
    def test_frames_lead_from_the_first_row_to_the_last(self, n_rows, fps, speed, dt):
        time = np.arange(n_rows) * dt
        rows = select_frame_rows(time, fps, speed)
        assert rows[0] == 0
        assert rows[-1] == n_rows - 1
        assert (np.diff(rows) >= 0).all()
        assert len(rows) - 1 == pytest.approx(time[-1] * fps / speed, abs=1.0 + 1e-6)

    def test_rounded_times_do_not_skip_a_row(self):
        time = np.cumsum(np.full(601, 1 / 30)) - 1 / 30
        assert select_frame_rows(time, 30).tolist() == list(range(601))

    def test_the_last_row_is_held(self):
        assert select_frame_rows(np.array([0.0, 1.0]), 2, hold=1.0).tolist() == [0, 0, 1, 1, 1]


class TestFrames:
    def test_the_number_of_frames_follows_from_duration_and_speed(self):
        record = record_walk(ROOMS, 3, steps=31)
        settings = VideoSettings(fps=5, speed=2)
        frames = list(draw_frames(record, settings, size=(160, 120)))
        assert len(frames) == 9
        assert frames[0].shape == (120, 160, 3)

    def test_frames_are_drawn_one_by_one(self):
        frames = draw_frames(record_walk(ROOMS, 3, steps=31), VideoSettings(), size=(160, 120))
        assert iter(frames) is frames

    def test_a_frame_depends_on_its_row(self):
        record = record_walk(SQUARE, 3, steps=21)
        rows = np.array([0, 10, 20, 20])
        first, second, third, fourth = draw_frames(record, VideoSettings(), size=(320, 240), rows=rows)
        assert (first != second).any()
        assert (second != third).any()
        assert (third == fourth).all()

    def test_unknown_themes_are_rejected(self):
        record = record_walk(SQUARE, 3, steps=5)
        with pytest.raises(ParameterError, match="theme"):
            next(draw_frames(record, VideoSettings(theme="pink")))


def draw_frame_with_cost(cost):
    """Return the bytes of the frame of row 10, at 1 s, with a history of the cost."""
    record = record_walk(SQUARE, 3, steps=21)
    rows = np.array([10])
    return next(draw_frames(record, VideoSettings(), size=(480, 240), rows=rows, cost=cost)).tobytes()


def build_cost_history(times, values):
    """Return a history in which all costs are equal."""
    mean = np.array(values)
    return CostHistory(np.array(times), mean, mean, mean)


class TestCostsInFrames:
    def test_a_frame_has_the_latest_known_cost(self):
        frame = draw_frame_with_cost(build_cost_history([0.0, 1.0, 1.5], [3.0, 2.0, 1.0]))
        assert frame == draw_frame_with_cost(build_cost_history([0.9], [2.0]))
        assert frame != draw_frame_with_cost(build_cost_history([0.9], [3.0]))

    def test_a_later_or_unknown_cost_is_not_drawn(self):
        frame_without_cost = draw_frame_with_cost(None)
        assert draw_frame_with_cost(build_cost_history([1.5], [1.0])) == frame_without_cost
        assert draw_frame_with_cost(build_cost_history([0.0], [np.nan])) == frame_without_cost

    def test_a_frame_has_the_mean_time_if_it_is_known(self):
        time = np.array([0.0])
        mean = np.array([3.0])
        frames = set()
        for mean_time in (None, mean, 2.0 * mean):
            frames.add(draw_frame_with_cost(CostHistory(time, mean, mean, mean, mean_time)))
        assert len(frames) == 3


@settings(deadline=None, max_examples=count_examples(30))
@given(arrays(np.uint8, st.tuples(st.integers(1, 20), st.integers(1, 20), st.just(3))))
def test_a_png_has_all_pixels_of_its_frame(frame):
    surface = pygame.image.load(io.BytesIO(encode_png(frame)), "frame.png")
    pixels = np.frombuffer(pygame.image.tobytes(surface, "RGB"), np.uint8).reshape(frame.shape)
    assert (pixels == frame).all()


@settings(deadline=None, max_examples=count_examples(30))
@given(arrays(np.uint8, st.tuples(st.integers(1, 20), st.integers(1, 20), st.just(3))))
def test_equal_frames_give_the_same_png(frame):
    assert encode_png(frame) == encode_png(frame.copy())


class TestSaveFrames:
    def test_frames_are_numbered_in_a_new_folder(self, tmp_path):
        folder = tmp_path / "new" / "frames"
        save_frames_and_video(generate_frames(3), folder, None)
        assert list_names(folder) == ["000000.png", "000001.png", "000002.png"]

    def test_on_a_full_disk_only_whole_frames_are_kept(self, tmp_path, monkeypatch):
        write_bytes = Path.write_bytes
        calls = itertools.count()

        def write_until_disk_is_full(self, data):
            if next(calls) == 2:
                write_bytes(self, data[:10])
                raise OSError(errno.ENOSPC, "No space left on device")
            return write_bytes(self, data)

        monkeypatch.setattr(Path, "write_bytes", write_until_disk_is_full)
        with pytest.raises(OutputError, match=r"000002\.png: cannot be written: No space"):
            save_frames_and_video(generate_frames(5), tmp_path, None)
        assert list_names(tmp_path) == ["000000.png", "000001.png"]

    def test_a_file_with_the_name_of_the_folder_is_reported(self, tmp_path):
        (tmp_path / "frames").write_text("")
        with pytest.raises(OutputError, match="frames"):
            save_frames_and_video(generate_frames(1), tmp_path / "frames", None)


class TestSaveVideo:
    def test_a_video_has_the_frames_and_their_rate(self, tmp_path):
        path = tmp_path / "new" / "run.mp4"
        save_video(path, generate_frames(10), fps=25)
        frames, report = read_video(path)
        assert len(frames) == 10
        assert frames[0].shape == (48, 64, 3)
        for k, frame in enumerate(frames):
            assert np.abs(frame.astype(int) - 20 * k).max() <= 6
        assert "h264" in report
        assert "yuv420p(" in report
        assert "25 fps" in report

    def test_no_other_files_are_left(self, tmp_path):
        save_video(tmp_path / "run.mp4", generate_frames(10))
        assert list_names(tmp_path) == ["run.mp4"]

    def test_a_video_has_the_colors_of_its_frames(self, tmp_path):
        colors = [(214, 34, 34), (31, 95, 224), (30, 158, 54), (27, 35, 48)]
        frames = [np.broadcast_to(np.array(color, dtype=np.uint8), (720, 1280, 3)) for color in colors]
        save_video(tmp_path / "run.mp4", frames)
        frames_in_video, _ = read_video(tmp_path / "run.mp4")
        for frame, color in zip(frames_in_video, colors, strict=True):
            assert np.abs(frame[300, 600].astype(int) - color).max() <= 12

    @pytest.mark.parametrize(("width", "height"), [(63, 48), (64, 47), (63, 47)])
    def test_odd_sizes_are_extended_without_scaling(self, tmp_path, width, height):
        """Columns 0, 8, 16, ... and the last one are white; the last one is repeated."""
        frame = np.zeros((height, width, 3), dtype=np.uint8)
        frame[:, ::8] = 255
        frame[:, -1] = 255
        save_video(tmp_path / "odd.mp4", [frame] * 3)
        frames, _ = read_video(tmp_path / "odd.mp4")
        even_width = width + width % 2
        even_height = height + height % 2
        assert frames[0].shape == (even_height, even_width, 3)
        white_columns = np.flatnonzero(frames[0][20, :, 1] > 128)
        assert white_columns.tolist() == [*range(0, width, 8), *range(width - 1, even_width)]

    def test_the_same_frames_give_the_same_bytes(self, tmp_path):
        record = record_walk(ROOMS, 5, steps=12)
        video_settings = VideoSettings(fps=10, speed=1.0)
        paths = [tmp_path / "first.mp4", tmp_path / "second.mp4"]
        for path in paths:
            save_video(path, draw_frames(record, video_settings, size=(320, 180)))
        assert paths[0].read_bytes() == paths[1].read_bytes()

    @pytest.mark.parametrize("name", ["-dash", "pipe:1", "tcp:x", "a%d b'c"])
    def test_path_names_are_not_options_or_addresses_of_the_encoder(self, tmp_path, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        save_video(Path(name) / "run.mp4", generate_frames(3))
        frames, _ = read_video(tmp_path / name / "run.mp4")
        assert len(frames) == 3

    @pytest.mark.parametrize("name", ["-dash", "pipe:1", "tcp:x", "a%d b'c"])
    def test_path_names_of_screen_videos_are_not_options_or_addresses(self, tmp_path, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        video = ScreenVideo(Path(f"{name}.mp4"), (64, 48), waits=True)
        video.add(pygame.Surface((64, 48)), 0.1)
        video.close()
        frames, _ = read_video(tmp_path / f"{name}.mp4")
        assert len(frames) == 3

    def test_a_screen_video_without_encoder_process_leaves_no_file(self, tmp_path, monkeypatch):
        def raise_memory_error(*arguments, **options):
            raise OSError(errno.ENOMEM, "Cannot allocate memory")

        monkeypatch.setattr("robocov_app.viewer.window.screen_video.Popen", raise_memory_error)
        with pytest.raises(OutputError, match=r"screen.mp4: cannot be written: Cannot allocate memory"):
            ScreenVideo(tmp_path / "screen.mp4", (64, 48))
        assert list_names(tmp_path) == []

    @pytest.mark.parametrize("size", [(20, 20), (640, 480)])
    def test_closing_a_screen_video_reports_an_encoder_that_has_ended(self, tmp_path, monkeypatch, size):
        """Frames of 20 x 20 pixels fit into a buffer, which is written only when the input is closed."""
        monkeypatch.setattr(
            "robocov_app.viewer.window.screen_video.build_encoder_command",
            lambda *arguments, **options: [sys.executable, "-c", "raise SystemExit(1)"],
        )
        video = ScreenVideo(tmp_path / "screen.mp4", size, waits=True)
        video._process.wait()
        video.add(pygame.Surface(size), 0.1)
        errors = []

        def close():
            try:
                video.close()
            except OutputError as error:
                errors.append(str(error))

        thread = threading.Thread(target=close, daemon=True)
        thread.start()
        thread.join(20.0)
        assert not thread.is_alive()
        assert errors == [f"{tmp_path / 'screen.mp4'}: the video encoder failed"]

    def test_a_video_without_frames_is_rejected(self, tmp_path):
        with pytest.raises(ParameterError, match="frames"):
            save_video(tmp_path / "run.mp4", [])
        assert list_names(tmp_path) == []

    def test_frames_of_different_sizes_are_rejected(self, tmp_path):
        frames = [*generate_frames(2), *generate_frames(1, width=32)]
        with pytest.raises(ParameterError, match="one size"):
            save_video(tmp_path / "run.mp4", frames)
        assert list_names(tmp_path) == []

    @pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
    def test_an_interruption_keeps_an_existing_video(self, tmp_path, error):
        path = tmp_path / "run.mp4"
        path.write_bytes(b"older")

        def generate_frames_and_fail():
            yield from generate_frames(5)
            raise error

        with pytest.raises(error):
            save_video(path, generate_frames_and_fail())
        assert path.read_bytes() == b"older"
        assert list_names(tmp_path) == ["run.mp4"]

    def test_a_file_in_the_path_of_the_folder_is_reported(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(OutputError, match="file"):
            save_video(tmp_path / "file" / "run.mp4", generate_frames(2))


class TestEncoder:
    @pytest.mark.parametrize(
        "script",
        [
            pytest.param("echo 'write_frame(): No space left on device' >&2; exit 1", id="at the start"),
            pytest.param("cat > /dev/null; echo 'No space left on device' >&2; exit 1", id="at the end"),
        ],
    )
    @pytest.mark.skipif(os.name == "nt", reason="the encoder is replaced by a shell script")
    def test_the_error_of_a_failing_encoder_is_reported_and_no_file_is_left(
        self, tmp_path, monkeypatch, script
    ):
        encoder = tmp_path / "ffmpeg"
        encoder.write_text(f"#!/bin/sh\n{script}\n")
        encoder.chmod(0o755)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
        folder = tmp_path / "out"
        with pytest.raises(OutputError, match=r"run\.mp4: the video encoder failed .*No space left"):
            save_video(folder / "run.mp4", generate_frames(200, width=320, height=240))
        assert list_names(folder) == []

    @pytest.fixture
    def missing_encoder(self, tmp_path, monkeypatch):
        """Hide ffmpeg from the package that contains it and from the search path, which is `tmp_path`."""

        def raise_missing():
            raise RuntimeError("No ffmpeg exe could be found.")

        monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", raise_missing)
        monkeypatch.setenv("PATH", str(tmp_path))

    @pytest.mark.usefixtures("missing_encoder")
    def test_the_error_of_a_missing_encoder_tells_how_to_install_it(self, tmp_path):
        with pytest.raises(OutputError, match=r"pip install .robocov\[video\]., or set IMAGEIO_FFMPEG_EXE"):
            save_video(tmp_path / "run.mp4", generate_frames(2))
        assert list_names(tmp_path) == []

    def test_a_wrong_path_of_the_encoder_is_reported_before_a_run(self, tmp_path, monkeypatch):
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "nothing"))
        with pytest.raises(OutputError, match=r"IMAGEIO_FFMPEG_EXE: expected .* ffmpeg, got .*nothing$"):
            VideoOptions(video=True)

    @pytest.mark.usefixtures("missing_encoder")
    def test_the_path_of_the_encoder_needs_no_further_package(self, tmp_path, monkeypatch):
        encoder = tmp_path / "my-encoder"
        encoder.write_text("")
        encoder.chmod(0o755)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
        assert find_encoder() == str(encoder)

    @pytest.mark.usefixtures("missing_encoder")
    def test_a_missing_encoder_is_reported_before_a_run(self):
        with pytest.raises(OutputError, match="ffmpeg was not found"):
            VideoOptions(video=True)

    @pytest.mark.usefixtures("missing_encoder")
    def test_an_encoder_in_the_search_path_is_found(self, tmp_path):
        encoder = tmp_path / "ffmpeg"
        encoder.write_text("")
        encoder.chmod(0o755)
        assert find_encoder() == str(encoder)
