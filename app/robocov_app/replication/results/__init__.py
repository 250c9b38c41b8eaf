"""Results of the study.

- `outcomes`, `outcome_tables`: outcomes of contenders on the same problem instances, and reading them
- `degradations`: final costs with disturbances, relative to those under ideal conditions
- `references`: the reference placement of every map
- `controller_speed`: computing times of a step of every controller
- `study_results`: all results together
"""
