"""The environment under PettingZoo's usual names: `parallel_env`, and `env`, whose robots act one by one."""

from typing import Any

from pettingzoo.utils import parallel_to_aec

from robocov_app.learning.parallel import CoverageParallelEnv

__all__ = ["env", "parallel_env", "raw_env"]

parallel_env = CoverageParallelEnv


def env(**options: Any) -> Any:
    """Return the environment as PettingZoo's ``AECEnv``, in which the robots act one after the other.

    Parameters
    ----------
    **options
        Options of `CoverageParallelEnv`.
    """
    return parallel_to_aec(parallel_env(**options))


raw_env = env
