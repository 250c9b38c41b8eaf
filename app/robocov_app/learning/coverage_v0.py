"""The environment as PettingZoo lays its own out: `parallel_env`, and `env` where robots act in turn."""

from typing import Any

from pettingzoo.utils import parallel_to_aec

from robocov_app.learning.parallel import CoverageParallelEnv

__all__ = ["env", "parallel_env", "raw_env"]

parallel_env = CoverageParallelEnv


def env(**options: Any) -> Any:
    """Return PettingZoo's ``AECEnv`` of it: the same, but the robots say one by one what they do."""
    return parallel_to_aec(parallel_env(**options))


raw_env = env
