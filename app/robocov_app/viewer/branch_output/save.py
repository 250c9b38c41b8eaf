"""Saving of a branch: records of its parts with costs and figures, and a video of the whole branch."""

import re
from dataclasses import dataclass, replace
from typing import Any

from robocov.cost import CoverageCost
from robocov.files.result_folder import ResultFolder
from robocov.files.result_names import COST_FILE
from robocov.metrics import summarize
from robocov.record import Record
from robocov_app.runs.artifacts import save_comparison, save_figures, start_comparison
from robocov_app.runs.cost import build_cost
from robocov_app.runs.cost_table import build_cost_table
from robocov_app.runs.execution import Run, evaluate_record, save_numbers
from robocov_app.runs.saved_runs import name_folders
from robocov_app.runs.settings import OutputSettings
from robocov_app.runs.video import get_video_name, write_frames_and_video
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import write_csv
from robocov_app.viewer.branch_output.folders import write_branch_file
from robocov_app.viewer.branch_output.parts import (
    BranchPart,
    PartCost,
    SelectedBranch,
    build_part_records,
    split_branch,
)
from robocov_app.viewer.branch_output.video import count_video_frames, draw_branch_frames

MAX_FOLDER_NAME_CHARS = 48


def save_branch(
    branch: SelectedBranch, result: ResultFolder, settings: OutputSettings, interruption: Interruption
) -> dict[str, Any]:
    """Simulate a branch, and save its records, costs, figures and video.

    Parameters
    ----------
    branch : SelectedBranch
        The branch.
    result : ResultFolder
        Folder for the files.
    settings : OutputSettings
        Which files to write, and how.
    interruption : Interruption
        Whether the user has requested to stop.

    Returns
    -------
    dict
        ``parts``: folder, times and description of each part. ``runs``: mean distance of each run.
    """
    return _BranchWriter(branch, result, settings, interruption).save()


@dataclass(frozen=True)
class _BranchWriter:
    """Writes the files of a branch; see `save_branch`."""

    branch: SelectedBranch
    result: ResultFolder
    settings: OutputSettings
    interruption: Interruption

    def save(self) -> dict[str, Any]:
        """Write all files; see `save_branch` for the return value."""
        dt = self.branch.scenario.dt
        parts = split_branch(self.branch)
        has_several_parts = len(parts) > 1
        costs: list[PartCost] = []
        part_rows: list[dict[str, Any]] = []
        run_rows: list[dict[str, Any]] = []
        # A branch without edits has one part, whose files are directly in the result's folder.
        for number, part in enumerate(parts, 1):
            description = part.node.description
            folder = f"{number:02d}-{_build_folder_name(description)}" if has_several_parts else ""
            for name, run in self._save_part(part, folder).items():
                costs.append(PartCost(part.first_step * dt, name, run.history))
                mean_distance = run.summary["mean_distance_m"]
                run_rows.append({"part": number, "controller": name, "mean_distance_m": mean_distance})
            times = {"from_s": part.first_step * dt, "to_s": part.last_step * dt}
            part_rows.append({"folder": folder, **times, "description": description})
            self.result.save_progress()
        if has_several_parts:
            write_branch_file(self.result.staging, part_rows)
            self._write_cost_table(costs)
        self._write_video(parts, costs)
        return {"parts": part_rows, "runs": run_rows}

    def _save_part(self, part: BranchPart, folder: str) -> dict[str, Run]:
        """Write the files of a part.

        Parameters
        ----------
        part : BranchPart
            The part.
        folder : str
            Name of its folder in the result; empty for the result's folder itself.

        Returns
        -------
        dict of str to Run
            Runs by the folder names of their controllers.
        """
        target = self.result.staging / folder
        records = build_part_records(part, self.branch.root)
        names = name_folders([record.controller for record in records])
        is_comparison = len(records) > 1
        if is_comparison:
            target.mkdir(exist_ok=True)
            start_comparison(target, names)
        runs: dict[str, Run] = {}
        costs: list[CoverageCost] = []
        for environment, name, record in zip(part.environments.values(), names, records, strict=True):
            run_folder = target / name if is_comparison else target
            record.save(run_folder)
            cost = build_cost(
                environment,
                self.settings.lattice,
                radius=record.team.min_radius,
                quiet=True,
            )
            runs[name] = self._evaluate(record, cost)
            save_numbers(runs[name], run_folder, self.settings.lattice)
            costs.append(cost)
        if is_comparison:
            save_comparison(runs, costs[0], target, self.settings)
        else:
            save_figures([runs[names[0]]], costs[0], target, self.settings)
        return runs

    def _evaluate(self, record: Record, cost: CoverageCost) -> Run:
        """Evaluate the cost of a record. As in the window, failed robots are not obstacles for the cost."""
        bare = replace(record, environment=cost.environment)
        run = evaluate_record(
            bare, cost, limit_samples=self.interruption.requested, quiet=self.settings.hide_progress
        )
        return Run(record, run.history, summarize(record, run.history))

    def _write_cost_table(self, costs: list[PartCost]) -> None:
        """Write the costs of all parts to one table, with times measured from the start of the branch."""
        header = ""
        rows: list[tuple[object, ...]] = []
        for cost in costs:
            header, part_rows = build_cost_table(cost.history)
            for time, *values in part_rows:
                rows.append((cost.controller, cost.start_time + time, *values))
        write_csv(self.result.staging / COST_FILE, f"controller,{header}", rows)

    def _write_video(self, parts: list[BranchPart], costs: list[PartCost]) -> None:
        settings = self.settings.video
        if not settings.video and not settings.frames:
            return
        path = self.result.staging / get_video_name(len(parts[-1].setups))
        count = count_video_frames(self.branch, settings)
        frames = draw_branch_frames(self.branch, parts, costs, settings)
        write_frames_and_video(
            frames, count, path, settings, self.interruption, quiet=self.settings.hide_progress
        )


def _build_folder_name(description: str) -> str:
    """Convert a description to the name of a folder.

    >>> _build_folder_name("robot 3 failed: RAPF, k_rep = 0.5")
    'robot-3-failed-RAPF-k_rep-0.5'
    """
    return re.sub(r"[^\w.]+", "-", description).strip(".-")[:MAX_FOLDER_NAME_CHARS] or "part"
