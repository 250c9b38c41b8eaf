"""The bodies of pymunk spaces as arrays, and kernels that move them by the engine's C functions."""

import math
from typing import Any, TypeAlias

import numpy as np
import pymunk
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib

from robocov.arrays import Array, IntArray
from robocov.compiled import call_c, inner_kernel, kernel
from robocov.robots import Team

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
State: TypeAlias = tuple[Array, Array, Array]
"""Positions and velocities of all robots, net forces on those of a run, (n, 2) each."""


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
        """Return the ids of the bodies in contact, in pairs, in free substeps."""
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


@inner_kernel
def shortening(x: float, y: float, limit: float) -> float:
    """Return by what to multiply a vector so that it is no longer than `limit`."""
    square = x * x + y * y
    return limit / math.sqrt(square) if square > limit * limit else 1.0


def response(team: Team, dt: float) -> Array:
    """Return how robots answer to forces for `dt` seconds, (n, 5): see `free_substep`.

    The columns: part of the velocity that viscosity takes (28), velocity by force in m/s/N, force by change
    of velocity in N/(m/s), most change of velocity and most speed in m/s.
    """
    rate = team.viscosity / team.mass
    decay = -np.expm1(-rate * dt)
    drive = np.where(rate > 0, decay / np.where(rate > 0, rate, 1.0), dt) / team.mass
    return np.column_stack([decay, drive, team.mass / dt, team.max_acceleration * dt, team.max_speed])


@kernel
def free_substep(buffers: Buffers, answer: Array, external: Array, dt: float) -> Array:
    """Return the state after a substep as if nothing touched; note who did; make net forces of controllers'.

    The linear equation m q'' = F - nu q' is solved exactly over the substep, so viscosity is stable at any
    dt; then acceleration and speed are limited, in this order: projecting onto the disc of speeds brings a
    velocity no farther from the old one, which is in it.
    """
    addresses, _, forces, states = buffers
    each = len(answer) // len(states)
    begin = states.shape[1] - 1 - each
    for i in range(len(answer)):
        run, row = i // each, begin + i % each
        vx, vy = states[run, row, 2], states[run, row, 3]
        decay, drive = answer[i, 0], answer[i, 1]
        dx, dy = drive * forces[run, row, 0] - decay * vx, drive * forces[run, row, 1] - decay * vy
        scale = shortening(dx, dy, answer[i, 3])
        ux, uy = vx + dx * scale, vy + dy * scale
        scale = shortening(ux, uy, answer[i, 4])
        forces[run, row, 0] = (ux * scale - vx) * answer[i, 2]
        forces[run, row, 1] = (uy * scale - vy) * answer[i, 2]
        if len(external):
            forces[run, row, 0] += external[i, 0]
            forces[run, row, 1] += external[i, 1]
    for run in range(len(states)):
        substeps(buffers, run, 1, dt)
        transfer(buffers, run, GET_BODY, STATES)
        noting = (addresses[run, SPACE], addresses[run, GET_ARBITER], addresses[run, CONTACTS])
        call_c(addresses[run, EACH_ARBITER], noting)
    moved = np.empty((2, len(answer), 2))
    for i in range(len(answer)):
        for k in range(2):
            moved[0, i, k] = states[i // each, begin + i % each, k]
            moved[1, i, k] = states[i // each, begin + i % each, 2 + k]
    return moved


@kernel
def enter(buffers: Buffers, members: IntArray, rows: IntArray, now: State, mass: Array, dt: float) -> float:
    """Add robots to the space of contacts; return the largest speed, in m/s, now or under the net forces."""
    addresses, forces, states = buffers[0], buffers[2][0], buffers[3][0]
    positions, velocities, net = now
    square, space, first = 0.0, addresses[0, SPACE], len(states) - 1 - len(members)
    begin, last = rows[0] // len(net) * len(net), first + len(rows)
    for axis in range(2):
        states[last, axis] = states[last, 2 + axis] = forces[last, axis] = 0.0
    for k in range(len(rows)):
        row, at, before, after = rows[k], first + k, 0.0, 0.0
        call_c(addresses[0, ADD_BODY], (space, members[row, 0]))
        for axis in range(2):
            speed, force = velocities[row, axis], net[row - begin, axis]
            states[at, axis], states[at, 2 + axis], forces[at, axis] = positions[row, axis], speed, force
            reached = speed + force * (dt / mass[row])
            before, after = before + speed * speed, after + reached * reached
        square = max(square, before, after)
    transfer(buffers, 0, SET_BODY, STATES)
    for k in range(len(rows)):
        call_c(addresses[0, ADD_SHAPE], (space, members[rows[k], 1]))
    return math.sqrt(square)


@kernel
def leave(buffers: Buffers, members: IntArray, rows: IntArray, limit: Array, moved: Array, dt: float) -> None:
    """Read where robots are after contacts, and how fast, and remove them from the space of contacts."""
    addresses, forces, states = buffers[0], buffers[2][0], buffers[3][0]
    space, first = addresses[0, SPACE], len(states) - 1 - len(members)
    for k in range(len(rows)):
        call_c(addresses[0, REMOVE_SHAPE], (space, members[rows[k], 1]))
    transfer(buffers, 0, GET_BODY, STATES)
    for k in range(len(rows)):
        # impulses of a contact may exceed what a robot can do by itself
        scale = shortening(states[first + k, 2], states[first + k, 3], limit[rows[k]])
        for axis in range(2):
            moved[1, rows[k], axis] = states[first + k, 2 + axis] * scale
            forces[first + k, axis] = 0.0
    # what is left is the push out of an overlap that pymunk has decided but not yet applied
    for k in range(first + len(rows)):
        states[k, 2] = states[k, 3] = 0.0
    transfer(buffers, 0, SET_BODY, STATES)
    substeps(buffers, 0, 1, dt)
    transfer(buffers, 0, GET_BODY, STATES)
    for k in range(len(rows)):
        for axis in range(2):
            moved[0, rows[k], axis] = states[first + k, axis]
        call_c(addresses[0, REMOVE_BODY], (space, members[rows[k], 0]))
