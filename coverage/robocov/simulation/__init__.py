"""Simulations: in each step, all robots observe, the controller decides, and all robots move.

- `simulation`: one run of one team
- `batch`: many runs of identical teams, advanced together
- `team_state`: the state from which a run starts or continues
- `controller_caller`: calls to controllers, with checks of the returned values
- `sensing`: observations of robots with exact sensors
- `checks`: checks of the arguments of simulations
"""

from robocov.simulation.batch import SimulationBatch
from robocov.simulation.checks import check_dt, check_joins
from robocov.simulation.simulation import Simulation
from robocov.simulation.team_state import TeamState

__all__ = ["Simulation", "SimulationBatch", "TeamState", "check_dt", "check_joins"]
