"""Cost curves of the branches that are not displayed."""

from itertools import chain

import numpy as np

from robocov_app.viewer.session.document import Branch, Node, SessionDocument
from robocov_app.viewer.session.past.curves import Curve, GhostCurve

MAX_GHOST_BRANCHES = 8
"""Maximum number of branches whose curves are displayed."""
QUANTITIES = ("distance", "time")


def build_ghost_curves(document: SessionDocument, head: Node, step: int, dt: float) -> list[GhostCurve]:
    """Build the curves of the newest branches of the same run, other than the present branch.

    Parameters
    ----------
    document : SessionDocument
    head : Node
        The node whose time span contains the present.
    step : int
        The present step.
    dt : float, s
        Control period.

    Returns
    -------
    list of GhostCurve
        The parts of the curves that are not on the path to the present.
    """
    last_steps = document.get_last_steps(head, step)
    root = document.get_path(head)[0]
    curves_of_branches = []
    for branch in document.list_branches():
        if document.get_path(branch.node)[0] is root:
            curves = _build_branch_curves(document, branch, last_steps, dt)
            # The present branch has no curves: no part of it is off the path to the present.
            if curves:
                curves_of_branches.append(curves)
    return list(chain.from_iterable(curves_of_branches[-MAX_GHOST_BRANCHES:]))


def _build_branch_curves(
    document: SessionDocument, branch: Branch, last_steps: dict[int, int], dt: float
) -> list[GhostCurve]:
    """Build the curves of a branch for all panes and quantities, without the parts on the present path.

    Parameters
    ----------
    document : SessionDocument
    branch : Branch
    last_steps : dict of int to int
        Last step on the path to the present for each node of that path, by the node's number.
    dt : float, s
        Control period.
    """
    branch_last_steps = document.get_last_steps(branch.node, branch.last_step)
    path = document.get_path(branch.node)
    ghosts = []
    for pane, controller in branch.controllers.items():
        for quantity in QUANTITIES:
            curve = Curve()
            for node in path:
                # Up to this step, the curve of the present already shows the same values.
                start = last_steps.get(node.number, -np.inf)
                end = branch_last_steps[node.number]
                if end > start:
                    curve.extend(node.curves[pane, quantity].extract(start * dt, end * dt))
            if len(curve) > 1:
                ghosts.append(
                    GhostCurve(
                        controller=controller.name,
                        description=controller.description,
                        times=curve.times,
                        values=curve.values,
                        quantity=quantity,
                        node=branch.node.number,
                    )
                )
    return ghosts
