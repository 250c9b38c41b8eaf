"""Frames and films of a run, without a display."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.errors import OutputError, ParameterError, shown
from robocov.files.atomic import written

if TYPE_CHECKING:
    from robocov.arrays import Array, IntArray
    from robocov.metrics import CostHistory
    from robocov.record import Record
    from robocov_app.render.field import Fields
    from robocov_app.render.layers import Layer

Frame: TypeAlias = NDArray[np.uint8]
"""An RGB picture, (height, width, 3), 0 to 255."""

Costs: TypeAlias = "tuple[Array, Array] | tuple[Array, Array, Array]"
"""Times, s, and mean distances, m; and mean times, s, where robots are not equally fast."""

Progress: TypeAlias = Callable[[int, int | None], None]
"""Is told how many frames are done, and of how many where that is known."""

_NO_FRAMES = "frames: none were given, but at least one was wanted"


def frame_rows(time: Array, fps: float, speed: float = 1.0, hold: float = 0.0) -> IntArray:
    """Return which row of a record each frame shows.

    `time`, (T,) s: ascending. `fps`: frames per second of the film. `speed`: simulated seconds per second of
    the film. `hold`, s: so long the film stays on the last row at its end. Raises
    ParameterError when `fps` or `speed` is not positive.

    Examples
    --------
    >>> frame_rows(np.arange(5) * 0.5, fps=2, speed=2.0).tolist()
    [0, 2, 4]
    """
    for name, value in (("fps", fps), ("speed", speed)):
        if not (np.isfinite(value) and value > 0):
            raise ParameterError(f"{name}: {shown(value)}, but a positive number was wanted")
    duration = float(time[-1] - time[0])
    count = int(np.ceil(duration / speed * fps - 1e-9)) + 1
    at = time[0] + np.arange(count + round(hold * fps)) * (speed / fps)
    # half a microsecond forgives the rounding of sums of steps
    rows = np.searchsorted(time, at + 5e-7, side="right") - 1
    return np.asarray(np.clip(rows, 0, len(time) - 1), dtype=np.intp)


def iter_frames(
    record: Record,
    *,
    size: tuple[int, int] = (1280, 720),
    theme: str = "light",
    fps: float = 30.0,
    speed: float = 1.0,
    hold: float = 0.0,
    colours: str = "robots",
    show: Iterable[str] | None = None,
    also: Iterable[str] = (),
    without: Iterable[str] = (),
    fields: Fields | None = None,
    layers: Sequence[Layer] | None = None,
    scale: float | None = None,
    cost: Costs | None = None,
    rows: IntArray | None = None,
) -> Iterator[Frame]:
    """Draw the frames of a saved run, one at a time.

    `size`: (width, height) in px. `fps`, `speed`, `hold`: see `frame_rows`. `colours`: a hue for each robot,
    or all in the paper's red. `show`: None shows those that are shown by default. `also`, `without`: changes
    to that. `fields`: what layers of distances draw; without it they draw nothing. `layers`: from the lowest
    to the topmost; None for `standard_layers`. `scale`: of text and lines; None for what suits the size.
    `cost`: times and mean distances, and where robots are not equally fast the mean times until the first is
    there; each frame says the latest known. See `told_costs`. `rows`, (m,) int or None: the rows to show,
    instead of those that `fps` and `speed` give. The arrays, (height, width, 3) RGB, are the caller's own.
    """
    from robocov_app.render.phi import mean_words
    from robocov_app.render.picture import Painter, standard_layers
    from robocov_app.render.record_scene import record_scene
    from robocov_app.render.theme import theme_named

    layers = standard_layers(colours) if layers is None else layers
    painter = Painter(record.environment, size, theme_named(theme), layers, scale)
    if show is not None:
        painter.show(show)
    painter.change(also, without)
    if rows is None:
        rows = frame_rows(record.time, fps, speed, hold)
    last, frame = -1, None
    for row in rows.tolist():
        if frame is None or row != last:
            scene = record_scene(
                record,
                row,
                cost=_cost_text(mean_words(record.environment), float(record.time[row]), cost),
                fields=fields if painter.needs_field else None,
            )
            last, frame = row, painter.frame(scene)
        yield frame


def told_costs(history: CostHistory) -> Costs:
    """Return of a cost history what frames tell."""
    if history.mean_time is None:
        return history.time, history.mean_distance
    return history.time, history.mean_distance, history.mean_time


def _cost_text(what: str, time: float, cost: Costs | None) -> str:
    if cost is None:
        return ""
    from robocov_app.render.phi import cost_words

    known = int(np.searchsorted(cost[0], time + 5e-7, side="right")) - 1
    return cost_words(what, *(values[known] for values in cost[1:])) if known >= 0 else ""


def png_bytes(frame: Frame) -> bytes:
    """Return the frame as a PNG file. The same pixels give the same bytes."""
    from PIL import Image

    file = io.BytesIO()
    # the lowest levels are several times as fast, and drawings of flat colours stay small all the same
    Image.fromarray(frame).save(file, format="PNG", compress_level=2)
    return file.getvalue()


def kept_frames(folder: Path | str, frames: Iterable[Frame]) -> Iterator[Frame]:
    """Write frames as ``000000.png``, ``000001.png``, ... and hand each on once it is written.

    `folder`: created when it is not there. Raises OutputError when the folder cannot be written. Frames
    already written stay; each one is whole.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {_reason(error)}") from error
    for number, frame in enumerate(frames):
        with written(folder / f"{number:06d}.png", durable=False) as part:
            part.write_bytes(png_bytes(frame))
        yield frame


def save_frames(
    folder: Path | str, frames: Iterable[Frame], *, total: int | None = None, progress: Progress | None = None
) -> int:
    """Write frames as `kept_frames` does, and return how many.

    `total`: number of frames where it is known, for `progress`. `progress`: called with (done, total) after
    each frame. Raises OutputError when the folder cannot be written.
    """
    done = 0
    for done, _ in enumerate(kept_frames(folder, frames), start=1):
        if progress is not None:
            progress(done, total)
    return done


def save_film(
    path: Path | str,
    frames: Iterable[Frame],
    *,
    fps: float = 30.0,
    total: int | None = None,
    progress: Progress | None = None,
) -> int:
    """Write frames as an MP4 film (H.264, yuv420p: what browsers and slides play); return how many.

    The film is made under another name in the same folder and gets its own at the end: after an error or
    Ctrl-C there is no half film, and an older one of that name is still there. `path`: its folder is created
    when it is not there. `frames`: all of one size. H.264 wants even sizes: an odd one gets its last row or
    column twice. `total`: number of frames where it is known, for `progress`. `progress`: called with (done,
    total) after each frame. Raises OutputError when the encoder is missing or fails, or the film cannot be
    written; ParameterError when there are no frames, or frames of different sizes.
    """
    path = Path(path)
    source = iter(frames)
    first = next(source, None)
    if first is None:
        raise ParameterError(_NO_FRAMES)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{path.parent}: cannot be made ({_reason(error)})") from error
    done = 0
    with written(path) as part, _encoder(part, path, _even(first), fps) as pipe:
        frame: Frame | None = first
        while frame is not None:
            if frame.shape != first.shape:
                raise ParameterError(
                    f"frames: {shown(frame.shape)} after {shown(first.shape)}, but one size was wanted"
                )
            pipe.write(np.ascontiguousarray(_even(frame)).data)
            done += 1
            if progress is not None:
                progress(done, total)
            frame = next(source, None)
    return done


def _even(frame: Frame) -> Frame:
    """Return the frame with its last row or column repeated where its size is odd."""
    height, width, _ = frame.shape
    if height % 2 == 0 and width % 2 == 0:
        return frame
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


@contextlib.contextmanager
def _encoder(part: Path, path: Path, frame: Frame, fps: float) -> Iterator[BinaryIO]:
    """Run ffmpeg and give the pipe into it; when it ends badly, raise what it said."""
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
            reason = lines[-1].strip() if lines else f"status {status}"
            raise OutputError(f"{path}: the film's encoder failed ({reason})")


def film_command(path: Path, size: tuple[int, int], fps: float, *, streamed: bool = False) -> list[str]:
    """Return the encoder's command: raw RGB frames of an even size come in, an MP4 film goes to `path`.

    A `streamed` film can be played up to where it has come, whatever happens to the encoder. Raises
    OutputError when there is no encoder.
    """
    flags = "+frag_keyframe+empty_moov+default_base_moof" if streamed else "+faststart"
    return [
        *(_ffmpeg(), "-y", "-nostdin", "-loglevel", "error"),
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


def _ffmpeg() -> str:
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise OutputError(
            "film: no ffmpeg was found; set IMAGEIO_FFMPEG_EXE to one, or reinstall imageio-ffmpeg"
        ) from error


def _reason(error: OSError) -> str:
    return os.strerror(error.errno) if error.errno is not None else str(error)
