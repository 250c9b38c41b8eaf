"""The exact coverage cost of all panes, computed in another process; answers arrive some frames later."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from robocov.cost import CoverageCost, CoverageResult, Sites, TimeVaryingCost
from robocov.defaults import DEFAULT_LATTICE, DEFAULT_RADIUS_M
from robocov.environment import Environment
from robocov.errors import InputError, RobocovError
from robocov.kernel_compilation import (
    are_kernels_compiled,
    call_cost_kernels,
    compile_kernels,
    is_compiling_in_background,
)
from robocov.typing import FloatArray
from robocov_app.jobs.messages import Channel, Codec
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice

PROGRESS_INTERVAL_S = 0.05  # between progress reports while a map is prepared
MIN_LISTED_TIME_S = 1.0  # a shorter remaining time is not shown


@dataclass(frozen=True, eq=False)
class KnownCost:
    """The latest known cost of a pane.

    Attributes
    ----------
    time : float
        Simulation time to which the cost belongs, s.
    result : CoverageResult
        The cost.
    path : (k, 2) array, m, or None
        Path from the cursor to its nearest robot; empty if there is none.
    get_lattice : callable
        Returns the lattice of sites for drawing the distance field.
    travel_time : float or None
        Mean time until the first robot can reach a point, s; None if all robots are equally fast.
    """

    time: float
    result: CoverageResult
    path: FloatArray | None
    get_lattice: Callable[[], FieldLattice]
    travel_time: float | None = None

    @cached_property
    def field(self) -> DistanceField:
        """Distance field for drawing."""
        return DistanceField(self.get_lattice(), self.result)


class _SharedSites(NamedTuple):
    """Data shared by all results on a map: sites, corners of geodesic paths, and weights of the sites."""

    sites: Sites
    corners: FloatArray
    weights: FloatArray | None


@dataclass(frozen=True, eq=False)
class CostRequest:
    """Request for the cost on a map, or only to prepare the map if there are no positions.

    Attributes
    ----------
    number : int
        Number of the map.
    environment : Environment or None
        The map; None if it was sent before.
    lattice : int
        Number of sites along the longer side of the map.
    time : float
        Time, s.
    positions : (n, 2) array, m, or None
        Positions of the robots.
    point : (2,) array, m, or None
        Point whose path to its nearest robot is requested.
    speeds : (n,) array, m/s, or None
        Maximum speeds of the robots, for the mean time.
    is_for_curve : bool
        Whether the answer is only added to a curve, and is not displayed as the latest cost of its pane.
    radius : float
        Radius of the smallest robot, m; see `CoverageCost`.
    """

    number: int
    environment: Environment | None
    lattice: int
    time: float = 0.0
    positions: FloatArray | None = None
    point: FloatArray | None = None
    speeds: FloatArray | None = None
    is_for_curve: bool = False
    radius: float = DEFAULT_RADIUS_M


class Costs:
    """Costs of the panes of a window.

    Parameters
    ----------
    lattice : int
        Number of sites along the longer side of the map.
    direct : bool
        Whether to compute costs synchronously instead of in another process, for images that must not depend
        on computing speed.

    Attributes
    ----------
    known : dict of int to KnownCost
        Latest cost of each pane, by its number.
    state : str
        Progress of preparing a map, or why there is no cost; otherwise empty.
    lattice : int
        Number of sites along the longer side of the map.
    """

    def __init__(self, lattice: int = DEFAULT_LATTICE, *, direct: bool = False) -> None:
        """Start the worker, which computes nothing until `set_environment` is called."""
        self.known: dict[int, KnownCost] = {}
        self.state = ""
        self.lattice = lattice
        self._is_direct = direct
        self._worker = _create_worker(direct=direct)
        self._map_request: CostRequest | None = None
        self._pending: CostRequest | None = None
        self._map_number = 0
        self._is_prepared = False
        self._queued: dict[int, CostRequest] = {}
        self._pending_pane: int | None = None  # None for a map, or if the answer is no longer needed

    def set_environment(self, environment: Environment, radius: float = DEFAULT_RADIUS_M) -> None:
        """Start to prepare the computation of costs on another map, or for another size of robots.

        Parameters
        ----------
        environment : Environment
            The map.
        radius : float
            Radius of the smallest robot, m.
        """
        self._map_number += 1
        self._map_request = CostRequest(self._map_number, environment, self.lattice, radius=radius)
        self.known = {}
        self._queued = {}
        self._prepare_map()
        self.poll()

    def create_similar(self) -> "Costs":
        """Return other costs with the same number of sites, which are computed in another process."""
        return Costs(self.lattice, direct=self._is_direct)

    @property
    def is_idle(self) -> bool:
        """Whether the map is prepared and all requests are answered."""
        return self._is_prepared and self._pending is None and not self._queued

    def forget(self) -> None:
        """Drop all known costs and pending requests, because they belong to another run."""
        self._queued = {}
        self.known = {}
        self._pending_pane = None

    def request(
        self,
        pane: int,
        time: float,
        positions: FloatArray,
        point: FloatArray | None = None,
        speeds: FloatArray | None = None,
        *,
        is_for_curve: bool = False,
    ) -> None:
        """Queue a request for the cost of a pane; it replaces an earlier one for the same pane.

        Parameters
        ----------
        pane : int
            Number of the pane.
        time : float
            Time, s.
        positions : (n, 2) array, m
            Positions of the robots.
        point : (2,) array, m, optional
            Point whose path to its nearest robot is requested.
        speeds : (n,) array, m/s, optional
            Maximum speeds of the robots, for the mean time.
        is_for_curve : bool
            Whether the answer is only added to a curve.
        """
        if self._map_request is None:
            return
        # A replaced request keeps its place in the queue, so that panes take turns.
        self._queued[pane] = replace(
            self._map_request,
            time=time,
            positions=np.array(positions),
            point=point,
            speeds=speeds,
            is_for_curve=is_for_curve,
        )

    def poll(self) -> list[tuple[int, KnownCost]]:
        """Collect answers, and send the next request to the worker.

        Returns
        -------
        list of (int, KnownCost)
            The answers since the last call, each with the number of its pane.
        """
        answers: list[tuple[int, KnownCost]] = []
        while self._pending is not None or self._send_next():
            answer = self._worker.poll()
            if self._worker.is_busy:
                self._show_progress()
                break
            request = self._pending
            self._pending = None
            if request is self._map_request:
                self._is_prepared = answer is not None
                self.state = "" if self._is_prepared else f"no cost: {self._worker.problem}"
            elif isinstance(answer, KnownCost):
                if self._pending_pane is not None:
                    answers.append((self._pending_pane, answer))
                    self._adopt_answer(request, self._pending_pane, answer)
            elif not self._worker.is_alive:
                # The process has died. Preparing the map starts a new one; if it dies, too, there is no cost.
                self._prepare_map()
        return answers

    def _adopt_answer(self, request: CostRequest | None, pane: int, answer: KnownCost) -> None:
        """Make an answer the latest cost of its pane, unless it was requested only for a curve."""
        if request is None or not request.is_for_curve:
            self.known[pane] = answer

    def close(self) -> None:
        """End the process."""
        self.forget()
        self._worker.close()

    def _show_progress(self) -> None:
        if self._worker.progress is None:
            return
        fraction, remaining = self._worker.progress
        text = f", {remaining:.0f} s left" if remaining >= MIN_LISTED_TIME_S else ""
        self.state = f"cost: preparing the map, {fraction:.0%}{text}"

    def _prepare_map(self) -> None:
        self._is_prepared = False
        self.state = "cost: preparing the map"
        if is_compiling_in_background() and not are_kernels_compiled([call_cost_kernels]):
            self.state = "cost: compiling, once per version"
        self._pending = self._map_request
        self._pending_pane = None
        self._worker.put(self._map_request)

    def _send_next(self) -> bool:
        """Send the oldest queued request; return whether there was one."""
        if not self._queued or not self._is_prepared:
            return False
        self._pending_pane = next(iter(self._queued))
        self._pending = self._queued.pop(self._pending_pane)
        self._worker.put(self._pending)
        return True


class _Answer(NamedTuple):
    """Answer of the service. It contains the shared data only if they have changed."""

    shared: _SharedSites | None
    time: float = 0.0
    result: CoverageResult | None = None
    path: FloatArray | None = None
    travel_time: float | None = None


class _CostCodec(Codec):
    """Encoding that sends each map and each set of shared data only once."""

    def __init__(self) -> None:
        self._sent_map = -1
        self._shared: _SharedSites | None = None
        self._get_lattice: Callable[[], FieldLattice] | None = None

    def encode(self, request: CostRequest) -> CostRequest:
        """Remove the map from a request if it was sent before."""
        if request.number == self._sent_map or request.environment is None:
            return replace(request, environment=None)
        self._sent_map = request.number
        # A copy lacks the cached properties, which are large and quickly computed again.
        return replace(request, environment=replace(request.environment))

    def decode(self, answer: _Answer) -> KnownCost | _SharedSites:
        """Complete an answer with the shared data."""
        if answer.shared is not None:
            self._shared = answer.shared
            sites = answer.shared.sites
            self._get_lattice = cache(lambda: FieldLattice(sites))
        assert self._shared is not None and self._get_lattice is not None
        if answer.result is None:
            return self._shared
        result = replace(
            answer.result,
            owners=answer.result.owners.astype(np.intp),
            first_corners=answer.result.first_corners.astype(np.intp),
            last_corners=answer.result.last_corners.astype(np.intp),
            points=self._shared.sites.points,
            corners=self._shared.corners,
            weights=self._shared.weights,
        )
        return KnownCost(answer.time, result, answer.path, self._get_lattice, answer.travel_time)


def _create_worker(*, direct: bool) -> Worker[KnownCost | _SharedSites]:
    """Return a worker that computes costs: in this process if `direct`, otherwise in another one.

    Only the process that computes costs builds the service, which compiles kernels first.
    """
    if direct:
        return DirectWorker(CostService(), _CostCodec())
    service = "robocov_app.viewer.costs.costs:CostService"
    return LatestWorker(service, "computes the cost", _CostCodec)


class CostService:
    """Service in the other process: prepares the latest map, and answers the latest request about it."""

    failure_message = "the cost could not be computed"

    def __init__(self) -> None:
        # If another process is already compiling these kernels, this waits for it.
        compile_kernels([call_cost_kernels])
        self._cost: CoverageCost | None = None
        self._sent_cost: CoverageCost | None = None  # the cost whose shared data were sent last
        self._varying_cost: TimeVaryingCost | None = None

    def __call__(self, requests: list[CostRequest], channel: Channel) -> _Answer:
        """Answer the last of several requests; the map may have come with an earlier one."""
        maps = [request for request in requests if request.environment is not None]
        if maps:
            self._prepare(maps[-1], channel)
        cost = self._cost
        varying_cost = self._varying_cost
        request = requests[-1]
        if cost is None or varying_cost is None:
            raise InputError("the map has no cost")
        answer = _Answer(None)
        if request.positions is not None:
            answer = _evaluate(varying_cost, request, request.positions)
            cost = varying_cost.get_cost(request.time)
        shared = None
        if cost is not self._sent_cost:
            shared = _SharedSites(cost.sites, cost.corners, cost.weights)
        self._sent_cost = cost
        return answer._replace(shared=shared)

    def _prepare(self, request: CostRequest, channel: Channel) -> None:
        """Prepare the cost of a map; stop with a RobocovError as soon as a newer map has been sent."""
        environment = request.environment
        assert environment is not None
        started_at = time.perf_counter()
        reported_at = started_at

        def stop_for_newer_map(fraction: float) -> None:
            if any(newer.environment is not None for newer in channel.get_newer_requests()):
                raise RobocovError("there is a newer map")

        def report_progress(fraction: float) -> None:
            nonlocal reported_at
            stop_for_newer_map(fraction)
            now = time.perf_counter()
            if now - reported_at > PROGRESS_INTERVAL_S and fraction > 0.0:
                reported_at = now
                remaining_s = (now - started_at) * (1.0 - fraction) / fraction
                channel.report_progress((fraction, remaining_s))

        self._varying_cost = None
        # If only the density differs, the geodesic distances of the previous map can be reused.
        before = self._cost
        is_reusable = (
            before is not None
            and before.lattice == request.lattice
            and before.radius == request.radius
            and before.environment.has_same_geometry(environment)
        )
        if before is not None and is_reusable:
            self._cost = before.with_density(environment)
        else:
            self._cost = CoverageCost(
                environment, request.lattice, radius=request.radius, progress=report_progress
            )
        self._varying_cost = TimeVaryingCost(self._cost, progress=stop_for_newer_map)


def _evaluate(cost: TimeVaryingCost, request: CostRequest, positions: FloatArray) -> _Answer:
    """Compute the answer to a request, without the shared data."""
    result = cost.evaluate_all_robots(request.time, positions)
    if result is None:
        raise InputError("positions: expected at least one at a free position, got none")
    path: FloatArray | None = None
    if request.point is not None:
        # There is no path from a point that is not free.
        with suppress(RobocovError):
            available = cost.find_available_robots(request.time, positions)
            path = cost.get_cost(request.time).find_path(positions[available], request.point)
    # Sending 32-bit integers takes half as long.
    result = replace(
        result,
        owners=result.owners.astype(np.int32),
        first_corners=result.first_corners.astype(np.int32),
        last_corners=result.last_corners.astype(np.int32),
        points=np.empty((0, 2)),
        corners=np.empty((0, 2)),
        weights=None,
        environment=None,
        sites=None,
    )
    travel_time = _compute_travel_time(cost, request, positions)
    return _Answer(None, request.time, result, path, travel_time)


def _compute_travel_time(cost: TimeVaryingCost, request: CostRequest, positions: FloatArray) -> float | None:
    """Return the mean time until the first robot can reach a point, s; None without speeds."""
    if request.speeds is None:
        return None
    result = cost(request.time, positions, speeds=request.speeds)
    if result is None:
        return None
    return result.mean_time
