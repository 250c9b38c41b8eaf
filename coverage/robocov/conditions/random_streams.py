"""Random numbers that depend only on a seed, a step, and the robots for which they are drawn.

A generator with a state would have to be copied, rewound and branched together with a run. Here, each number
is a function of the seed and of its indices. It is computed by the counter-based generator Philox-4x32-10 of
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
    """Compute the random words of counters by Philox-4x32-10.

    Parameters
    ----------
    counter : (4, ...) array
        32-bit words.
    key : tuple of two 32-bit words

    Returns
    -------
    (4, ...) array
        32-bit words.
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

    def draw_uniform(self, step: int, first_index: IntArray, second_index: IntArray | int = 0) -> Array:
        """Draw uniformly distributed numbers between 0 and 1, both excluded.

        Parameters
        ----------
        step : int
            From 0, below 2⁶⁴.
        first_index, second_index : int arrays of shapes that broadcast together
            Indices of each number, such as those of two robots, from 0, below 2³².

        Returns
        -------
        (...) array
        """
        return np.asarray(self._draw_pairs(step, first_index, second_index)[0])

    def draw_normal(self, step: int, first_index: IntArray, second_index: IntArray | int = 0) -> Array:
        """Draw pairs of independent standard normal numbers, by the Box-Muller transform.

        Parameters
        ----------
        step, first_index, second_index
            See `draw_uniform`.

        Returns
        -------
        (..., 2) array
        """
        uniform_radius, uniform_angle = self._draw_pairs(step, first_index, second_index)
        radius = np.sqrt(-2.0 * np.log(uniform_radius))
        angle = 2.0 * np.pi * uniform_angle
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    def _draw_pairs(self, step: int, first_index: IntArray, second_index: IntArray | int) -> Array:
        """Return pairs of independent uniform numbers, (2, ...)."""
        first, second = np.broadcast_arrays(
            np.asarray(first_index, np.uint64), np.asarray(second_index, np.uint64)
        )
        low = np.broadcast_to(np.uint64(step & _WORD), first.shape)
        high = np.broadcast_to(np.uint64(step >> 32), first.shape)
        counters = np.stack([low, first, second, high])
        words = compute_philox(counters, self._key).astype(np.float64)
        # 26 bits from each of two words. The additional half of the last bit excludes 0 and 1.
        coarse = words[0::2] // 64.0
        fine = words[1::2] // 64.0
        return np.asarray((coarse * 2.0**26 + fine + 0.5) * 2.0**-52)
