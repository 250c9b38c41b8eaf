"""Runs of scenarios, and the files of their results.

- `settings`: settings of the evaluation, of figures and of videos
- `execution`, `artifacts`: simulate and evaluate scenarios, and write a folder of results
- `saved_runs`: read such a folder again
- `cost`: the coverage cost of a map, with progress
- `frames`, `pane_layout`, `video`, `encoding`: frames and videos of runs
"""
