"""The import dialogue: options on the left, the map before and after, and the report; see `importing`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pygame
import shapely

from robocov_app.importers.report import square_metres
from robocov_app.render.camera import Camera
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.render.layout import columns_for
from robocov_app.render.theme import LIGHT, mix
from robocov_app.viewer.overlays import card, dim, wrapped

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov_app.editor.ui.importing import Imported, ImportQuestion, Option
    from robocov_app.render.theme import Colour, Theme

_COLUMN, _ROW, _LINE, _ABOVE = 300, 25, 17, 40
"""Pixels at scale 1: of the options, of a row of them, of a line of the report, above each map."""

_FEWEST_LINES = 7
"""Of the report there is room for so many, and for more below maps that are wide."""

_MARK = 150
"""Opacity of what is marked, of 255."""

_HINT = (
    "click into the map: keep that part · ↑ ↓ option · ← → choice · Del default · Enter imports · Esc leaves"
)


class ImportView:
    """Draws an `ImportQuestion`, and knows what is where in it."""

    def __init__(self) -> None:
        self._rows: list[tuple[pygame.Rect, int]] = []
        self._buttons: list[tuple[pygame.Rect, str]] = []
        self._cameras: list[Camera] = []
        self._picture: tuple[tuple[object, ...], pygame.Surface] | None = None

    def at(self, pixel: tuple[int, int]) -> tuple[int | None, str, tuple[float, float] | None]:
        """Return what is at a pixel: the number of an option, the key of a button, a place on the map, m."""
        row = next((k for rect, k in self._rows if rect.collidepoint(pixel)), None)
        key = next((key for rect, key in self._buttons if rect.collidepoint(pixel)), "")
        for camera in self._cameras:
            if pygame.Rect(camera.view).collidepoint(pixel):
                x, y = camera.to_world(np.array(pixel, dtype=float)).tolist()
                digits = max(0, math.ceil(math.log10(camera.zoom)))  # no finer than a pixel
                return row, key, (round(x, digits), round(y, digits))
        return row, key, None

    def draw(self, screen: pygame.Surface, asked: ImportQuestion, scale: float, theme: Theme) -> None:
        """Draw it over the window."""
        dim(screen, theme)
        box = screen.get_rect().inflate(round(-32 * scale), round(-32 * scale))
        card(screen, box, theme, scale)
        inner = box.inflate(round(-36 * scale), round(-28 * scale))
        column = pygame.Rect(inner.left, inner.top, round(_COLUMN * scale), inner.height)
        self._draw_options(screen, asked, column, scale, theme)
        edge = column.right + round(16 * scale)
        screen.fill(mix(theme.panel, theme.ink, 0.15), (edge, inner.top, max(1, round(scale)), inner.height))
        right = pygame.Rect(edge + round(16 * scale), inner.top, 0, inner.height)
        right.width = inner.right - right.left
        maps = right.copy()
        maps.height -= round((_LINE * (_FEWEST_LINES + 1) + 14) * scale)
        if asked.imported is not None:
            maps = self._draw_maps(screen, asked, asked.imported, maps, scale, theme)
        else:
            self._cameras = []
            words = label("nothing to show" if asked.trouble else "reading…", round(13 * scale), theme.faint)
            screen.blit(words, words.get_rect(center=maps.center))
        below = maps.bottom + round(14 * scale)
        said = pygame.Rect(right.left, below, right.width, right.bottom - below)
        self._draw_report(screen, asked, said, scale, theme)

    # options

    def _draw_options(
        self, screen: pygame.Surface, asked: ImportQuestion, box: pygame.Rect, scale: float, theme: Theme
    ) -> None:
        size, small = round(12.5 * scale), round(11 * scale)
        title = shortened(f"Import {asked.path.name}", round(16 * scale), box.width, True)
        screen.blit(label(title, round(16 * scale), theme.ink, True), box.topleft)
        words = shortened(asked.importer.title, small, box.width)
        screen.blit(label(words, small, theme.faint), (box.left, box.top + round(24 * scale)))
        foot = box.bottom - round(36 * scale)
        self._draw_buttons(
            screen, asked, pygame.Rect(box.left, foot, box.width, box.bottom - foot), scale, theme
        )
        help_lines = wrapped(asked.option.help, small, box.width)[:5]
        top = box.top + round(50 * scale)
        room = foot - top - round((16 * 5 + 14) * scale)
        row = min(_ROW * scale, room / len(asked.options))
        self._rows = []
        for k, option in enumerate(asked.options):
            rect = pygame.Rect(box.left, round(top + k * row), box.width, round(row) - 1)
            self._rows.append((rect, k))
            self._draw_row(screen, asked, option, rect, size, theme)
        y = round(top + len(asked.options) * row + 10 * scale)
        for k, line in enumerate(help_lines):
            screen.blit(label(line, small, theme.faint), (box.left, y + round(16 * k * scale)))

    def _draw_row(
        self,
        screen: pygame.Surface,
        asked: ImportQuestion,
        option: Option,
        rect: pygame.Rect,
        size: int,
        theme: Theme,
    ) -> None:
        chosen, given = option is asked.option, option.name in asked.given
        if chosen:
            pygame.draw.rect(screen, mix(theme.panel, theme.final, 0.2), rect, border_radius=size // 3)
        pad = size // 2
        name = label(option.name.replace("_", " "), size, theme.ink, given)
        screen.blit(name, name.get_rect(midleft=(rect.left + pad, rect.centery)))
        text = asked.text(option) or ("" if chosen and not option.choices else "default")
        if chosen:
            text = f"‹ {text} ›" if option.choices else f"{text}▏"
        while text_width(text, size, given) > rect.width - name.get_width() - 3 * pad and len(text) > 2:
            text = f"…{text[2:]}"  # the end is what is typed
        ink = theme.ink if given or chosen else theme.faint
        words = label(text, size, ink, given)
        screen.blit(words, words.get_rect(midright=(rect.right - pad, rect.centery)))

    def _draw_buttons(
        self, screen: pygame.Surface, asked: ImportQuestion, box: pygame.Rect, scale: float, theme: Theme
    ) -> None:
        self._buttons = []
        size, radius, left = round(12.5 * scale), round(4 * scale), box.left
        ready = asked.ready
        for text, key in (("Import", "return"), ("Cancel", "escape")):
            rect = pygame.Rect(left, box.bottom - round(30 * scale), round(92 * scale), round(30 * scale))
            first = key == "return"
            fill = theme.final if first and ready else mix(theme.panel, theme.ink, 0.06)
            pygame.draw.rect(screen, fill, rect, border_radius=radius)
            edge = fill if first and ready else mix(theme.panel, theme.ink, 0.24)
            pygame.draw.rect(screen, edge, rect, max(1, round(scale)), border_radius=radius)
            on_fill = (255, 255, 255) if theme is LIGHT else theme.background
            ink = theme.ink if not first else on_fill if ready else theme.faint
            words = label(text, size, ink, first)
            screen.blit(words, words.get_rect(center=rect.center))
            self._buttons.append((rect, key))
            left = rect.right + round(8 * scale)

    # what comes of it

    def _draw_report(
        self, screen: pygame.Surface, asked: ImportQuestion, box: pygame.Rect, scale: float, theme: Theme
    ) -> None:
        """Draw the report, or what is wrong; and at the foot of the box what can be done."""
        small = round(11.5 * scale)
        said = asked.imported.report.lines() if asked.imported is not None else []
        ink = mix(theme.panel, theme.ink, 0.85)
        if asked.trouble:
            said, ink = [asked.trouble], theme.trajectory
        lines = [line for each in said for line in wrapped(each, small, box.width)]
        most = int(box.height / (_LINE * scale)) - 1
        if len(lines) > most:
            lines = [*lines[: most - 1], f"and {len(lines) - most + 1} lines more"]
        hint = "importing…" if asked.busy and asked.imported is not None else _HINT
        words = label(shortened(hint, round(11 * scale), box.width), round(11 * scale), theme.faint)
        screen.blit(words, words.get_rect(bottomleft=box.bottomleft))
        for k, line in enumerate(lines):
            screen.blit(label(line, small, ink), (box.left, box.top + round(_LINE * k * scale)))

    def _draw_maps(
        self,
        screen: pygame.Surface,
        asked: ImportQuestion,
        imported: Imported,
        box: pygame.Rect,
        scale: float,
        theme: Theme,
    ) -> pygame.Rect:
        """Draw them at the top of a box; return where they are."""
        low_x, low_y, high_x, high_y = bounds = imported.comparison.bounds
        aspect, above, gap = (high_x - low_x) / (high_y - low_y), round(_ABOVE * scale), round(20 * scale)
        columns = columns_for(2, aspect, box.size, above)
        wide = (box.width - (columns - 1) * gap) // columns
        most = (box.height if columns == 2 else (box.height - gap) // 2) - above
        high = min(most, round(wide / aspect))
        corners = [box.topleft, (box.right - wide, box.top + (2 - columns) * (above + high + gap))]
        map_wide = float(min(wide, round(high * aspect)))
        views = [(float(x), float(y + above), map_wide, float(high)) for x, y in corners]
        self._cameras = [Camera.fit(bounds, view, 2 * scale) for view in views]
        key = (imported, screen.get_size(), scale, theme)
        if self._picture is None or any(
            a is not b and a != b for a, b in zip(self._picture[0], key, strict=True)
        ):
            self._picture = key, _maps(screen.get_size(), imported, self._cameras, scale, theme)
        screen.blit(self._picture[1], (0, 0))
        self._draw_captions(screen, imported, corners, wide, scale, theme)
        inside = next(option for option in asked.options if option.name == "inside")
        if inside.name in asked.given and not asked.trouble:
            for camera in self._cameras:
                x, y = camera.to_pixels(np.array(inside.value(asked.given["inside"]))).tolist()
                for width, ink in ((5, theme.background), (2, theme.final)):
                    arm = 7 * scale + width / 2
                    pygame.draw.line(screen, ink, (x - arm, y), (x + arm, y), round(width * scale))
                    pygame.draw.line(screen, ink, (x, y - arm), (x, y + arm), round(width * scale))
        if asked.trouble:  # of settings that are no more
            for view in views:
                veil = pygame.Surface(view[2:], pygame.SRCALPHA)
                veil.fill((*theme.panel, 140))
                screen.blit(veil, view[:2])
        return pygame.Rect(box.topleft, (box.width, corners[1][1] + above + high - box.top))

    def _draw_captions(
        self,
        screen: pygame.Surface,
        imported: Imported,
        corners: list[tuple[int, int]],
        wide: int,
        scale: float,
        theme: Theme,
    ) -> None:
        compared, report = imported.comparison, imported.report
        size, small = round(13 * scale), round(11 * scale)
        lost = (
            "" if compared.lost.is_empty else f"{square_metres(compared.lost.area, 3)} left out",
            theme.trajectory,
        )
        opened = (
            "" if compared.opened.is_empty else f"{square_metres(compared.opened.area, 3)} opened",
            theme.start,
        )
        passage = f", narrowest passage {compared.gap.width:.3g} m" if compared.gap is not None else ""
        rows = (
            ("as read", report.vertices_read, compared.before.area, "", lost),
            ("as imported", report.vertices_kept, compared.after.area, passage, opened),
        )
        for (x, y), (name, vertices, area, more, (mark, colour)) in zip(corners, rows, strict=True):
            screen.blit(label(name, size, theme.ink, True), (x, y))
            left = x + text_width(name, size, True) + round(10 * scale)
            if mark:
                square = pygame.Rect(left, y + round(4 * scale), round(9 * scale), round(9 * scale))
                pygame.draw.rect(screen, colour, square)
                screen.blit(label(mark, small, theme.ink), (left + round(14 * scale), y + round(2 * scale)))
            facts = shortened(f"{vertices} vertices, {square_metres(area)} free{more}", small, wide)
            screen.blit(label(facts, small, theme.faint), (x, y + round(20 * scale)))


def _maps(
    size: tuple[int, int], imported: Imported, cameras: list[Camera], scale: float, theme: Theme
) -> pygame.Surface:
    """Return a picture, else transparent, of the map as it was read and as it became."""
    compared = imported.comparison
    picture = pygame.Surface(size, pygame.SRCALPHA)
    ways = (
        (compared.before, compared.lost, theme.trajectory),
        (compared.after, compared.opened, theme.start),
    )
    for camera, (free, marked, colour) in zip(cameras, ways, strict=True):
        _fill(picture, camera, compared.region, theme.obstacle, theme.obstacle)
        _fill(picture, camera, free, theme.background, theme.obstacle)
        for ring in shapely.get_rings(shapely.get_parts(free)):
            points = camera.to_pixels(shapely.get_coordinates(ring)).tolist()
            pygame.draw.aalines(picture, theme.obstacle_edge, True, points)
        marks = pygame.Surface(size, pygame.SRCALPHA)
        _fill(marks, camera, marked, (*colour, _MARK), (0, 0, 0, 0))
        picture.blit(marks, (0, 0))
    if compared.gap is not None:
        ends = cameras[1].to_pixels(np.array(compared.gap.between))
        pygame.draw.line(picture, theme.final, ends[0].tolist(), ends[1].tolist(), round(2 * scale))
        reach = float(np.hypot(*(ends[1] - ends[0]))) / 2
        if reach < 10 * scale:
            pygame.draw.circle(picture, theme.final, ends.mean(axis=0).tolist(), 10 * scale, round(2 * scale))
    return picture


def _fill(
    surface: pygame.Surface,
    camera: Camera,
    area: BaseGeometry,
    inside: Colour | tuple[int, int, int, int],
    holes: Colour | tuple[int, int, int, int],
) -> None:
    """Fill polygons; what lies in the hole of another is smaller, and drawn after it."""
    parts = [part for part in shapely.get_parts(area).tolist() if part.geom_type == "Polygon"]
    for part in sorted(parts, key=lambda each: -shapely.Polygon(each.exterior).area):
        for ring, colour in [(part.exterior, inside), *((hole, holes) for hole in part.interiors)]:
            pygame.draw.polygon(surface, colour, camera.to_pixels(shapely.get_coordinates(ring)).tolist())
