"""Writing of frames as PNG files, and of videos."""

import contextlib
import io
import os
import shutil
import subprocess
import tempfile
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import IO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import OutputError, ParameterError, describe_error, quote, to_one_line
from robocov.files.writing import replace_file

Frame: TypeAlias = NDArray[np.uint8]
"""An RGB image, (height, width, 3), from 0 to 255."""
_PNG_COMPRESSION_LEVEL = 2
"""A low level is several times as fast, and files of drawings with flat colors are small anyway."""
_SECONDS_PER_KEYFRAME = 2
"""Time between two keyframes of a streamed video."""
_ENCODER_VARIABLE = "IMAGEIO_FFMPEG_EXE"
"""Environment variable with the path of ffmpeg, which imageio-ffmpeg also reads."""


def encode_png(frame: Frame) -> bytes:
    """Encode a frame as a PNG file; the same pixels always give the same bytes.

    Parameters
    ----------
    frame : Frame
        The image.

    Returns
    -------
    bytes
        Content of the file.
    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(frame).save(file, format="PNG", compress_level=_PNG_COMPRESSION_LEVEL)
    return file.getvalue()


def save_frames_and_video(
    frames: Iterable[Frame], folder: Path | None, video: Path | None, fps: float = 30.0
) -> None:
    """Write frames to a folder, as a video, or both.

    Parameters
    ----------
    frames : iterable of Frame
        Frames, all of the same size. A video needs at least one.
    folder : Path or None
        Folder for the files ``000000.png``, ``000001.png`` and so on.
    video : Path or None
        MP4 file of the video.
    fps : float
        Frames per second of the video.

    Raises
    ------
    OutputError
        If a file cannot be written, or there is no encoder.
    """
    if folder is not None:
        frames = _save_each_frame(folder, frames)
    if video is not None:
        save_video(video, frames, fps=fps)
    else:
        deque(frames, maxlen=0)  # consumes the iterator, which writes the frames


def _save_each_frame(folder: Path, frames: Iterable[Frame]) -> Iterator[Frame]:
    """Write each frame to a folder, and yield it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {describe_error(error)}") from error
    for number, frame in enumerate(frames):
        with replace_file(folder / f"{number:06d}.png", durable=False) as temporary:
            temporary.write_bytes(encode_png(frame))
        yield frame


def save_video(path: Path, frames: Iterable[Frame], *, fps: float = 30.0) -> None:
    """Write an MP4 video, completely or not at all.

    Parameters
    ----------
    path : Path
        File of the video.
    frames : iterable of Frame
        At least one frame, all of the same size.
    fps : float
        Frames per second.

    Raises
    ------
    ParameterError
        If there is no frame, or if frames have different sizes.
    OutputError
        If the file cannot be written, or there is no encoder.
    """
    iterator = iter(frames)
    first = next(iterator, None)
    if first is None:
        raise ParameterError("frames: expected at least one, got none")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{path.parent}: cannot be created: {describe_error(error)}") from error
    height, width, _ = _pad_to_even_size(first).shape
    with replace_file(path) as temporary, _open_encoder(temporary, path, (width, height), fps) as pipe:
        for frame in chain([first], iterator):
            if frame.shape != first.shape:
                raise ParameterError(
                    f"frames: expected one size, got {quote(frame.shape)} after {quote(first.shape)}"
                )
            pipe.write(np.ascontiguousarray(_pad_to_even_size(frame)).data)


def _pad_to_even_size(frame: Frame) -> Frame:
    """Make the height and width of a frame even, as encoders require, by repeating the last row or column."""
    height, width, _ = frame.shape
    if height % 2 == width % 2 == 0:
        return frame
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


@contextlib.contextmanager
def _open_encoder(temporary: Path, path: Path, size: tuple[int, int], fps: float) -> Iterator[IO[bytes]]:
    """Run the encoder, and yield the pipe for raw frames; raise OutputError if the encoder fails."""
    command = build_encoder_command(temporary, size, fps)
    with tempfile.TemporaryFile() as error_output:
        # The encoder gets a session of its own, so that it does not receive Ctrl+C from the terminal and can
        # complete the video.
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=error_output,
            start_new_session=True,
        )
        assert process.stdin is not None
        is_pipe_broken = False
        try:
            yield process.stdin
            process.stdin.close()
        except BrokenPipeError:
            is_pipe_broken = True
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(OSError):
                process.stdin.close()
            status = process.wait()
        if is_pipe_broken or status != 0:
            error_output.seek(0)
            lines = error_output.read().decode("utf-8", "replace").strip().splitlines()
            reason = lines[-1].strip() if lines else f"status {status}"
            raise OutputError(f"{path}: the video encoder failed ({reason})")


def find_encoder() -> str:
    """Find ffmpeg: first by IMAGEIO_FFMPEG_EXE, then from the extra "video", then on the PATH.

    Returns
    -------
    str
        Path of the program.

    Raises
    ------
    OutputError
        If ffmpeg is not found, or IMAGEIO_FFMPEG_EXE is not the path of a program.
    """
    configured_path = os.environ.get(_ENCODER_VARIABLE)
    if configured_path:
        program = shutil.which(configured_path)
        if program is None:
            actual = to_one_line(configured_path)
            raise OutputError(f"{_ENCODER_VARIABLE}: expected the path of ffmpeg, got {actual}")
        return program
    with contextlib.suppress(ModuleNotFoundError, RuntimeError):
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    program = shutil.which("ffmpeg")
    if program is None:
        raise OutputError(
            'video: ffmpeg was not found; pip install "robocov[video]", '
            f"or set {_ENCODER_VARIABLE} to its path"
        )
    return program


def build_encoder_command(
    path: Path, size: tuple[int, int], fps: float, *, is_streamed: bool = False
) -> list[str]:
    """Build the command that encodes raw RGB frames as an MP4 video.

    Parameters
    ----------
    path : Path
        File of the video.
    size : (width, height), px
        Size of the frames; both numbers must be even.
    fps : float
        Frames per second.
    is_streamed : bool
        Whether it must be possible to play the video while it is being written.

    Returns
    -------
    list of str
    """
    width, height = size
    command = [find_encoder(), "-y", "-nostdin", "-loglevel", "error"]
    command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    # A constant quality (crf 18) at which the lines of drawings show no artifacts.
    command += ["-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-tune", "animation"]
    # Without these options, players guess the color space from the size: bt709 for high definition, or bt601.
    command += ["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p"]
    command += ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"]
    command += ["-color_range", "tv"]
    flags = "+faststart"
    if is_streamed:
        command += ["-g", f"{round(_SECONDS_PER_KEYFRAME * fps)}"]
        flags = "+frag_keyframe+empty_moov+default_base_moof"
    command += ["-movflags", flags, "-fflags", "+bitexact", "-flags:v", "+bitexact"]
    # "file:" prevents a path from being taken for an option or a URL.
    command.append(f"file:{path.absolute()}")
    return command
