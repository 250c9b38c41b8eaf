"""Files of frames and films."""

import contextlib
import io
import shutil
import subprocess
import tempfile
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import OutputError, ParameterError, describe_error, quote
from robocov.files.writing import replace_file

Frame: TypeAlias = NDArray[np.uint8]  # RGB, (height, width, 3), 0 to 255


def png_bytes(frame: Frame) -> bytes:
    """Return the frame as a PNG file. The same pixels give the same bytes."""
    from PIL import Image

    file = io.BytesIO()
    # the lowest levels are several times as fast, and drawings of flat colours stay small all the same
    Image.fromarray(frame).save(file, format="PNG", compress_level=2)
    return file.getvalue()


def save_moving_picture(
    frames: Iterable[Frame], folder: Path | None, film: Path | None, fps: float = 30.0
) -> None:
    """Write frames as ``000000.png``, ``000001.png``, ... into a folder, as a film, or both."""
    frames = frames if folder is None else _kept(folder, frames)
    if film is not None:
        save_film(film, frames, fps=fps)
    else:
        deque(frames, maxlen=0)


def _kept(folder: Path, frames: Iterable[Frame]) -> Iterator[Frame]:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {describe_error(error)}") from error
    for number, frame in enumerate(frames):
        with replace_file(folder / f"{number:06d}.png", durable=False) as part:
            part.write_bytes(png_bytes(frame))
        yield frame


def save_film(path: Path, frames: Iterable[Frame], *, fps: float = 30.0) -> None:
    """Write frames of one size as an MP4 film, whole or not at all."""
    source = iter(frames)
    first = next(source, None)
    if first is None:
        raise ParameterError("frames: expected at least one, got none")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{path.parent}: cannot be made ({describe_error(error)})") from error
    with replace_file(path) as part, _encoder(part, path, _even(first), fps) as pipe:
        for frame in chain([first], source):
            if frame.shape != first.shape:
                sizes = f"{quote(frame.shape)} after {quote(first.shape)}"
                raise ParameterError(f"frames: expected one size, got {sizes}")
            pipe.write(np.ascontiguousarray(_even(frame)).data)


def _even(frame: Frame) -> Frame:
    """Return the frame with its last row or column repeated where its size is odd."""
    height, width, _ = frame.shape
    if height % 2 == width % 2 == 0:
        return frame
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


@contextlib.contextmanager
def _encoder(part: Path, path: Path, frame: Frame, fps: float) -> Iterator[BinaryIO]:
    height, width, _ = frame.shape
    command = film_command(part, (width, height), fps)
    with tempfile.TemporaryFile() as said:
        # in a session of its own: Ctrl-C in a terminal goes to us alone, and we end the film properly
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
        )
        assert process.stdin is not None
        broken = False
        try:
            yield process.stdin  # type: ignore[misc]
            process.stdin.close()
        except BrokenPipeError:
            broken = True
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(OSError):
                process.stdin.close()
            status = process.wait()
        if broken or status != 0:
            said.seek(0)
            lines = said.read().decode("utf-8", "replace").strip().splitlines()
            why = lines[-1].strip() if lines else f"status {status}"
            raise OutputError(f"{path}: the film's encoder failed ({why})")


def encoder() -> str:
    """Return where ffmpeg is: that of the extra "film", else one on the path; raises OutputError for none."""
    with contextlib.suppress(ModuleNotFoundError, RuntimeError):
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    if found := shutil.which("ffmpeg"):
        return found
    ways = 'pip install "robocov[film]", or set IMAGEIO_FFMPEG_EXE to one'
    raise OutputError(f"film: no ffmpeg was found: {ways}")


def film_command(path: Path, size: tuple[int, int], fps: float, *, streamed: bool = False) -> list[str]:
    """Return the encoder's command: raw RGB frames in, an MP4 film out, playable while `streamed`."""
    flags = "+frag_keyframe+empty_moov+default_base_moof" if streamed else "+faststart"
    return [
        *(encoder(), "-y", "-nostdin", "-loglevel", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}", "-i", "-"),
        *("-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-tune", "animation"),
        # players take bt709 for high definition and bt601 otherwise unless the film says which
        *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p"),
        *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
        *(("-g", f"{round(2 * fps)}") if streamed else ()),
        *("-movflags", flags, "-fflags", "+bitexact", "-flags:v", "+bitexact"),
        # neither an option nor an address, whatever it looks like
        f"file:{path.absolute()}",
    ]
