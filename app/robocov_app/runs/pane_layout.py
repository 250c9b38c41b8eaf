"""Layout of videos that show several runs side by side, below a common legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.record import Record
from robocov_app.look.colors import Color
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import Theme
from robocov_app.render.annotations.legend_strip import MARGIN_PX, ROW_HEIGHT_PX, render_legend_image
from robocov_app.render.annotations.scale_bar import STRIP_HEIGHT_PX
from robocov_app.render.distance_map.pixel_distances import DistanceFields
from robocov_app.render.layer_catalog import build_pane_layers
from robocov_app.render.painter import Painter, choose_scale
from robocov_app.render.panel_grid import choose_column_count
from robocov_app.render.record_scene import build_record_scene
from robocov_app.render.scene import Scene
from robocov_app.runs.encoding import Frame
from robocov_app.runs.frames import build_painter
from robocov_app.runs.settings import VideoSettings

MAX_DEFAULT_SIZE_PX = (1920, 1080)
"""Maximum size of a video with several panes if the user gives no size."""
PANE_GAP_PX = 2
"""Width of the line between two panes."""
_MIN_PANE_WIDTH_PX = 360
"""Minimum width of a pane at scale 1, so that its caption fits."""
_MIN_PANE_HEIGHT_PX = 40
"""Minimum height of a pane."""
_MIN_SCALE = 0.75
"""Minimum scale of text and lines."""
_HEADER_PADDING_PX = 6
"""Space above and below the caption of a pane at scale 1."""
_PANE_PADDING_PX = 4
"""Further space around the map in a pane at scale 1."""
_LEGEND_PAINTER_SIZE_PX = (64, 64)
"""Size of a painter that only lists the entries of the legend. The entries do not depend on it."""


class PaneLayout(NamedTuple):
    """Layout of a video with several panes.

    Attributes
    ----------
    columns : int
        Number of panes in a row.
    pane : (width, height), px
        Size of each pane.
    scale : float
        Scale of text and lines.
    header : Frame
        The legend, as wide as the video.
    size : (width, height), px
        Size of the video.
    """

    columns: int
    pane: tuple[int, int]
    scale: float
    header: Frame
    size: tuple[int, int]

    def compose_page(self, panes: Sequence[Frame], theme: Theme) -> Frame:
        """Compose a frame of the video from the frames of its panes.

        Parameters
        ----------
        panes : sequence of Frame
            The frame of each pane.
        theme : Theme
            Color theme of the video.

        Returns
        -------
        Frame
        """
        width, height = self.size
        page = np.full((height, width, 3), theme.background, dtype=np.uint8)
        header_height, header_width = self.header.shape[:2]
        page[:header_height, :header_width] = self.header
        body = tile_frames(panes, self.columns, PANE_GAP_PX, theme.grid, theme.background)
        # A low page may have no space for all rows of the body.
        body = body[: height - header_height, :width]
        body_height, body_width = body.shape[:2]
        page[header_height : header_height + body_height, :body_width] = body
        return page


class _PaneSpace(NamedTuple):
    """Total space around the map in a pane, px."""

    horizontal: float
    vertical: float


def build_pane_layout(
    records: Sequence[Record],
    settings: VideoSettings,
    size: tuple[int, int] | None = None,
    fields: DistanceFields | None = None,
    legend_scenes: Sequence[Scene] | None = None,
) -> PaneLayout:
    """Lay out panes so that the maps are as large as possible; for example, wide maps are stacked.

    Parameters
    ----------
    records : sequence of Record
        The record of each pane.
    settings : VideoSettings
        Settings of the video.
    size : (width, height) or None, px
        Size of the video. By default, one that suits the map, up to `MAX_DEFAULT_SIZE_PX`.
    fields : DistanceFields or None
        Distances to the nearest robot, if a layer shows them.
    legend_scenes : sequence of Scene or None
        Scenes that the legend explains. By default, the first step of each record, and the last step of
        records in which robots may fail.

    Returns
    -------
    PaneLayout
    """
    aspect = max(_compute_aspect(record) for record in records)
    width, height = size or MAX_DEFAULT_SIZE_PX
    columns = _count_columns(len(records), aspect, (width, height))
    rows = math.ceil(len(records) / columns)
    max_scale = width / columns / _MIN_PANE_WIDTH_PX
    scale = max(min(choose_scale((width, height)), max_scale), _MIN_SCALE)
    gaps_width = (columns - 1) * PANE_GAP_PX
    gaps_height = (rows - 1) * PANE_GAP_PX
    pane_width = (width - gaps_width) // columns
    if size is not None:
        header = _draw_legend(records, settings, width, scale, fields=fields, scenes=legend_scenes)
        pane_height = (height - len(header) - gaps_height) // rows
    else:
        # The legend has at least one row.
        min_header_height = (_HEADER_PADDING_PX + ROW_HEIGHT_PX) * scale
        max_pane_height = (height - min_header_height) / rows - PANE_GAP_PX
        pane_width, pane_height = _fit_pane(aspect, pane_width, max_pane_height, scale)
        width = columns * pane_width + gaps_width
        header = _draw_legend(records, settings, width, scale, fields=fields, scenes=legend_scenes)
        height = len(header) + rows * pane_height + gaps_height
        # Video encoders need even sizes.
        width += width % 2
        height += height % 2
    pane = (pane_width, max(pane_height, _MIN_PANE_HEIGHT_PX))
    return PaneLayout(columns=columns, pane=pane, scale=scale, header=header, size=(width, height))


def _compute_aspect(record: Record) -> float:
    """Return the width of a record's map divided by its height."""
    low_x, low_y, high_x, high_y = record.environment.region.bounds
    return (high_x - low_x) / (high_y - low_y)


def _count_columns(panes: int, aspect: float, size: tuple[int, int]) -> int:
    """Choose the number of panes in a row; `aspect` is the width of the widest map divided by its height."""
    width, height = size
    scale = choose_scale(size)
    caption_height = (_HEADER_PADDING_PX + ROW_HEIGHT_PX + _HEADER_PADDING_PX + STRIP_HEIGHT_PX) * scale
    return choose_column_count(
        panes, aspect, (width, height - ROW_HEIGHT_PX * scale), row_margin=caption_height
    )


def _fit_pane(aspect: float, max_width: int, max_height: float, scale: float) -> tuple[int, int]:
    """Choose the width and height of a pane, px, that suit a map of a given aspect."""
    space = _PaneSpace(
        horizontal=(2 * MARGIN_PX + _PANE_PADDING_PX) * scale,
        vertical=(
            _HEADER_PADDING_PX + ROW_HEIGHT_PX + _HEADER_PADDING_PX + STRIP_HEIGHT_PX + _PANE_PADDING_PX
        )
        * scale,
    )
    height = round(min((max_width - space.horizontal) / aspect + space.vertical, max_height))
    needed_width = round((height - space.vertical) * aspect + space.horizontal)
    width = min(max_width, max(needed_width, round(_MIN_PANE_WIDTH_PX * scale)))
    return width, height


def _draw_legend(
    records: Sequence[Record],
    settings: VideoSettings,
    width: int,
    scale: float,
    *,
    fields: DistanceFields | None,
    scenes: Sequence[Scene] | None,
) -> Frame:
    """Draw the common legend, with entries for everything that the panes show."""
    painter = build_painter(
        records[0], settings, _LEGEND_PAINTER_SIZE_PX, build_pane_layers(settings.colors), scale
    )
    if scenes is None:
        scenes = _select_legend_scenes(records, fields, painter)
    legends = [painter.list_legend_entries(scene) for scene in scenes]
    # The longest legend comes first and determines the order, because it usually contains all entries.
    legends.sort(key=len, reverse=True)
    merged = merge_legends(legends, lambda entry: entry.key)
    return render_legend_image(merged, width, settings.color_theme, scale, settings.shown_layers)


def _select_legend_scenes(
    records: Sequence[Record], fields: DistanceFields | None, painter: Painter
) -> list[Scene]:
    """Return the first scene of each record, and the last one if robots may fail, for the legend."""
    shown_fields = fields if painter.needs_field else None
    scenes = []
    for record in records:
        scenes.append(build_record_scene(record, 0, fields=shown_fields))
        if record.conditions and len(record) > 1:
            scenes.append(build_record_scene(record, len(record) - 1, fields=shown_fields))
    return scenes


def tile_frames(frames: Sequence[Frame], columns: int, gap: int, line: Color, background: Color) -> Frame:
    """Arrange frames of the same size in rows.

    Parameters
    ----------
    frames : sequence of Frame
        The frames, row by row.
    columns : int
        Number of frames in a row.
    gap : int, px
        Width of the lines between frames.
    line, background : Color
        Color of the lines, and color of areas without a frame.

    Returns
    -------
    Frame
    """
    height, width, _ = frames[0].shape
    rows = math.ceil(len(frames) / columns)
    columns = min(columns, len(frames))
    shape = (rows * (height + gap) - gap, columns * (width + gap) - gap, 3)
    page = np.full(shape, background, dtype=np.uint8)
    for k, frame in enumerate(frames):
        row, column = divmod(k, columns)
        x = column * (width + gap)
        y = row * (height + gap)
        page[y : y + height, x : x + width] = frame
        # Draw the lines to the left of the frame and above its row. At the edges of the page they have no
        # pixels.
        page[y : y + height, max(x - gap, 0) : x] = line
        page[max(y - gap, 0) : y] = line
    return page
