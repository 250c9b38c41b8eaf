"""Observations and decisions: the types between the world and the controllers.

*Distributed* and *unknown obstacles* are facts of these types. Row i of `Observations` belongs to
robot i: its own state, the robots it hears, the nearest obstacle point it senses, the convex region.
A controller computes all rows at once for speed, but row i of its `Decision` may depend only on
row i and on the positions of the neighbours of i.

Nobody changes them in place. They are not frozen only because a frozen one takes three times as long to make,
which at six robots is a tenth of a step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray
from robocov.density.base import Density, Uniform
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, format_count, quote, require_number
from robocov.observation.neighbours import Neighbours, find_close_pairs
from robocov.observation.region import Region

MAX_RAYS = 3600
"""A ray for each tenth of a degree."""


@dataclass(frozen=True, slots=True)
class Scanning:
    """Range-scan settings that a controller asks for by its attribute `scanning`.

    The rays are spread evenly round a full turn, the first along +x. The period (s) between two scans is
    rounded to whole control periods; the first scan is at the beginning. A ParameterError is raised when one
    of them is out of range.
    """

    rays: int = 120
    period: float = 0.5

    def __post_init__(self) -> None:
        require_number("scanning.rays", self.rays, 1, MAX_RAYS, whole=True)
        require_number("scanning.period", self.period, 0.0, 1e6, "s")

    def count_steps(self, dt: float) -> int:
        """Return after how many control periods of `dt` seconds each scan follows the one before.

        >>> Scanning(period=0.5).count_steps(0.02)
        25
        """
        return max(1, round(self.period / dt))


@dataclass(frozen=True, slots=True, eq=False)
class Scans:
    """One scan of each robot, by its own range sensor; row i belongs to robot i alone."""

    distances: Array
    """(n, rays) m, to the first solid point along each ray; the robot's sensing range where there is none."""
    hit: BoolArray
    """(n, rays) Whether there is one."""

    @property
    def rays(self) -> int:
        """Number of rays of each robot."""
        return int(self.distances.shape[1])

    @property
    def headings(self) -> Array:
        """Unit vectors along the rays, (rays, 2)."""
        return compute_headings(self.rays)


def compute_headings(rays: int) -> Array:
    """Return unit vectors evenly round a full turn, (rays, 2), the first along +x."""
    angle = np.arange(rays) * (2.0 * np.pi / rays)
    return np.column_stack([np.cos(angle), np.sin(angle)])


@dataclass(slots=True, eq=False)
class Observations:
    """All that the robots know, as a structure of arrays; row i belongs to robot i alone.

    What is None is not told, or not there: robots know where others are, and all places count the same.
    """

    positions: Array
    """(n, 2) m"""
    velocities: Array
    """(n, 2) m/s. A robot knows its own, not those of others."""
    neighbours: Neighbours
    """The robots within communication range: their positions are known, nothing else."""
    obstacle_points: Array
    """(n, 2) m, the single closest obstacle or boundary point within sensing range, nan where none."""
    region: Region
    """The known convex outer boundary."""
    time: float = 0.0
    """s"""
    max_speeds: Array | None = None
    """(n,) m/s, the largest speed of each robot: its own, and what its neighbours tell of theirs."""
    reported_positions: Array | None = None
    """(m, 2) m, where robots know their neighbours to be, in the order of ``neighbours.indices``: what the
    last message said that arrived."""
    report_ages: Array | None = None
    """(m,) s, how old that is."""
    density: Density | None = None
    """φ, how much each place counts: part of the task, known to all."""
    scans: Scans | None = None
    """A ray scan of each robot, in the steps in which the controller wants one."""
    steering: Array | None = None
    """(n, 2) rad from +x and rad/s, heading and turning rate of unicycles: a robot knows its own. None in a
    team of points."""

    def get_neighbour_positions(self, robot: int) -> Array:
        """Return the known positions of a robot's neighbours, (k, 2) m, as `list_neighbours` orders them."""
        if self.reported_positions is None or self.neighbours.indptr is None:
            return self.positions[self.neighbours.list_neighbours(robot)]
        begin, end = self.neighbours.indptr[robot : robot + 2]
        return self.reported_positions[begin:end]

    def find_near_neighbours(self, reach: float) -> tuple[IntArray, IntArray, Array, Array]:
        """Return the directed pairs of neighbours that are at most `reach` metres apart, for all they know.

        Robots and neighbours, (m,) each, are sorted: sums over a row are then the same to the last bit
        whatever robots that this one cannot hear do. Offsets, (m, 2) m, lead from the neighbour, as the robot
        knows it, to the robot; distances are (m,) m.
        """
        if self.reported_positions is None and self.neighbours.is_complete:
            robot, neighbour, distance = find_close_pairs(self.positions, reach)
            return robot, neighbour, self.positions[robot] - self.positions[neighbour], distance
        robot, neighbour = self.neighbours.list_pairs()
        known = self.positions[neighbour] if self.reported_positions is None else self.reported_positions
        offset = self.positions[robot] - known
        distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
        near = distance <= reach
        return robot[near], neighbour[near], offset[near], distance[near]


@dataclass(slots=True, eq=False)
class Decision:
    """Forces that a controller commands, with the quantities that explain them."""

    forces: Array
    """(n, 2) N, what each robot wants to be driven with, before any limit; viscosity is the world's."""
    goals: Array | None = None
    """(n, 2) m, where each robot is drawn to, nan where it has no goal; None when the law knows no goals."""
    terms: Mapping[str, Array] = field(default_factory=dict)
    """The forces by cause (``attraction``, ``repulsion_robots``, ``repulsion_obstacle``, ...), (n, 2) N."""
    cells: Cells | None = None
    """Those that the law used."""
    memory: Any = None
    """Memory of the robots; it is handed back at the next decision."""


@dataclass(slots=True, eq=False)
class Snapshot:
    """One moment of a simulation: the state, what was seen in it, and what was decided on it."""

    seen: Observations
    decision: Decision
    truth: Array | None = None
    """(n, 2) m, where the robots are, if that is not where they believe themselves to be."""
    working: BoolArray | None = None
    """(n,) Which robots are there and have not failed; None: all."""
    inbox: Any = None
    """The messages that the robots then have; None where they know the others as they are."""

    def __repr__(self) -> str:
        return f"<Snapshot at {self.time:.2f} s, {format_count(len(self.positions), 'robot')}>"

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self.seen.time

    @property
    def positions(self) -> Array:
        """Centres of the robots, (n, 2) m."""
        return self.seen.positions if self.truth is None else self.truth

    @property
    def velocities(self) -> Array:
        """Velocities, (n, 2) m/s."""
        return self.seen.velocities

    @property
    def steering(self) -> Array | None:
        """Heading and turning rate of unicycles, (n, 2) rad and rad/s; None in a team of points."""
        return self.seen.steering


@dataclass(eq=False)
class Cells(ABC):
    """The cells of robots within the region; most of it is computed when it is first asked for."""

    generators: Array
    """(n, 2) m"""
    mass: Array
    """(n,) m², M of equation (2): the areas of the cells where the density is 1."""
    centroid: Array
    """(n, 2) m, C of equation (2). An empty cell's is its generator."""
    density: Density | None = None
    """φ of mass, centroid and moments; None for 1."""
    triangulation: NDArray[np.int32] | None = None
    """Warm start of the next partition of slowly moving generators, as its `warm`, if there is one."""

    @property
    @abstractmethod
    def edges(self) -> CellEdges:
        """The edges of all cells, with what lies beyond them."""

    @property
    @abstractmethod
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and whose each is, in an order to paint them in."""

    @cached_property
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells with a border between them, (m, 2), ascending.

        Where communication is limited, cells overlap: i and j are then a pair when the border
        between them is an edge of either.
        """
        return self.edges.list_adjacent_pairs()

    @cached_property
    def polar_moment(self) -> Array:
        """J_{V,p} of equation (2), (n,) m⁴: the polar moments of the cells about their generators."""
        return (self.density or Uniform()).compute_moments(self.edges, self.generators)[:, 3]

    @property
    def polar_moment_about_centroid(self) -> Array:
        """J_{V,C}, (n,) m⁴, by the parallel axis theorem, equation (3)."""
        lever = self.generators - self.centroid
        return self.polar_moment - self.mass * (lever[:, 0] ** 2 + lever[:, 1] ** 2)


def check_decision(made: Any, count: int, controller: str, time: float, source: str = "") -> Decision:
    """Return what a controller decided, if it can be carried out and recorded.

    Parameters
    ----------
    made : object
        What the controller's `decide` returned.
    count : int
        Number of robots.
    controller : str
        Its name, for messages.
    time : float, s
    source : str
        File and line of its `decide`, for messages, as " (mine.py, line 12)".

    Raises
    ------
    ParameterError
        If it is no decision, or its forces are not finite numbers of shape (count, 2).
    """
    where = f"controller {controller!r}: decide(seen, memory)"
    when = f" at {time:.3f} s{source}"
    if not isinstance(made, Decision):
        missing = " (is a return statement missing?)" if made is None else ""
        raise ParameterError(f"{where} returned {quote(made)}{missing}{when}, expected a Decision")
    decision: Decision = made
    forces = _rows(decision.forces, count, f"{where} returned forces", when)
    goals = decision.goals
    if goals is not None:
        goals = _rows(goals, count, f"{where} returned goals", when)
    if forces is not decision.forces or goals is not decision.goals:
        decision = replace(decision, forces=forces, goals=goals)
    if not _finite(forces):
        robot = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
        got = f"the force {forces[robot].tolist()} for robot {robot + 1}{when}"
        raise ParameterError(f"{where} returned {got}, expected two finite numbers in newtons")
    return decision


def copy_decision(decision: Decision, controller: str, source: str = "") -> Decision:
    """Return a checked decision with arrays of its own: a user's controller may use its arrays again.

    `controller` and `source` are as in `check_decision`. Raises ParameterError when its terms or cells are
    of no use.
    """
    where = f"controller {controller!r}: decide(seen, memory) returned"
    if not isinstance(decision.terms, Mapping):
        raise ParameterError(f"{where} terms {quote(decision.terms)}{source}, expected a dict of forces")
    count = len(decision.forces)
    terms = {
        name: _rows(term, count, f"{where} the term {quote(name)}", source).copy()
        for name, term in decision.terms.items()
    }
    if decision.cells is not None and not isinstance(decision.cells, Cells):
        got = f"{quote(decision.cells)}{source}"
        raise ParameterError(f"{where} cells {got}, expected what robocov.partition returns, or None")
    goals = None if decision.goals is None else decision.goals.copy()
    return replace(decision, forces=decision.forces.copy(), goals=goals, terms=terms)


def check_forces(values: Any, count: int, what: str) -> Array:
    """Return forces from outside, N; a ParameterError when they are not finite and (n, 2)."""
    forces = _rows(values, count, what)
    if not _finite(forces):
        raise ParameterError(f"{what}: expected finite newtons, got {quote(forces.tolist())}")
    return forces


def to_numbers(values: object) -> Array | None:
    """Return real numbers as an array of floats, the same one if it is one; None if they are none.

    Complex numbers, texts and objects are no real numbers, whatever they can be converted to.
    """
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return values
    try:
        array = np.asarray(values)
        return array.astype(np.float64) if array.dtype.kind in "biuf" else None
    except (TypeError, ValueError, OverflowError):
        return None


def _finite(forces: Array) -> bool:
    # a sum of squares is soon known, and finite if they are, unless they are huge
    return isfinite(np.vdot(forces, forces)) or bool(np.isfinite(forces).all())


def _rows(values: Any, count: int, what: str, when: str = "") -> Array:
    """Return two numbers for each robot as an array, the same one where it is one already."""
    array = to_numbers(values)
    if array is None:
        raise ParameterError(f"{what} {quote(values)}{when}, expected numbers of shape {(count, 2)}")
    if array.shape != (count, 2):
        raise ParameterError(f"{what} of shape {array.shape}{when}, expected {(count, 2)}")
    return array
