"""The smallest study of the paper in which everything is run. Its results mean nothing."""

from robocov_app.replication.design.plan import BeyondPlan, Plan
from robocov_app.replication.execution.runner import RunnerOptions
from robocov_app.terminal.interruption import Interruption

TINY = Plan(
    name="quick",
    duration=1.0,
    dt=0.05,
    bundled=("blocks-a",),
    generated=(1,),
    families=(),
    seeds=(0,),
    limited_starts=("corner",),
    tuning=(101, 102),
    tuning_families=(),
    tuning_starts=("corner", "uniform"),
    k_rep=(0.3, 3.0),
    rho_0=(2.0,),
    k_att=(3.0,),
    convex_generated=(0,),
    convex_seeds=(0,),
    restarts=2,
    lattice=16,
    beyond=BeyondPlan(
        bundled=("blocks-a",),
        generated=(1,),
        starts=("corner",),
        tuning=(101,),
        seeds=(0,),
        own_seeds=(0,),
        shared_seeds=(0,),
        unseen=(301,),
        maps=(1, 2),
        map_starts=("corner",),
        conditions_maps=("rooms",),
        conditions_seeds=1,
        conditions_duration=0.2,
        probe=1.0,
        worst=1,
        warm_up=1,
        blocks=2,
        large=8,
        huge=10,
    ),
)


def build_options(workers: int = 2) -> RunnerOptions:
    return RunnerOptions(workers=workers, scheduler=None, quiet=True, stop=Interruption())
