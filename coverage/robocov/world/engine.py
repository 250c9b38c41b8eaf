"""The bodies of pymunk spaces as arrays, and the engine's C functions called from kernels."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
import pymunk
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib

from robocov.arrays import Array, IntArray
from robocov.compiled import call_c, inner_kernel, kernel

SPACE, STEP, EACH_BODY, SET_BODY, GET_BODY, EACH_ARBITER, GET_ARBITER = range(7)
ADD_BODY, ADD_SHAPE, REMOVE_BODY, REMOVE_SHAPE, FORCES, STATES, CONTACTS = range(7, 14)
"""Columns of the addresses."""
_FUNCTIONS = (
    *("cpSpaceStep", "cpSpaceEachBody"),
    *("pmSpaceBodySetIteratorFuncBatched", "pmSpaceBodyGetIteratorFuncBatched"),
    *("cpSpaceEachCachedArbiter", "pmSpaceArbiterIteratorFuncBatched"),
    *("cpSpaceAddBody", "cpSpaceAddShape", "cpSpaceRemoveBody", "cpSpaceRemoveShape"),
)

# with another layout of a pmFloatArray memory would be overwritten
_LAYOUT = [("num", 0), ("max", 4), ("arr", 8)]
if [(name, member.offset) for name, member in ffi.typeof("pmFloatArray").fields] != _LAYOUT:
    raise ImportError("this pymunk lays out its arrays in another way; 7.1 to 7.3 are known")

_STATE = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY
_BODIES = batch.ArbiterFields.BODY_A_ID | batch.ArbiterFields.BODY_B_ID

Buffers: TypeAlias = tuple[IntArray, IntArray, Array, Array]
"""Addresses, (spaces, 14), of C functions and of what they are called with; how far forces, first, and
states, fifth, have been gone through, (spaces, 8); the forces and states of an `Engine`."""
State: TypeAlias = tuple[Array, Array, Array, Array]
"""Positions and velocities of all robots, net forces on those of a run, motion of the obstacles, (m, 4)."""


class Engine:
    """The bodies of spaces: obstacles that move, robots as they were added, and the static body.

    Forces, (spaces, bodies, 2) N, among them those of the `robots`, are forgotten by pymunk after a step;
    `states`, (spaces, bodies, 4) m and m/s, are positions and velocities, written or read.
    """

    def __init__(self, spaces: list[pymunk.Space], movers: int, robots: int) -> None:
        count, bodies = len(spaces), movers + robots + 1
        forces, self.states = np.zeros((count, bodies, 2)), np.zeros((count, bodies, 4))
        self.robots = forces[:, movers:-1]
        floats, batches = ffi.new("pmFloatArray[]", 2 * count), ffi.new("pmBatchedData[]", 3 * count)
        self._touching = ffi.gc(lib.pmIntArrayNew(0), lib.pmIntArrayFree)
        filled: Any = np.frombuffer(ffi.buffer(floats), dtype=np.intc).reshape(count, 8)
        addresses = []
        for k, space in enumerate(spaces):
            first, each = floats + 2 * k, batches + 3 * k
            for j, values in enumerate((forces[k], self.states[k])):
                # C must not make the array of numpy's longer, which it does as soon as it is full
                first[j].arr, first[j].max = ffi.from_buffer("double[]", values), 2**30
            for j, fields in enumerate((batch.BodyFields.FORCE, _STATE, _BODIES)):
                each[j].fields = fields.value
                each[j].floatArray, each[j].intArray = first + j % 2, self._touching
            addresses.append(addresses_of(space._space, *_FUNCTIONS, each, each + 1, each + 2))
        self.buffers: Buffers = np.array(addresses), filled, forces, self.states
        # what is only pointed to
        self._spaces, self._floats, self._batches = spaces, floats, batches

    def write(self, k: int = 0) -> None:
        """Set `states` of space k."""
        transfer(self.buffers, k, SET_BODY, STATES)

    def forget_contacts(self) -> None:
        """Begin anew with what `touching` returns."""
        self._touching.num = 0

    def touching(self) -> list[int]:
        """Return the ids of the bodies in contact, in pairs, in the observed steps."""
        return ffi.unpack(self._touching.arr, self._touching.num) if self._touching.num else []


def addresses_of(*pointers: Any) -> IntArray:
    """Return pointers, and C functions by their names, as numbers, for `robocov.compiled.call_c`."""
    found = [ffi.addressof(lib, each) if isinstance(each, str) else each for each in pointers]
    return np.array([int(ffi.cast("intptr_t", each)) for each in found], dtype=np.intp)


@kernel
def transfer(buffers: Buffers, k: int, direction: int, values: int) -> None:
    """Set or get the forces or states of all bodies of space k."""
    addresses, filled, _, _ = buffers
    filled[k, 0] = filled[k, 4] = 0
    call_c(addresses[k, EACH_BODY], (addresses[k, SPACE], addresses[k, direction], addresses[k, values]))


@kernel
def substeps(buffers: Buffers, k: int, count: int, dt: float) -> None:
    """Make substeps of space k under the same forces."""
    addresses = buffers[0]
    for _ in range(count):
        transfer(buffers, k, SET_BODY, FORCES)
        call_c(addresses[k, STEP], (addresses[k, SPACE], dt))


@kernel
def observed_step(buffers: Buffers, k: int, dt: float) -> None:
    """Make a step of space k under the forces, read its states, and note who touched."""
    addresses = buffers[0]
    substeps(buffers, k, 1, dt)
    transfer(buffers, k, GET_BODY, STATES)
    noting = (addresses[k, SPACE], addresses[k, GET_ARBITER], addresses[k, CONTACTS])
    call_c(addresses[k, EACH_ARBITER], noting)


@inner_kernel
def shortening(x: float, y: float, limit: float) -> float:
    """Return by what to multiply a vector so that it is no longer than `limit`."""
    square = x * x + y * y
    return limit / math.sqrt(square) if square > limit * limit else 1.0


@kernel
def enter(buffers: Buffers, members: IntArray, rows: IntArray, now: State, mass: Array, dt: float) -> float:
    """Add robots to the space of contacts; return the largest speed, in m/s, now or under the net forces."""
    addresses, forces, states = buffers[0], buffers[2][0], buffers[3][0]
    positions, velocities, net, motion = now
    square, space, last = 0.0, addresses[0, SPACE], len(motion) + len(rows)
    begin = rows[0] // len(net) * len(net)
    states[: len(motion)] = motion
    states[last] = forces[last] = 0.0
    for k in range(len(rows)):
        row, at, before, after = rows[k], len(motion) + k, 0.0, 0.0
        call_c(addresses[0, ADD_BODY], (space, members[row, 0]))
        for axis in range(2):
            speed, force = velocities[row, axis], net[row - begin, axis]
            states[at, axis], states[at, 2 + axis], forces[at, axis] = positions[row, axis], speed, force
            reached = speed + force * (dt / mass[row])
            before, after = before + speed * speed, after + reached * reached
        square = max(square, before, after)
    transfer(buffers, 0, SET_BODY, STATES)
    for row in rows:
        call_c(addresses[0, ADD_SHAPE], (space, members[row, 1]))
    return math.sqrt(square)


@kernel
def leave(buffers: Buffers, members: IntArray, rows: IntArray, limit: Array, moved: Array, dt: float) -> None:
    """Read where robots are after contacts, and how fast, and remove them from the space of contacts."""
    addresses, forces, states = buffers[0], buffers[2][0], buffers[3][0]
    space, first = addresses[0, SPACE], len(states) - 1 - len(members)
    for row in rows:
        call_c(addresses[0, REMOVE_SHAPE], (space, members[row, 1]))
    transfer(buffers, 0, GET_BODY, STATES)
    for k in range(len(rows)):
        # impulses of a contact may exceed what a robot can do by itself
        scale = shortening(states[first + k, 2], states[first + k, 3], limit[rows[k]])
        for axis in range(2):
            moved[1, rows[k], axis] = states[first + k, 2 + axis] * scale
            forces[first + k, axis] = 0.0
    # what is left is the push out of an overlap that pymunk has decided but not yet applied
    states[: first + len(rows), 2:] = 0.0
    transfer(buffers, 0, SET_BODY, STATES)
    substeps(buffers, 0, 1, dt)
    transfer(buffers, 0, GET_BODY, STATES)
    for k in range(len(rows)):
        for axis in range(2):
            moved[0, rows[k], axis] = states[first + k, axis]
        call_c(addresses[0, REMOVE_BODY], (space, members[rows[k], 0]))
