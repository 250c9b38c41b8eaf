"""A small neural network as plain arrays, which gives the same outputs on every computer.

The network of `robocov_app.benchmark.learned` is in ``policy-network.npz``. It is not in the folder of the
benchmark, because verifications let no controller read files there.
"""

from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.typing import Float32Array, FloatArray

_WEIGHTS_FILE = "policy-network.npz"


class Network(NamedTuple):
    """Weights of a network with two hidden layers of rectified linear units."""

    weights_1: Float32Array
    """(h, inputs)"""
    biases_1: Float32Array
    """(h,)"""
    weights_2: Float32Array
    """(h, h)"""
    biases_2: Float32Array
    """(h,)"""
    weights_3: Float32Array
    """(m, h)"""
    biases_3: Float32Array
    """(m,)"""


@cache
def load_network() -> Network:
    """Load the network that is part of robocov."""
    resource = resources.files("robocov_app.learning") / _WEIGHTS_FILE
    with resource.open("rb") as file, np.load(file) as arrays:
        return Network(**{name: np.ascontiguousarray(arrays[name], np.float32) for name in Network._fields})


def evaluate_network(network: Network, inputs: Float32Array) -> FloatArray:
    """Compute the outputs of a network, in the same order of operations on every computer.

    Parameters
    ----------
    network : Network
    inputs : (n, k) array
        One row of k inputs for each robot.

    Returns
    -------
    (n, m) array
    """
    hidden = apply_layer(network.weights_1, network.biases_1, inputs.astype(np.float64))
    hidden = apply_layer(network.weights_2, network.biases_2, np.maximum(hidden, 0.0))
    return apply_layer(network.weights_3, network.biases_3, np.maximum(hidden, 0.0))


@kernel
def apply_layer(weights: Float32Array, biases: Float32Array, inputs: FloatArray) -> FloatArray:
    """Compute ``inputs @ weights.T + biases`` in a fixed order of operations.

    The libraries behind ``@`` add in an order that depends on the processor and on the number of rows, but
    a robot has to decide the same everywhere, alone and in a team.

    Parameters
    ----------
    weights : (m, k) array
    biases : (m,) array
    inputs : (n, k) array

    Returns
    -------
    (n, m) array
    """
    outputs = np.empty((len(inputs), len(weights)))
    for i in range(len(inputs)):
        for j in range(len(weights)):
            total = float(biases[j])
            for k in range(weights.shape[1]):
                total += weights[j, k] * inputs[i, k]
            outputs[i, j] = total
    return outputs
