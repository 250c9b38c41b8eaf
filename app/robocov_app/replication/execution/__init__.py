"""Execution of the study, which can be interrupted and resumed at any time.

- `parts`: the figures, the paper's claims and the results beyond the paper, in order
- `runner`: runs single sweeps and searches in the folder of the study
- `forecast`: the number of runs and the computing time
"""
