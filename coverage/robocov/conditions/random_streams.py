"""Random numbers that depend on nothing but a seed, a step, and whom they are for.

A generator with a state would have to be copied, rewound and branched with a run. Here each number is a
function of the seed and of what it is drawn for: the counter-based generator Philox-4x32-10 of Salmon,
Moraes, Dror and Shaw, *Parallel random numbers: as easy as 1, 2, 3* (SC 2011), over as many counters at once
as are asked for; numpy's makes one stream at a time.
"""

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray

_LOW = 0xFFFFFFFF


def philox(counter: NDArray[np.uint64], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Return Philox-4x32-10 of counters, (4, ...), under a key: words of 32 bits, (4, ...)."""
    a, b, c, d = counter
    first, second = key
    for _ in range(10):
        left, right = a * 0xD2511F53, c * 0xCD9E8D57
        a, c = (right >> 32) ^ b ^ first, (left >> 32) ^ d ^ second
        b, d = right & _LOW, left & _LOW
        first, second = (first + 0x9E3779B9) & _LOW, (second + 0xBB67AE85) & _LOW
    return np.stack([a, b, c, d])


class Draws:
    """A stream of random numbers for steps and for pairs of robots; seeds and streams are independent."""

    def __init__(self, seed: int, stream: int) -> None:
        first, second = np.random.SeedSequence(seed, spawn_key=(stream,)).generate_state(2, np.uint32)
        self._key = int(first), int(second)

    def uniform(self, step: int, one: IntArray, other: IntArray | int = 0) -> Array:
        """Return numbers between 0 and 1; `step` is from 0 and below 2⁶⁴, `one` and `other` below 2³²."""
        return np.asarray(self._pair(step, one, other)[0])

    def normal(self, step: int, one: IntArray, other: IntArray | int = 0) -> Array:
        """Return pairs of independent standard normal numbers, (..., 2), by the Box-Muller transform."""
        radius, angle = self._pair(step, one, other)
        radius, angle = np.sqrt(-2.0 * np.log(radius)), 2.0 * np.pi * angle
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    def _pair(self, step: int, one: IntArray, other: IntArray | int) -> Array:
        """Return two independent uniform numbers each, (2, ...)."""
        one, other = np.broadcast_arrays(np.asarray(one, np.uint64), np.asarray(other, np.uint64))
        low, high = np.uint64(step & 0xFFFFFFFF), np.uint64(step >> 32)
        counter = np.stack([np.broadcast_to(low, one.shape), one, other, np.broadcast_to(high, one.shape)])
        words = philox(counter, self._key).astype(np.float64)
        # 26 bits of one word and 26 of another, and half a step more: never 0, never 1
        coarse, fine = words[0::2] // 64.0, words[1::2] // 64.0
        return np.asarray((coarse * 2.0**26 + fine + 0.5) * 2.0**-52)
