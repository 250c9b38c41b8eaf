"""A branch of a session made again without a window: records, costs, pictures and a film of the whole story.

A story without touches has one part, and the folder is that of ``robocov run`` or ``robocov compare``.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pygame

from robocov.controllers import has_memory
from robocov.environment import CircleObstacle
from robocov.errors import InputError, to_one_line
from robocov.files.result_folder import ResultFolder
from robocov.metrics import CostHistory, summarize
from robocov.record import Record, Recorder
from robocov_app.look.theme import Theme
from robocov_app.render.density import cost_label, mean_label
from robocov_app.render.fonts import label, shortened
from robocov_app.render.picture import Painter, pane_layers, scale_for, standard_layers
from robocov_app.render.scene import Scene
from robocov_app.runs.artifacts import save_comparison, save_figures, start_comparison
from robocov_app.runs.cost import build_cost
from robocov_app.runs.encoding import Frame
from robocov_app.runs.execution import Run, build_cost_table, evaluate_record, save_numbers
from robocov_app.runs.pane_layout import build_pane_layout
from robocov_app.runs.saved_runs import name_failed_robot, name_folders
from robocov_app.runs.settings import OutputSettings, VideoSettings
from robocov_app.runs.video import VIDEO_HOLD_S, get_video_name, write_frames_and_video
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import write_csv, write_json
from robocov_app.viewer.screen_video import copy_pixels
from robocov_app.viewer.session.document import Node, SessionDocument, replay
from robocov_app.viewer.session.edits import PlaceRobot
from robocov_app.viewer.session.map_edits import add_obstacle
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.states import PaneSetup

History: TypeAlias = tuple[float, str, CostHistory]  # when a part began, s, a controller's name, its cost

STORY = "story.json"
STRIP = 30  # height of a film's strip with what was done, px at scale 1


@dataclass(eq=False)
class Part:
    """A stretch of a story from touch to touch, as a record has it: with one map, team and controller."""

    node: Node
    begin: int  # step
    setups: dict[int, PaneSetup]
    recorders: dict[int, Recorder]
    scenes: list[Scene]  # of its beginning, and of the story's end, one for each pane: what a legend explains
    # between which steps which robot was moved by hand
    touched: list[list[int]] = field(default_factory=list)
    # at which steps which robot was put to another place
    placed: list[tuple[int, int]] = field(default_factory=list)
    ends: int = 0


def parts_of(document: SessionDocument, node: Node, end: int) -> list[Part]:
    parts: list[Part] = []
    for run, here in replay(document, node, end):
        setups = {pane.number: pane.setup for pane in run.panes}
        if not parts or parts[-1].setups != setups:
            if parts and parts[-1].node is here and here.scenario is None:
                parts.pop()  # the touch is still going on
            recorders = {number: _recorder(setup, run.scenario.dt) for number, setup in setups.items()}
            scenes = [_scene(pane, [], "") for pane in run.panes]
            parts.append(Part(here, run.step, setups, recorders, scenes))
        part = parts[-1]
        part.ends = run.step
        for pane in run.panes:
            part.recorders[pane.number].add(pane.simulation.observe_and_decide())
        held = {run.drag[0]} if run.drag is not None else set()
        moved = {each.robot for each in here.edits if each.step == run.step and isinstance(each, PlaceRobot)}
        part.placed += [(run.step, robot) for robot in sorted(moved)]
        held |= moved
        for robot in held:
            last = next((each for each in part.touched if each[2] == robot and each[1] >= run.step - 1), None)
            if last is None:
                part.touched.append([run.step, run.step + 1, robot])
            else:
                last[1] = run.step + 1
    parts[-1].scenes += [_scene(pane, [], "") for pane in run.panes]
    return parts


def records_of_part(part: Part, root: Node) -> list[Record]:
    """Return the records of a part, one for each pane, of a branch that began at a node; time begins at 0."""
    scenario, found = root.require_scenario(), []
    for number, recorder in part.recorders.items():
        record, origin = recorder.record(), dict[str, Any]()
        if part.begin == 0 and part.node is root and scenario.given_starts is None:
            origin = {"start": scenario.start_name, "seed": scenario.seed}
        session = _session_of(part, part.setups[number], record, scenario.dt)
        time = np.arange(len(record), dtype=float) * scenario.dt
        found.append(replace(record, time=time, session=session, **origin))
    return found


def _recorder(setup: PaneSetup, dt: float) -> Recorder:
    environment, law = setup.environment, setup.controller
    for number, place in setup.failed.items():
        wreck = CircleObstacle(place, setup.properties.get_radius(number), name_failed_robot(number))
        environment = add_obstacle(environment, wreck)
    return Recorder(environment, setup.team, law.build(), dt, name=law.name, conditions=setup.conditions)


def _session_of(part: Part, setup: PaneSetup, record: Record, dt: float) -> dict[str, Any]:
    """Return what ``run.json`` says of where the record comes from; nothing where there is nothing to say."""
    said: dict[str, Any] = {}
    if part.begin:
        said["began_at_s"] = part.begin * dt
    if record.velocities[0].any():
        said["start_velocities_m_per_s"] = record.velocities[0].tolist()
    if setup.failed or setup.numbers != tuple(range(1, len(setup.numbers) + 1)):
        said["robots"] = list(setup.numbers)
        said["failed"] = {str(number): list(place) for number, place in setup.failed.items()}
    for begin, end, robot in part.touched:
        times = {"from_s": (begin - part.begin) * dt, "to_s": (end - part.begin) * dt}
        said.setdefault("touched", []).append({**times, "robots": [robot]})
    for step, robot in part.placed:
        said.setdefault("placed", []).append({"time_s": (step - part.begin) * dt, "robots": [robot]})
    known = part.begin == 0 or not has_memory(setup.controller.build())
    turned = record.steering is not None and bool(record.steering[0].any())
    repeatable = known and not part.touched and not turned
    return {**said, "repeatable": repeatable} if said or not repeatable else {}


def story_folders(folder: Path) -> list[tuple[Path, str]]:
    """Return the folders of a story's parts with words on each, in their order; else the folder itself."""
    try:
        content = json.loads((folder / STORY).read_bytes())
        if content["format"] != "robocov-story":
            return [(folder, "")]
        told = "{from_s:.1f} to {to_s:.1f} s, {words}"
        return [(folder / to_one_line(part["folder"]), told.format(**part)) for part in content["parts"]]
    except OSError:  # no story; if it cannot be read either, who reads it says why
        return [(folder, "")]
    except (ValueError, LookupError, TypeError) as error:
        raise InputError(f"{folder / STORY}: cannot be read: {to_one_line(error)}") from None


def save_story(
    document: SessionDocument,
    node: Node,
    end: int,
    result: ResultFolder,
    settings: OutputSettings,
    stop: Interruption,
) -> dict[str, Any]:
    root = document.get_path(node)[0]
    parts, dt, told, rows = parts_of(document, node, end), root.require_scenario().dt, [], []
    several, histories = len(parts) > 1, list[History]()
    for k, part in enumerate(parts, 1):
        folder = f"{k:02d}-{_file_name(part.node.description)}" if several else ""
        records = records_of_part(part, root)
        names = name_folders([record.controller for record in records])
        runs: dict[str, Run] = {}
        if len(records) > 1:
            (result.staging / folder).mkdir(exist_ok=True)
            start_comparison(result.staging / folder, names)
        costs = []
        for number, name, record in zip(part.setups, names, records, strict=True):
            place = result.staging / folder / (name if len(records) > 1 else "")
            record.save(place)
            # as in the window, robots that failed count as no obstacles of the cost
            bare = replace(record, environment=part.setups[number].environment)
            costs.append(build_cost(bare.environment, settings.lattice, quiet=True))
            history = evaluate_record(bare, costs[-1], stop, quiet=settings.quiet).history
            runs[name] = Run(record, history, summarize(record, history))
            save_numbers(runs[name], place, settings.lattice)
            histories.append((part.begin * dt, name, history))
            mean = runs[name].summary["mean_distance_m"]
            rows.append({"part": k, "controller": name, "mean_distance_m": mean})
        if len(records) > 1:
            save_comparison(runs, costs[0], result.staging / folder, settings)
        else:
            save_figures([runs[names[0]]], costs[0], result.staging / folder, settings)
        times = {"from_s": part.begin * dt, "to_s": part.ends * dt}
        told.append({"folder": folder, **times, "words": part.node.description})
        result.save_progress()
    if several:
        write_json(result.staging / STORY, {"format": "robocov-story", "version": 1, "parts": told})
        header = "controller," + build_cost_table(histories[0][2])[0]
        lines: list[tuple[object, ...]] = []
        for begin, name, history in histories:
            lines += [(name, begin + row[0], *row[1:]) for row in build_cost_table(history)[1]]
        write_csv(result.staging / "cost.csv", header, lines)
    look = settings.video
    if look.video or look.frames:
        film = result.staging / get_video_name(len(parts[-1].setups))
        total = round((end * dt / look.speed + VIDEO_HOLD_S) * look.fps) + 1
        frames = story_frames(document, node, end, parts, histories, look)
        write_frames_and_video(frames, total, film, look, stop, quiet=settings.quiet)
    return {"parts": told, "runs": rows}


def story_frames(
    document: SessionDocument,
    node: Node,
    end: int,
    parts: list[Part],
    histories: list[History],
    film: VideoSettings,
) -> Iterator[Frame]:
    """Draw a branch from its beginning: trajectories go on through all touches, each named below at its time.

    All panes have the same layout and one legend, of whatever the story shows, also where some are left out.
    """
    theme, painters = film.color_theme, dict[int, Painter]()
    widest, root = max(parts, key=lambda part: len(part.setups)), document.get_path(node)[0]
    count, dt = len(widest.setups), root.require_scenario().dt
    layers = partial(standard_layers if count == 1 else pane_layers, film.colors)
    width, height = film.video_size
    strip, layout = round(STRIP * scale_for((width, height))), None
    if count > 1:
        scenes = [scene for part in parts for scene in part.scenes]
        layout = build_pane_layout(
            records_of_part(widest, root), film, (width, height - strip), legend_scenes=scenes
        )
    due = 0.0
    for run, here in replay(document, node, end):
        if run.time + 1e-9 < due and not (here is node and run.step >= end):
            continue
        due += film.speed / film.fps
        panes, names = [], name_folders([pane.controller.name for pane in run.panes])
        for pane, name in zip(run.panes, names, strict=True):
            environment, painter = run.scenario.environment, painters.get(pane.number)
            if painter is None or painter.environment.boundary != environment.boundary:
                size, scale = (layout.pane, layout.scale) if layout else ((width, height - strip), None)
                painter = painters[pane.number] = Painter(environment, size, theme, layers(), scale)
                painter.change(film.shown_layers, film.hidden_layers)
            painter.environment = environment
            panes.append(painter.frame(_scene(pane, histories, name)))
        words = "" if here.scenario is not None else f"{here.branch_step * dt:.1f} s   {here.description}"
        page = panes[0] if layout is None else layout.compose_page(panes, theme)
        frame = np.concatenate([page, _caption(words, (width, strip), theme)])
        yield frame
    for _ in range(round(VIDEO_HOLD_S * film.fps)):
        yield frame


def _caption(words: str, size: tuple[int, int], theme: Theme) -> Frame:
    strip, text = pygame.Surface(size, 0, 32), round(0.5 * size[1])
    strip.fill(theme.panel)
    picture = label(shortened(words, text, size[0] - 2 * text, True), text, theme.ink, True)
    strip.blit(picture, picture.get_rect(midleft=(text, size[1] // 2)))
    return copy_pixels(strip)


def _scene(pane: Pane, histories: list[History], name: str) -> Scene:
    known: list[float] = []
    for begin, _, history in (each for each in histories if each[1] == name):
        known += history.mean_distance[begin + history.time <= pane.time + 1e-9].tolist()
    cost = cost_label(mean_label(pane.setup.environment), known[-1], None) if known else ""
    snapshot = pane.simulation.observe_and_decide()
    return pane.build_scene(pane.setup, snapshot, pane.trail.get_until(pane.time), cost=cost)


def _file_name(words: str) -> str:
    """Return words as they can be the name of a folder.

    >>> _file_name("robot 3 failed: RAPF, k_rep = 0.5")
    'robot-3-failed-RAPF-k_rep-0.5'
    """
    return re.sub(r"[^\w.]+", "-", words).strip(".-")[:48] or "part"
