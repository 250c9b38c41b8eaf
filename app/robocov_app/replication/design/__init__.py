"""Design of the study.

- `contenders`: the compared controllers with their gains
- `plan`: the extent of the full study and of the quick one
- `study_maps`: the maps with their kinds of starts
- `studies`: the sweeps
"""
