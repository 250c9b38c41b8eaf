"""Random numbers that depend only on a seed, a step, and the robots for which they are drawn.

A generator with a state would have to be copied, rewound and branched together with a run. Here each number
is a function of its seed and its purpose. It is computed by the counter-based generator Philox-4x32-10 of
Salmon, Moraes, Dror and Shaw, *Parallel random numbers: as easy as 1, 2, 3* (SC 2011), for any number of
counters at once; NumPy's generator of that name computes one stream at a time.
"""

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray

_ROUNDS = 10
_WORD = 0xFFFFFFFF
"""Mask of the lower 32 bits."""
_MULTIPLIER_A = 0xD2511F53
_MULTIPLIER_C = 0xCD9E8D57
_KEY_STEP_FIRST = 0x9E3779B9
_KEY_STEP_SECOND = 0xBB67AE85


def compute_philox(counter: NDArray[np.uint64], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Compute Philox-4x32-10.

    Parameters
    ----------
    counter : (4, ...) array
        Words of 32 bits.
    key : tuple of two words

    Returns
    -------
    (4, ...) array
        Words of 32 bits.
    """
    a, b, c, d = counter
    first, second = key
    for _ in range(_ROUNDS):
        product_a = a * _MULTIPLIER_A
        product_c = c * _MULTIPLIER_C
        a = (product_c >> 32) ^ b ^ first
        b = product_c & _WORD
        c = (product_a >> 32) ^ d ^ second
        d = product_a & _WORD
        first = (first + _KEY_STEP_FIRST) & _WORD
        second = (second + _KEY_STEP_SECOND) & _WORD
    return np.stack([a, b, c, d])


class RandomStream:
    """A stream of random numbers for steps and pairs of robots, independent of all other streams.

    Parameters
    ----------
    seed : int
        From 0.
    stream : int
        Number of the stream, from 0.
    """

    def __init__(self, seed: int, stream: int) -> None:
        sequence = np.random.SeedSequence(seed, spawn_key=(stream,))
        first, second = sequence.generate_state(2, np.uint32)
        self._key = (int(first), int(second))

    def draw_uniform(self, step: int, one: IntArray, other: IntArray | int = 0) -> Array:
        """Draw numbers between 0 and 1, both excluded.

        Parameters
        ----------
        step : int
            From 0, below 2⁶⁴.
        one, other : int arrays of shapes that broadcast together
            Purpose of each number, such as the numbers of two robots; from 0, below 2³².

        Returns
        -------
        (...) array
        """
        return np.asarray(self._draw_pairs(step, one, other)[0])

    def draw_normal(self, step: int, one: IntArray, other: IntArray | int = 0) -> Array:
        """Draw pairs of independent standard normal numbers, by the Box-Muller transform.

        Parameters
        ----------
        step, one, other
            See `draw_uniform`.

        Returns
        -------
        (..., 2) array
        """
        uniform_radius, uniform_angle = self._draw_pairs(step, one, other)
        radius = np.sqrt(-2.0 * np.log(uniform_radius))
        angle = 2.0 * np.pi * uniform_angle
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    def _draw_pairs(self, step: int, one: IntArray, other: IntArray | int) -> Array:
        """Return pairs of independent uniform numbers, (2, ...)."""
        one, other = np.broadcast_arrays(np.asarray(one, np.uint64), np.asarray(other, np.uint64))
        low = np.broadcast_to(np.uint64(step & _WORD), one.shape)
        high = np.broadcast_to(np.uint64(step >> 32), one.shape)
        words = compute_philox(np.stack([low, one, other, high]), self._key).astype(np.float64)
        # 26 bits of each of two words, and half of the last bit in addition: never 0, never 1.
        coarse = words[0::2] // 64.0
        fine = words[1::2] // 64.0
        return np.asarray((coarse * 2.0**26 + fine + 0.5) * 2.0**-52)
