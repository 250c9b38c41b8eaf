"""The bodies of a pymunk space as arrays, and the engine's C functions called from kernels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib

from robocov.compiled import call_c, kernel

if TYPE_CHECKING:
    import pymunk

    from robocov.arrays import IntArray

SPACE, STEP, EACH_BODY, SET_BODY, GET_BODY, FORCES, STATES = range(7)
"""What is where in `Engine.addresses`."""

_STATE = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
_BODIES = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID


class Engine:
    """Access to the bodies of a space: obstacles that move, robots as they were added, and the static body.

    Attributes
    ----------
    forces : (bodies, 2) N
        To be written with `transfer`; pymunk forgets them after each step.
    robots : (n, 2) N
        Those of the robots, the same array.
    states : (bodies, 4) m and m/s
        Positions and velocities, written or read.
    addresses : (7,)
        Of C functions and of what they are called with.
    filled : (8,)
        How far `forces`, first, and `states`, fifth, have been gone through.
    """

    def __init__(self, space: pymunk.Space, movers: int, robots: int) -> None:
        bodies = movers + robots + 1
        self.forces, self.states = np.zeros((bodies, 2)), np.zeros((bodies, 4))
        self.robots = self.forces[movers:-1]
        floats, batches = ffi.new("pmFloatArray[2]"), ffi.new("pmBatchedData[3]")
        self._touching = ffi.gc(lib.pmIntArrayNew(0), lib.pmIntArrayFree)
        for k, values in enumerate((self.forces, self.states)):
            # C must not make the array of numpy's longer, which it does as soon as it is full
            floats[k].arr, floats[k].max = ffi.from_buffer("double[]", values), 2**30
        for k, fields in enumerate((batch.BodyFields.FORCE, _STATE, _BODIES)):
            batches[k].fields = fields.value
            batches[k].floatArray, batches[k].intArray = floats + k % 2, self._touching
        self.filled: Any = np.frombuffer(ffi.buffer(floats), dtype=np.intc)
        self.addresses = addresses_of(
            space._space,
            *map(function, ("cpSpaceStep", "cpSpaceEachBody")),
            *map(function, ("pmSpaceBodySetIteratorFuncBatched", "pmSpaceBodyGetIteratorFuncBatched")),
            *(batches, batches + 1),
        )
        # what is only pointed to
        self._space, self._floats, self._batches = space, floats, batches
        self._of_arbiters = space._space, function("pmSpaceArbiterIteratorFuncBatched"), batches + 2

    def write(self, values: int) -> None:
        """Set `FORCES` or `STATES` of all bodies."""
        transfer(self.addresses, self.filled, SET_BODY, values)

    def read(self) -> None:
        """Get `states`."""
        transfer(self.addresses, self.filled, GET_BODY, STATES)

    def touching(self) -> list[int]:
        """Return the ids of the bodies that touched another one in the last step, in pairs."""
        found = self._touching
        found.num = 0
        lib.cpSpaceEachCachedArbiter(*self._of_arbiters)
        return list(ffi.unpack(found.arr, found.num)) if found.num else []


def function(name: str) -> Any:
    """Return a C function of pymunk's engine."""
    return ffi.addressof(lib, name)


def addresses_of(*pointers: Any) -> IntArray:
    """Return pointers as numbers, for `robocov.compiled.call_c`."""
    return np.array([int(ffi.cast("intptr_t", each)) for each in pointers], dtype=np.intp)


@kernel
def transfer(addresses: IntArray, filled: IntArray, direction: int, values: int) -> None:
    """Set or get the forces or states of all bodies."""
    filled[0] = filled[4] = 0
    call_c(addresses[EACH_BODY], (addresses[SPACE], addresses[direction], addresses[values]))


@kernel
def substeps(addresses: IntArray, filled: IntArray, count: int, dt: float) -> None:
    """Make substeps under the same forces."""
    for _ in range(count):
        transfer(addresses, filled, SET_BODY, FORCES)
        call_c(addresses[STEP], (addresses[SPACE], dt))
