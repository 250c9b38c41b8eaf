"""The environment under PettingZoo's standard names: `parallel_env`, and `env` (agents act in turn)."""

from typing import Any

from pettingzoo.utils import parallel_to_aec

from robocov_app.learning.parallel import CoverageParallelEnv

__all__ = ["env", "parallel_env", "raw_env"]

parallel_env = CoverageParallelEnv


def env(**options: Any) -> Any:
    """Build the environment as PettingZoo's ``AECEnv``, in which the robots act one at a time.

    Parameters
    ----------
    **options
        Options of `CoverageParallelEnv`.
    """
    return parallel_to_aec(parallel_env(**options))


raw_env = env
