"""Records of runs.

- `record`: a whole run as arrays, saved in a folder and loaded from it
- `recorder`: collects the steps of a simulation into a record
- `sampling`: selects time steps of a record at a rate
- `record_arrays`: names of the arrays, and their file ``record.npz``
- `run_document`: the model of ``run.json``
- `package_versions`: versions of the packages on which a result depends
"""

from robocov.record.package_versions import list_versions
from robocov.record.record import Record
from robocov.record.record_arrays import ARRAYS
from robocov.record.recorder import Recorder
from robocov.record.sampling import TIME_ROUNDING_S, require_rate, select_nearest_steps

__all__ = [
    "ARRAYS",
    "TIME_ROUNDING_S",
    "Record",
    "Recorder",
    "list_versions",
    "require_rate",
    "select_nearest_steps",
]
