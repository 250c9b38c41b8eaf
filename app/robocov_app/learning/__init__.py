"""Learning environments for gymnasium and PettingZoo (``pip install "robocov[rl]"``).

`CoverageParallelEnv` has one learner for each robot, `CoverageEnv` has one learner for the whole team, and
`CoverageVectorEnv` runs many environments of the latter kind at once. A `CoverageTask` defines the
environment, and an `ObservationLayout` its observations. `PolicyController` turns a learned policy into a
controller, and `ControllerPolicy` lets a controller act in an environment.

    import numpy as np
    from robocov_app.learning import CoverageEnv, ObservationLayout

    layout = ObservationLayout(neighbors=2)
    env = CoverageEnv(
        duration=20.0, dt=0.05, repeat=5, action="velocity", reward_every=999, observation=layout
    )
    offsets = [0, 1, 2, 3, 4, 5, 7, 8, 10, 11]  # x and y of all vectors in an observation


    def policy(gains):  # a velocity along each offset: away from neighbors, to the middle, ...
        return lambda rows: np.einsum("k,nkd->nd", gains, rows[:, offsets].reshape(len(rows), -1, 2))


    def mean_return(act, seeds):
        total = 0.0
        for seed in seeds:
            rows, _ = env.reset(seed=seed)
            over = False
            while not over:
                rows, reward, _, over, _ = env.step(act(rows))
                total += reward
        return total / len(seeds)


    rng = np.random.default_rng(0)
    tried = [rng.normal(scale=10.0, size=5) for _ in range(16)]
    returns = [mean_return(policy(gains), seeds=range(2)) for gains in tried]
    best = tried[int(np.argmax(returns))]
    best_return = mean_return(policy(best), seeds=range(10, 14))
    print("median", np.median(returns), "best on other starts", best_return)

Names are loaded on first use; only the environments need the extra packages.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from robocov.optional_imports import import_optional

if TYPE_CHECKING:
    from robocov_app.learning.gym import CoverageEnv, CoverageVectorEnv
    from robocov_app.learning.maps import GeneratedMaps
    from robocov_app.learning.observation_layout import ObservationLayout
    from robocov_app.learning.parallel import CoverageParallelEnv
    from robocov_app.learning.policy import ControllerPolicy, PolicyController
    from robocov_app.learning.task import CoverageTask

__all__ = [
    "ControllerPolicy",
    "CoverageEnv",
    "CoverageParallelEnv",
    "CoverageTask",
    "CoverageVectorEnv",
    "GeneratedMaps",
    "ObservationLayout",
    "PolicyController",
]
_MODULES = {
    "ControllerPolicy": "policy",
    "CoverageEnv": "gym",
    "CoverageParallelEnv": "parallel",
    "CoverageTask": "task",
    "CoverageVectorEnv": "gym",
    "GeneratedMaps": "maps",
    "ObservationLayout": "observation_layout",
    "PolicyController": "policy",
}
"""Module of each public name."""
_EXTRA_PACKAGES = {"gym": ("gymnasium",), "parallel": ("gymnasium", "pettingzoo")}
"""Packages of the extra "rl" that each module needs."""


def __getattr__(name: str) -> Any:
    """Import the module of a public name on first use."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = _MODULES[name]
    for package in _EXTRA_PACKAGES.get(module, ()):
        import_optional(package, "rl")
    value = getattr(importlib.import_module(f"{__name__}.{module}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
