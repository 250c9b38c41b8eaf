"""The import dialog: options at the left, the map before and after at the right, the report below."""

import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.errors import RobocovError
from robocov_app.editor.ui.import_sheet import declared_colours, find_role, give_role, next_role
from robocov_app.editor.ui.importing import Imported, options_of
from robocov_app.formats import Importer, ReadOptions, Shaping
from robocov_app.formats.colours import Colour, name_colour
from robocov_app.formats.reports import format_area
from robocov_app.jobs.workers import Worker
from robocov_app.render import layout, surface_cache
from robocov_app.render.camera import Camera
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.render.theme import Theme
from robocov_app.toolkit.dialogs import Dialog
from robocov_app.toolkit.overlay import wrapped
from robocov_app.toolkit.text_edit import TextEdit
from robocov_app.toolkit.ui import SMALL, Ui

# pixels at scale 1: of the options, of their names, beside them, of a line of the report, above each map
_COLUMN, _NAME, _GAP, _LINE, _ABOVE = 300, 126, 32, 17, 40
_FEWEST_LINES = 7  # of the report; more below maps that are wide
_HINTS = {
    "part": "click into the map: keep that part · Tab option · Enter imports · Esc leaves",
    "colour": "click into the left map, or Space on a colour: free, solid, ignored · Enter imports",
}
_CHIP, _SWATCH = 78, 12  # pixels at scale 1: of a colour with its role, and of its square
_ROLE_NAMES = {None: "default", "free": "free", "solid": "solid", "ignore": "ignore"}
_DEFAULT = "default"


class ImportDialog(Dialog):
    """Asks how a file is to be imported, with a live preview; `call` gets what is accepted."""

    width = 10_000.0  # all that the window has

    def __init__(
        self, path: Path, importer: Importer, worker: Worker[Imported], call: Callable[[Imported], object]
    ) -> None:
        self.path, self.importer, self.call = path, importer, call
        self.options = options_of(importer)
        self.given: dict[str, str] = {}  # what was typed or chosen, by the names of options
        self.imported: Imported | None = None  # of the newest settings that could be imported
        self.accepted = False  # whether it is wanted as it is set, as soon as it is there
        self.cameras: list[Camera] = []
        self.clicks = "part"  # what a click into the map chooses: a part to keep, or the role of a colour
        self._seen: Ui | None = None
        self._worker = worker
        self._picture: surface_cache.Latest[Surface] = surface_cache.Latest()
        self._ask()

    def set(self, name: str, text: str) -> None:
        option = next(each for each in self.options if each.name == name)
        if not text or text in (option.default, _DEFAULT):
            self.given.pop(name, None)
        else:
            self.given[name] = text[:200]
        self._ask()

    def keep_inside(self, place: tuple[float, float]) -> None:
        self.given.pop("keep", None)
        self.set("inside", f"{place[0]:.10g} {place[1]:.10g}")

    @property
    def has_colours(self) -> bool:
        """Whether the colours of the file can be given a role."""
        takes = "free_colour" in self.importer.options
        return takes and self.imported is not None and self.imported.sheet is not None

    def cycle_colour(self, colour: Colour) -> None:
        """Give a colour the next role: free, solid, ignored, and none."""
        give_role(self.given, colour, next_role(find_role(self.given, colour)))
        self._ask()

    def settings(self) -> tuple[ReadOptions, Shaping]:
        named = {each.name: each for each in self.options}
        values = {name: named[name].value(text) for name, text in self.given.items()}
        of_reading = {field.name for field in fields(ReadOptions)}
        read = {name: values.pop(name) for name in values.keys() & of_reading}
        return ReadOptions(**read), Shaping(**values)

    def _ask(self) -> None:
        self.accepted, self._mistake = False, ""
        try:
            self._worker.put((self.path, self.importer.name, *self.settings()))
        except RobocovError as error:
            self._mistake = str(error)

    def poll(self) -> Imported | None:
        if (answer := self._worker.poll()) is not None and not self._worker.busy:
            self.imported = answer
        if self.trouble:
            self.accepted = False
        return self.imported if self.accepted and self.ready else None

    @property
    def busy(self) -> bool:
        return not self._mistake and self._worker.busy

    @property
    def trouble(self) -> str:
        return self._mistake or ("" if self._worker.busy else self._worker.trouble)

    @property
    def ready(self) -> bool:
        return self.imported is not None and not self.busy and not self.trouble

    def key(self, name: str, ui: Ui) -> bool:
        accepts = name in ("return", "enter") and ui.open_list is None
        self.accepted |= accepts
        return accepts

    def cancelled(self) -> None:
        self._worker.close()

    def page(self, ui: Ui) -> None:
        left, top, wide = ui.x, ui.y, ui.wide
        high = pygame.display.get_window_size()[1] / ui.scale - 2 * top - 8
        ui.wide = _COLUMN
        self._options(ui, top + high)
        ui.x, ui.y, ui.wide = left + _COLUMN + _GAP, top, wide - _COLUMN - _GAP
        room = high - (_LINE * (_FEWEST_LINES + 1) + 14)
        if self.has_colours:
            before = ui.y
            self._colours(ui)
            room -= ui.y - before
        maps_top = ui.y
        ui.row(height=room, below=0)
        rect, clicked = ui.area("maps")
        if self.imported is not None:
            maps = self._place(rect, self.imported, ui.scale)
            if ui.surface is not None:
                self._draw_maps(ui.surface, self.imported, ui.scale, ui.theme)
            if clicked:
                self._click(ui.at)
            ui.end_row()
            ui.y = maps_top + maps / ui.scale + 14
        else:
            ui.space(14)
            if ui.surface is not None:
                words = label("nothing to show" if self.trouble else "reading…", ui.px(13), ui.theme.faint)
                ui.surface.blit(words, words.get_rect(center=rect.center))
        self._report(ui, top + high)
        ui.x, ui.y, ui.wide = left, top + high, wide

    def _click(self, at: tuple[int, int]) -> None:
        """Take a click into one of the maps."""
        for k, camera in enumerate(self.cameras):
            if not Rect(camera.view).collidepoint(at):
                continue
            x, y = camera.to_world(np.array(at, dtype=float)).tolist()
            if self._shows_colours and k == 0:
                assert self.imported is not None and self.imported.sheet is not None
                colour = self.imported.sheet.find_colour(x, y)
                if colour is not None:
                    self.cycle_colour(colour)
            else:
                digits = max(0, math.ceil(math.log10(camera.zoom)))  # no finer than a pixel
                self.keep_inside((round(x, digits), round(y, digits)))

    @property
    def _shows_colours(self) -> bool:
        return self.has_colours and self.clicks == "colour"

    def _colours(self, ui: Ui) -> None:
        """Show what a click chooses and, for colours, each with its role."""
        ui.row(56, 84, 84, 0, height=24, below=6)
        ui.label("A click", style="unit")
        for name, text, tip in (
            ("part", "keeps a part", "A click into a map keeps that part of the free space"),
            ("colour", "sets a colour", "A click into the left map makes its colour free, solid or ignored"),
        ):
            if ui.button(text, key=f"clicks:{name}", chosen=self.clicks == name, small=True, tip=tip):
                self.clicks = name
        ui.end_row()
        if self._shows_colours:
            self._chips(ui)

    def _chips(self, ui: Ui) -> None:
        assert self.imported is not None and self.imported.sheet is not None
        colours = list(dict.fromkeys([*declared_colours(self.given), *self.imported.sheet.colours]))
        colours = colours[: max(int((ui.wide + 6) // (_CHIP + 6)), 1)]
        ui.row(*[_CHIP] * len(colours), 0, height=24, below=8)
        for colour in colours:
            role = find_role(self.given, colour)
            name = name_colour(colour)
            key = f"colour:{name}"
            text = f"     {_ROLE_NAMES[role]}"
            if ui.button(
                text, key=key, chosen=role is not None, small=True, tip=f"{name}: a click changes it"
            ):
                self.cycle_colour(colour)
            shown = ui.find("button", key)
            if ui.surface is not None and shown is not None:
                side = ui.px(_SWATCH)
                square = Rect(shown.rect.left + ui.px(7), shown.rect.centery - side // 2, side, side)
                pygame.draw.rect(ui.surface, colour, square)
                pygame.draw.rect(ui.surface, ui.theme.faint, square, 1)
        ui.end_row()

    def _options(self, ui: Ui, foot: float) -> None:
        ui.words(f"Import {self.path.name}", size=16, bold=True)
        ui.label(self.importer.title, style="unit")
        ui.end_row()
        if ui is not self._seen:  # letters go into the first field
            self._seen = ui
            first = next(option.name for option in self.options if not option.choices)
            ui.focus, ui.edit = first, TextEdit.of(self.given.get(first, ""))
        ui.row(_NAME, 0, height=min((foot - 44 - ui.y) / len(self.options), 28.0) - 4, below=4)
        for option in self.options:
            name, tip = option.name, option.help
            now = self.given.get(name, option.default)
            ui.label(name.replace("_", " "), tip=tip, style="bold" if name in self.given else "")
            if option.choices:
                choices = option.choices if option.default else (_DEFAULT, *option.choices)
                text = ui.dropdown(name, choices, now or _DEFAULT, tip=tip)
            else:
                text = ui.text_entry(name, now, ghost=_DEFAULT, tip=tip, live=True)
            if text is not None and text != now:
                self.set(name, text)
        ui.end_row()
        said = next((option.help for option in self.options if option.name == ui.focus), "")
        lines = wrapped(said, ui.px(SMALL), ui.px(ui.wide))[: max(int((foot - 40 - ui.y) / (SMALL + 5)), 0)]
        ui.words(" ".join(lines), size=SMALL, colour=ui.theme.faint)
        ui.y = foot - 30
        ui.row(92, 92, height=30, below=0)
        self.accepted |= ui.button("Import", chosen=self.ready, key="import", tip=self.trouble)
        if ui.button("Cancel", key="cancel"):
            self.done = True
            self.cancelled()
        ui.end_row()

    def _report(self, ui: Ui, foot: float) -> None:
        said: list[str] = []
        if self.trouble:
            said = [self.trouble]
        elif self.imported:
            said = self.imported.report.format_lines()
        lines = [line for each in said for line in wrapped(each, ui.px(SMALL), ui.px(ui.wide))]
        most = int((foot - ui.y) / _LINE) - 1
        if len(lines) > most:
            lines = [*lines[: most - 1], f"and {len(lines) - most + 1} lines more"]
        ui.row(height=_LINE, below=0)
        if ui.surface is not None:
            for line in lines:
                colour = ui.theme.trajectory if self.trouble else ui.theme.ink
                ui.surface.blit(label(line, ui.px(SMALL), colour), ui.cell())
        ui.end_row()
        ui.y = foot - _LINE
        hint = _HINTS["colour" if self._shows_colours else "part"]
        ui.label("importing…" if self.busy and self.imported is not None else hint, style="unit")
        ui.end_row()

    def _place(self, box: Rect, imported: Imported, scale: float) -> float:
        """Place the two maps at the top of a box; return the height that they take, px."""
        low_x, low_y, high_x, high_y = bounds = imported.comparison.bounds
        aspect, above, gap = (high_x - low_x) / (high_y - low_y), round(_ABOVE * scale), round(20 * scale)
        columns = layout.columns_for(2, aspect, box.size, above)
        wide = (box.width - (columns - 1) * gap) // columns
        most = (box.height if columns == 2 else (box.height - gap) // 2) - above
        high = min(most, round(wide / aspect))
        corners = [box.topleft, (box.right - wide, box.top + (2 - columns) * (above + high + gap))]
        map_wide = float(min(wide, round(high * aspect)))
        views = [(float(x), float(y + above), map_wide, float(high)) for x, y in corners]
        self.cameras, self._wide = [Camera.fit(bounds, view, 2 * scale) for view in views], wide
        return corners[1][1] + above + high - box.top

    def _draw_maps(self, screen: Surface, imported: Imported, scale: float, theme: Theme) -> None:
        shows_colours = self._shows_colours
        look = (*(camera.view for camera in self.cameras), scale, theme, shows_colours)

        def draw() -> Surface:
            picture = _maps(screen, imported, self.cameras, scale, theme)
            if shows_colours and imported.sheet is not None:
                imported.sheet.draw(picture, self.cameras[0])
            return picture

        maps = self._picture.of(imported, look, draw)
        screen.blit(maps, (0, 0))
        self._draw_captions(screen, imported, scale, theme)
        inside = next(option for option in self.options if option.name == "inside")
        if "inside" in self.given and not self.trouble:
            for camera in self.cameras:
                x, y = camera.to_pixels(np.array(inside.value(self.given["inside"]))).tolist()
                for width, ink in ((5, theme.background), (2, theme.final)):
                    arm = 7 * scale + width / 2
                    pygame.draw.line(screen, ink, (x - arm, y), (x + arm, y), round(width * scale))
                    pygame.draw.line(screen, ink, (x, y - arm), (x, y + arm), round(width * scale))
        for camera in self.cameras if self.trouble else ():  # of settings that are no more
            veil = Surface(camera.view[2:], pygame.SRCALPHA)
            veil.fill((*theme.panel, 140))
            screen.blit(veil, camera.view[:2])

    def _draw_captions(self, screen: Surface, imported: Imported, scale: float, theme: Theme) -> None:
        compared, report = imported.comparison, imported.report
        size, small = round(13 * scale), round(SMALL * scale)
        lost = "" if compared.lost.is_empty else f"{format_area(compared.lost.area, 3)} left out"
        opened = "" if compared.opened.is_empty else f"{format_area(compared.opened.area, 3)} opened"
        passage = f", narrowest passage {compared.gap.width:.3g} m" if compared.gap is not None else ""
        rows = (
            ("as read", report.vertices_read, compared.before.area, "", lost, theme.trajectory),
            ("as imported", report.vertices_kept, compared.after.area, passage, opened, theme.start),
        )
        for k, (camera, row) in enumerate(zip(self.cameras, rows, strict=True)):
            name, vertices, area, more, mark, colour = row
            if k == 0 and self._shows_colours:
                name, mark = "in its colours", ""
            x, y = round(camera.view[0]), round(camera.view[1] - _ABOVE * scale)
            screen.blit(label(name, size, theme.ink, True), (x, y))
            left = x + text_width(name, size, True) + round(10 * scale)
            if mark:
                square = Rect(left, y + round(4 * scale), round(9 * scale), round(9 * scale))
                pygame.draw.rect(screen, colour, square)
                screen.blit(label(mark, small, theme.ink), (left + round(14 * scale), y + round(2 * scale)))
            facts = shortened(f"{vertices} vertices, {format_area(area)} free{more}", small, self._wide)
            screen.blit(label(facts, small, theme.faint), (x, y + round(20 * scale)))


def _maps(screen: Surface, imported: Imported, cameras: list[Camera], scale: float, theme: Theme) -> Surface:
    compared, picture = imported.comparison, Surface(screen.get_size(), pygame.SRCALPHA)
    before, after = (compared.before, compared.lost), (compared.after, compared.opened)
    colours = theme.trajectory, theme.start
    for camera, (free, marked), colour in zip(cameras, (before, after), colours, strict=True):
        _fill(picture, camera, compared.region, theme.obstacle, theme.obstacle)
        _fill(picture, camera, free, theme.background, theme.obstacle)
        for ring in shapely.get_rings(shapely.get_parts(free)):
            points = camera.to_pixels(shapely.get_coordinates(ring)).tolist()
            pygame.draw.aalines(picture, theme.obstacle_edge, True, points)
        marks = Surface(screen.get_size(), pygame.SRCALPHA)
        _fill(marks, camera, marked, (*colour, 150), (0, 0, 0, 0))
        picture.blit(marks, (0, 0))
    if compared.gap is not None:
        ends = cameras[1].to_pixels(np.array(compared.gap.between))
        pygame.draw.line(picture, theme.final, ends[0].tolist(), ends[1].tolist(), round(2 * scale))
        if math.dist(*ends) < 20 * scale:
            pygame.draw.circle(picture, theme.final, ends.mean(axis=0).tolist(), 10 * scale, round(2 * scale))
    return picture


def _fill(
    surface: Surface, camera: Camera, area: shapely.Geometry, inside: Sequence[int], holes: Sequence[int]
) -> None:
    """Fill polygons; what lies in the hole of another is smaller, and drawn after it."""
    parts = [part for part in shapely.get_parts(area).tolist() if part.geom_type == "Polygon"]
    for part in sorted(parts, key=lambda each: -shapely.Polygon(each.exterior).area):
        for ring, colour in [(part.exterior, inside), *((hole, holes) for hole in part.interiors)]:
            pygame.draw.polygon(surface, colour, camera.to_pixels(shapely.get_coordinates(ring)).tolist())
