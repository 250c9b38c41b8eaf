"""robocov: multi-robot coverage control among unknown obstacles.

    import robocov as rc

    environment = rc.load_map("rooms")
    simulation = rc.Simulation(environment, rc.Rapf(), starts=environment.start().sample(6, seed=0))
    record = simulation.run(60.0)
    cost = rc.CoverageCost(environment, lattice=128)
    cost(record.positions[-1]).mean_distance

Public names are loaded on first use, so that importing the package takes almost no time. They are listed in
``__init__.pyi``.
"""

import importlib
import sys

__version__ = "0.1.0"


def _read_public_names() -> dict[str, str]:
    """Return the module of each public name: the lines ``from .module import Name as Name`` of the stub."""
    stub = __spec__.loader.get_data(f"{__path__[0]}/__init__.pyi").decode()
    modules = {}
    for line in stub.splitlines():
        if line.startswith("from ."):
            _, module, _, name, *_ = line.split()
            modules[name] = __name__ + module
    return modules


_modules = _read_public_names()
__all__ = sorted(_modules)


def __getattr__(name: str) -> object:
    """Load a public name from its module."""
    if name not in _modules:
        # Python suggests the nearest name of this module.
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__]
        )
    value = getattr(importlib.import_module(_modules[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
