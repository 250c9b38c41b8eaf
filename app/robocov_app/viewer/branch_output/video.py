"""The video of a branch: trajectories continue through all edits, and a caption names the last edit."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pygame

from robocov_app.look.theme import Theme
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.render.painter import Painter, choose_scale
from robocov_app.runs.encoding import Frame
from robocov_app.runs.pane_layout import PaneLayout, build_pane_layout
from robocov_app.runs.saved_runs import name_folders
from robocov_app.runs.settings import VideoSettings
from robocov_app.runs.video import VIDEO_HOLD_S
from robocov_app.viewer.branch_output.parts import (
    BranchPart,
    PartCost,
    SelectedBranch,
    build_pane_scene,
    build_part_records,
)
from robocov_app.viewer.session.document import Node
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.window.screen_video import copy_pixels

CAPTION_PX = 30  # height of the strip with the last edit, px at scale 1
_TIME_TOLERANCE_S = 1e-9


def count_video_frames(branch: SelectedBranch, settings: VideoSettings) -> int:
    """Return the number of frames of a branch's video."""
    duration = branch.last_step * branch.scenario.dt / settings.speed + VIDEO_HOLD_S
    return round(duration * settings.fps) + 1


def draw_branch_frames(
    branch: SelectedBranch, parts: list[BranchPart], costs: list[PartCost], settings: VideoSettings
) -> Iterator[Frame]:
    """Draw the frames of a branch from its start; the last frame is repeated for `VIDEO_HOLD_S` seconds.

    All frames have the same layout, and one legend that covers everything shown in the branch.

    Parameters
    ----------
    branch : SelectedBranch
        The branch.
    parts : list of BranchPart
        Its parts.
    costs : list of PartCost
        Costs along the parts, for captions.
    settings : VideoSettings
        Size, speed and layers of the video.
    """
    drawer = _build_drawer(branch, parts, costs, settings)
    frame_period = settings.speed / settings.fps
    due = 0.0
    frame: Frame | None = None
    for run, node in branch.replay():
        if run.time + _TIME_TOLERANCE_S < due and not branch.is_end(run, node):
            continue
        frame = drawer.draw(run, node)
        yield frame
        due += frame_period
        # In slow motion, several frames show the same step.
        while due <= run.time + _TIME_TOLERANCE_S:
            yield frame
            due += frame_period
    assert frame is not None
    for _ in range(round(VIDEO_HOLD_S * settings.fps)):
        yield frame


def _build_drawer(
    branch: SelectedBranch, parts: list[BranchPart], costs: list[PartCost], settings: VideoSettings
) -> "_FrameDrawer":
    """Build the drawer of the frames, with a layout for the largest number of panes in the branch."""
    widest = max(parts, key=lambda part: len(part.setups))
    width, height = settings.video_size
    caption_height = round(CAPTION_PX * choose_scale((width, height)))
    layout: PaneLayout | None = None
    if len(widest.setups) > 1:
        scenes = [scene for part in parts for scene in part.scenes]
        records = build_part_records(widest, branch.root)
        layout = build_pane_layout(records, settings, (width, height - caption_height), legend_scenes=scenes)
    return _FrameDrawer(settings, costs, layout, (width, height - caption_height), caption_height, {})


@dataclass(frozen=True)
class _FrameDrawer:
    """Draws frames of a branch.

    Attributes
    ----------
    settings : VideoSettings
        Layers and colors.
    costs : list of PartCost
        Costs along the branch.
    layout : PaneLayout or None
        Layout of the panes and their legend; None if there is a single pane.
    picture_size : tuple of int
        Width and height of a frame without its caption, px.
    caption_height : int
        Height of the caption, px.
    painters : dict of int to Painter
        Painter of each pane, by its number; filled as panes are drawn.
    """

    settings: VideoSettings
    costs: list[PartCost]
    layout: PaneLayout | None
    picture_size: tuple[int, int]
    caption_height: int
    painters: dict[int, Painter]

    def draw(self, run: PaneGroup, node: Node) -> Frame:
        """Draw the current step of a run, with the caption of the last edit."""
        names = name_folders([pane.controller.name for pane in run.panes])
        frames: list[Frame] = []
        for pane, name in zip(run.panes, names, strict=True):
            painter = self._get_painter(run, pane)
            frames.append(painter.render_frame(build_pane_scene(pane, self.costs, name)))
        theme = self.settings.color_theme
        page = frames[0] if self.layout is None else self.layout.compose_page(frames, theme)
        size = (self.picture_size[0], self.caption_height)
        caption = _draw_caption(_describe_edit(node, run.scenario.dt), size, theme)
        return np.concatenate([page, caption])

    def _get_painter(self, run: PaneGroup, pane: Pane) -> Painter:
        """Return the painter of a pane; build a new one if the boundary of the map has changed."""
        environment = run.scenario.environment
        painter = self.painters.get(pane.number)
        if painter is None or painter.environment.boundary != environment.boundary:
            painter = self._build_painter(run)
            self.painters[pane.number] = painter
        painter.environment = environment
        return painter

    def _build_painter(self, run: PaneGroup) -> Painter:
        """Build the painter of a pane with the visible layers and the size that the layout gives it."""
        settings = self.settings
        if self.layout is None:
            layers = build_standard_layers(settings.colors)
            size = self.picture_size
            scale = None
        else:
            layers = build_pane_layers(settings.colors)
            size = self.layout.pane
            scale = self.layout.scale
        painter = Painter(run.scenario.environment, size, settings.color_theme, layers, scale)
        painter.change_visible(settings.shown_layers, settings.hidden_layers)
        return painter


def _describe_edit(node: Node, dt: float) -> str:
    """Return the caption for an edit; empty for the start of a run."""
    if node.scenario is not None:
        return ""
    return f"{node.branch_step * dt:.1f} s   {node.description}"


def _draw_caption(text: str, size: tuple[int, int], theme: Theme) -> Frame:
    strip = pygame.Surface(size, 0, 32)
    strip.fill(theme.panel)
    text_size = round(0.5 * size[1])
    short_text = shorten_to_width(text, text_size, size[0] - 2 * text_size, bold=True)
    picture = render_text(short_text, text_size, theme.ink, bold=True)
    strip.blit(picture, picture.get_rect(midleft=(text_size, size[1] // 2)))
    return copy_pixels(strip)
