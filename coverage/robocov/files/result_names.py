"""Names of the files and folders in the folder of a result or a sweep.

A run can be loaded again from `RUN_FILE` and `RECORD_FILE`. The other files, such as tables, figures, videos
and reports, are for people and other programs.
"""

RUN_FILE = "run.json"
"""Scenario of a run, and its summary. The file marks a folder as that of a run."""
RECORD_FILE = "record.npz"
"""Arrays of the record of a run."""
COST_FILE = "cost.csv"
"""Coverage cost over time, of a run or of a branch with all of its parts."""
METRICS_FILE = "metrics.csv"
"""Metrics of a run over time."""
RUN_VIDEO_FILE = "run.mp4"
"""Video of a single run."""

COMPARISON_FILE = "comparison.json"
"""Folders and results of the runs of a comparison. The file marks a folder as that of a comparison."""
COMPARISON_TABLE_FILE = "comparison.csv"
"""Results of the runs of a comparison as a table."""
COMPARISON_VIDEO_FILE = "comparison.mp4"
"""Video of several runs side by side."""

REPLAY_FILE = "replay.json"
"""Folder of the replayed result. The file marks a folder as that of a rendered replay."""

BRANCH_FILE = "branch.json"
"""Folders of the parts of a branch. The file marks a folder as that of a branch with several parts."""
FORMER_BRANCH_FILE = "story.json"
"""Name of this file in folders of earlier versions."""
SESSION_FILE = "session.robocov"
"""Session from which a branch was saved."""

STUDY_FILE = "study.json"
"""Study of a sweep. The file marks a folder as that of a sweep."""
SWEEP_TABLE_FILE = "results.csv"
"""Table of a sweep, with one row per run."""
SWEEP_PARQUET_FILE = "results.parquet"
"""The table of a sweep in the format Parquet."""
RUNS_FOLDER = "runs"
"""Folder of a sweep that contains the folders of its runs."""
ERROR_FILE = "error.json"
"""Error of a failed run of a sweep, which has no `RUN_FILE`."""

TRAJECTORIES_FIGURE = "trajectories"
"""Name, without a suffix, of the figure of the trajectories of one or several runs."""
COST_FIGURE = "cost"
"""Name, without a suffix, of the figure of the coverage cost of one or several runs over time."""
FIGURE_SUFFIXES = (".png", ".svg")
"""Suffixes of the files of each figure."""
FRAMES_FOLDER = "frames"
"""Folder of the frames of a video, as PNG files."""
REPORT_FILE = "report.html"
"""Report on a result."""
