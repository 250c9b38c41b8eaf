"""Adaptive coverage: robots do not know the density, and learn it from what they measure on their ways."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from robocov.arrays import Array, BoolArray
from robocov.compiled import kernel
from robocov.controllers.base import BaseController
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.gains import choice, gain, response_time_gain
from robocov.observation import Decision, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

_SAMPLES = 40  # places along a side of the region at which densities are estimated
_SQUARES = 20  # squares along a side of which one measurement each is kept
_OVERLAP = 0.8  # standard deviation of a basis function, in distances to the next one
_NOISE = 1e-3  # variance of a measurement, as a part of the prior's


@dataclass(frozen=True, slots=True, eq=False)
class AdaptiveMemory:
    """Memory of the robots: what each knows of the density."""

    team: Team
    lattice: Lattice
    estimates: Array  # (n, k), φ at the samples of the lattice
    parameters: Array  # (n, m), a of the basis
    information: Array  # (n, m, m) s, Λ
    told: Array  # (n, m) s, λ
    measured: Array  # (n, s), φ in squares where anybody who was heard has been; nan elsewhere
    goals: Array | None = None  # (n, 2) m
    planned: float = -np.inf  # s


@dataclass(frozen=True)
class Adaptive(BaseController):
    """Lloyd's algorithm with a density that is learned (Schwager, Rus and Slotine, IJRR 28, 2009).

    What a robot measures is the density in the place where it is, and nowhere else. Its estimate of it is
    K(q)·a_i, with basis functions K, here Gaussians on a grid of `basis` by `basis`, divided by their sum,
    so that a constant density can be told exactly. All robots begin with `prior` everywhere. Each heads for
    the centroid C_i of its Voronoi cell V_i by its own estimate, and learns meanwhile:

        dΛ_i/dt = w K K^T,  dλ_i/dt = w K φ,                        at its place p_i
        da_i/dt = γ (λ_i - Λ_i a_i) + k P_i (C_i - p_i) + ζ Σ_j (a_j - a_i) / deg_i,    a_i >= `least`

    The first term leads to all that it has measured, the second makes the paper's Lyapunov function fall,
    with P_i = ∫ K (q - p_i)^T dq over V_i, the third to those it hears (consensus). What nobody came near
    stays about as it was guessed: robots go where the cost is low, not where there is much to learn.

    With ``estimate="gp"`` robots tell each other their measurements instead, one for each of 20 by 20
    squares, as if taken in its middle, and the estimate is the mean of a Gaussian process with a squared
    exponential kernel of length `correlation`, in the manner of Luo and Sycara (ICRA 2018) and Santos,
    Diaz-Mercado and Egerstedt (2018), plus `explore` times its standard deviation: above 0, which takes
    several times as long to compute, robots are drawn to where nobody was.

    The law reads the density of the map where the robots are, and nowhere else. That neighbours tell what
    they have learned makes its information a shared map; who hears nobody learns alone, and takes the whole
    region for its cell. Obstacles are not known to it, and it slides along them as `lloyd` does.

    Taken from what is generally known of the papers, not from their texts. Decided here: parameters take
    implicit steps of `period` seconds, so that no gain is unstable; cells and centroids are sampled on a
    lattice; w = 1; the consensus weighs all who are heard alike. The Gaussian process is the plain one, not
    their mixtures and bounds.
    """

    name = "adaptive"
    label = "Adaptive"
    summary = "Lloyd's algorithm, learning the density on the way (Schwager, Rus and Slotine 2009)"
    information = "shared map"

    estimate: str = choice("basis", ("basis", "gp"), "how the density is learned")
    basis: float = gain(8.0, "functions", "along a side of the region", low=2.0, high=20.0, whole=True)
    prior: float = gain(1.0, "1", "the density everywhere, before anything was measured", low=1e-3)
    least: float = gain(0.05, "1", "the least that the density is estimated to be", low=1e-6)
    learning: float = gain(3.0, "1/s²", "γ, how fast measurements are learned")
    consensus: float = gain(1.0, "1/s", "ζ, how fast neighbours agree")
    coupling: float = gain(1e-3, "1/(m⁴ s)", "k, how much the way to the centroid tells")
    correlation: float = gain(0.12, "sides", "length of the process, in the region's longer", low=0.01)
    explore: float = gain(0.0, "σ", "how much of the process's standard deviation is added", high=100.0)
    period: float = gain(0.2, "s", "time from one estimate to the next", low=0.01, high=60.0)
    k_prop: float = gain(2.0, "1/s", "wanted speed per metre of distance to the centroid", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> AdaptiveMemory:
        """Return what the robots guess before they have measured anything."""
        n, lattice = len(team), Lattice.over(region, int(self.basis), self.correlation)
        (k, m), s = lattice.functions.shape, len(lattice.squares)
        information = np.zeros((n, m, m))
        guess = np.full((n, k), self.prior), np.full((n, m), self.prior)
        return AdaptiveMemory(team, lattice, *guess, information, np.zeros((n, m)), np.full((n, s), np.nan))

    def decide(self, seen: Observations, memory: AdaptiveMemory) -> Decision:
        if memory.goals is None or not memory.planned <= seen.time < memory.planned + self.period - 1e-9:
            robot, _, offset, _ = seen.find_near_neighbours(np.inf)
            places, heard = memory.lattice.places, seen.positions[robot] - offset
            mine = find_own_samples(places, seen.positions, robot, heard)
            if self.estimate == "gp":
                memory = self._by_process(seen, memory)
            else:
                memory = self._by_basis(seen, memory, mine)
            goals = compute_sample_centroids(mine, places, memory.estimates, seen.positions)
            memory = replace(memory, goals=goals, planned=seen.time)
        assert memory.goals is not None
        wanted = compute_approach_velocities(
            memory.goals - seen.positions, self.k_prop, memory.team.max_speed
        )
        forces = compute_drive_forces(wanted, seen, memory.team, self.response_time)
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory)

    def _by_basis(self, seen: Observations, memory: AdaptiveMemory, mine: BoolArray) -> AdaptiveMemory:
        """Return the memory after one step of the adaptation law."""
        lattice, before, dt = memory.lattice, memory.parameters, self.period
        here = lattice.basis(seen.positions)
        information = memory.information + dt * here[:, :, None] * here[:, None]
        told = memory.told + dt * here * _measured(seen)[:, None]
        goals = compute_sample_centroids(mine, lattice.places, memory.estimates, seen.positions)
        away = lattice.places - seen.positions[:, None]
        lever = mine * (away * (goals - seen.positions)[:, None]).sum(axis=2) * lattice.area
        agreed = before.copy()
        for i in range(len(before)):
            known = seen.neighbours.list_neighbours(i)
            if len(known):
                agreed[i] = before[known].mean(axis=0)
        change = (
            self.learning * told
            + self.consensus * agreed
            + self.coupling * _product(lever, lattice.functions)
        )
        stiffness = self.learning * information + self.consensus * np.eye(before.shape[1])
        system = np.eye(before.shape[1]) + dt * stiffness
        after = np.maximum(_solved(system, before + dt * change), self.least)
        estimates = _product(after, lattice.functions.T)
        return replace(memory, estimates=estimates, parameters=after, information=information, told=told)

    def _by_process(self, seen: Observations, memory: AdaptiveMemory) -> AdaptiveMemory:
        """Return the memory with what was measured here and told by neighbours, and what follows from it."""
        lattice, values = memory.lattice, _measured(seen)
        measured, estimates = memory.measured.copy(), memory.estimates.copy()
        for i, place in enumerate(seen.positions):
            for j in seen.neighbours.list_neighbours(i):
                measured[i] = np.where(np.isnan(measured[i]), memory.measured[j], measured[i])
            measured[i, ((lattice.squares - place) ** 2).sum(axis=1).argmin()] = values[i]
            known = ~np.isnan(measured[i])
            if np.array_equal(measured[i], memory.measured[i], equal_nan=True):
                continue
            cross, within = lattice.cross[:, known], lattice.within[known][:, known]
            factor = scipy.linalg.cho_factor(within + _NOISE * np.eye(len(within)))
            estimate = self.prior + cross @ scipy.linalg.cho_solve(factor, measured[i, known] - self.prior)
            if self.explore:
                near = lattice.within[:, known]
                solved = scipy.linalg.cho_solve(factor, near.T).T
                variance = np.maximum(1.0 - (near * solved).sum(axis=1), 0.0)
                estimate += self.explore * self.prior * np.sqrt(variance)[lattice.cross.argmax(axis=1)]
            estimates[i] = np.maximum(estimate, self.least)
        return replace(memory, estimates=estimates, measured=measured)


@kernel
def _product(one: Array, other: Array) -> Array:
    """Return the product of two matrices: a library's has other bits on other processors."""
    result = np.zeros((len(one), other.shape[1]))
    for i in range(len(one)):
        for k in range(len(other)):
            for j in range(other.shape[1]):
                result[i, j] += one[i, k] * other[k, j]
    return result


@kernel
def _solved(systems: Array, right: Array) -> Array:
    """Return the solutions, (n, m), of symmetric positive definite systems, (n, m, m), by elimination."""
    systems, right = systems.copy(), right.copy()
    m = right.shape[1]
    for i in range(len(right)):
        for k in range(m):
            for r in range(k + 1, m):
                part = systems[i, r, k] / systems[i, k, k]
                if part != 0.0:
                    right[i, r] -= part * right[i, k]
                    for c in range(k, m):
                        systems[i, r, c] -= part * systems[i, k, c]
        for k in range(m - 1, -1, -1):
            for c in range(k + 1, m):
                right[i, k] -= systems[i, k, c] * right[i, c]
            right[i, k] /= systems[i, k, k]
    return right


def _measured(seen: Observations) -> Array:
    """Return φ where the robots are, (n,): all that they may know of it."""
    return np.ones(len(seen.positions)) if seen.density is None else seen.density.evaluate(seen.positions)


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Samples of the region, with what is known there of the basis functions and of the process."""

    places: Array  # (k, 2) m, the samples
    area: float  # m², of one sample
    centers: Array  # (m, 2) m, of the basis functions
    width: float  # m, their standard deviation
    functions: Array  # (k, m), K at the samples
    squares: Array  # (s, 2) m, the middles of squares of which one measurement each is kept
    cross: Array  # (k, s), covariances of samples and squares
    within: Array  # (s, s), and of squares

    @classmethod
    def over(cls, region: Region, basis: int, correlation: float) -> Lattice:
        """Return the lattice over a region; the correlation length is a part of its longer side."""
        low_x, low_y, high_x, high_y = region.bounds
        side = max(high_x - low_x, high_y - low_y)

        def grid(count: int) -> Array:
            along = (np.arange(count) + 0.5) / count
            x, y = np.meshgrid(low_x + along * (high_x - low_x), low_y + along * (high_y - low_y))
            return np.column_stack([x.ravel(), y.ravel()])

        places, centers, squares, width = grid(_SAMPLES), grid(basis), grid(_SQUARES), _OVERLAP * side / basis
        area = (high_x - low_x) * (high_y - low_y) / len(places)
        places = places[region.contains(places)]
        cross, within = (np.exp(-_halved(each, squares, correlation * side)) for each in (places, squares))
        return cls(places, area, centers, width, _basis(places, centers, width), squares, cross, within)

    def basis(self, positions: Array) -> Array:
        """Return K at (n, 2) m, (n, m)."""
        return _basis(positions, self.centers, self.width)


def _basis(places: Array, centers: Array, width: float) -> Array:
    """Return Gaussians at places, (k, m), divided by their sum."""
    exponent = _halved(places, centers, width)
    # the nearest counts 1, however far it is
    parts = np.exp(exponent.min(axis=1, keepdims=True) - exponent)
    return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def _halved(places: Array, others: Array, length: float) -> Array:
    """Return half the squares of the distances of (k, 2) and (m, 2) places, in so many metres, (k, m)."""
    return np.asarray(((places[:, None] - others) ** 2).sum(axis=2) / (2.0 * length * length))
