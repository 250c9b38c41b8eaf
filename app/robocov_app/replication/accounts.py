"""What is said of every controller: where it comes from, and what it does."""

from __future__ import annotations

from typing import NamedTuple

from robocov.controllers import controller_kind, information_of


class Account(NamedTuple):
    """What is said of a controller.

    Attributes
    ----------
    controller, label : str
    information : str
        What it goes by: "own", "shared map" or "whole map".
    short : str
        Its source as a table has it.
    source : str
        Its source in full.
    does : str
        What it does, in a few sentences.
    """

    controller: str
    label: str
    information: str
    short: str
    source: str
    does: str


_PAPER = (
    "A. Renzaglia and A. Martinelli, “Distributed Coverage Control for a Multi-Robot Team in a Non-Convex "
    "Environment”"
)

_NOT_READ = "made from what is generally known of it, not from its text"

_KNOWN: dict[str, tuple[str, str, str]] = {
    "rapf": (
        "the paper",
        f"{_PAPER}, (23) to (28).",
        "Other robots and the nearest obstacle point repel within rho_0; the centroid of the robot's Voronoi "
        "cell, which ignores obstacles, attracts with the cube of the distance.",
    ),
    "rpf": (
        "the paper",
        f"{_PAPER}, (23) to (25), the law that it compares with.",
        "The repulsion alone: robots spread until nobody is within rho_0, or forces balance.",
    ),
    "lloyd": (
        "Cortés et al. 2004",
        "J. Cortés, S. Martínez, T. Karatas and F. Bullo, “Coverage Control for Mobile Sensing Networks”, "
        "IEEE T-RA 20, 2004; LA in the paper.",
        "Every robot heads for the centroid of its Voronoi cell and slides along whatever it touches.",
    ),
    "howard": (
        "Howard et al. 2002",
        "A. Howard, M. J. Matarić and G. S. Sukhatme, “Mobile Sensor Network Deployment Using Potential "
        f"Fields”, DARS 2002; {_NOT_READ}.",
        "All robots, and all obstacles that the range sensor's rays meet, push with the inverse square of "
        "their distance; the law's own friction brings the team to rest.",
    ),
    "poduri": (
        "Poduri and Sukhatme 2004",
        "S. Poduri and G. S. Sukhatme, “Constrained Coverage for Mobile Sensor Networks”, ICRA 2004; "
        f"{_NOT_READ}.",
        "Robots push each other apart, but every robot keeps at least K neighbours within the range of a "
        "link: a goal of its own, for which it pays with coverage.",
    ),
    "dispersion": (
        "Batalin and Sukhatme 2002",
        "M. A. Batalin and G. S. Sukhatme, “Spreading Out: A Local Approach to Multi-Robot Coverage”, DARS "
        f"2002; {_NOT_READ}.",
        "Away from all robots within reach, along obstacles; a robot with nobody near rests.",
    ),
    "range-limited": (
        "Cortés et al. 2005",
        "J. Cortés, S. Martínez and F. Bullo, “Spatially-Distributed Coverage Optimization and Control with "
        f"Limited-Range Interactions”, ESAIM: COCV 11, 2005; {_NOT_READ}.",
        "Lloyd's algorithm on the part of the cell within half the range in which robots hear each other: "
        "what a team can descend that hears no farther.",
    ),
    "tangentbug": (
        "Breitenmoser et al. 2010",
        "A. Breitenmoser, M. Schwager, J.-C. Metzger, R. Siegwart and D. Rus, “Voronoi Coverage of "
        f"Non-Convex Environments with a Group of Networked Robots”, ICRA 2010; {_NOT_READ}.",
        "Lloyd's algorithm plans: the centroid of the cell. TangentBug goes there, round obstacles by what "
        "its scans see; where the centroid lies in an obstacle, to the nearest place of its boundary.",
    ),
    "barrier": (
        "Wang et al. 2017",
        "L. Wang, A. D. Ames and M. Egerstedt, “Safety Barrier Certificates for Collisions-Free Multirobot "
        f"Systems”, IEEE T-RO 33, 2017; {_NOT_READ}.",
        "Lloyd's algorithm, whose accelerations are changed as little as is needed for nobody to come closer "
        "than a safe distance to a robot or to an obstacle point: one quadratic programme a robot and step.",
    ),
    "geodesic-lloyd": (
        "Pimenta et al. 2008, Bhattacharya et al. 2014",
        "L. C. A. Pimenta, V. Kumar, R. C. Mesquita and G. A. S. Pereira, “Sensing and Coverage for a "
        "Network of Heterogeneous Robots”, CDC 2008; S. Bhattacharya, R. Ghrist and V. Kumar, “Multi-robot "
        f"Coverage and Exploration on Riemannian Manifolds with Boundaries”, IJRR 33, 2014; {_NOT_READ}.",
        "Knows the whole map from the beginning and descends the geodesic cost: what a robot could do that "
        "need not find out. An informed bound, no rival.",
    ),
    "atlas": (
        "robocov",
        "The project's own controller.",
        "Every robot enters what its own range sensor meets into a map of its own, in which the unknown "
        "counts by how likely it is free, plans on it where all that it hears would best be (a k-median "
        "problem with geodesic distances), goes to its own place in that plan, and looks around there where "
        "that may matter.",
    ),
    "atlas-shared": (
        "robocov",
        "The project's own controller, with maps that neighbours share.",
        "As Atlas, but robots tell their neighbours what they have seen, and plan on the merged map.",
    ),
}
"""By controller: short source, source, what it does."""


def account_of(controller: str) -> Account:
    """Return what is said of a controller; of one that nothing is known of, its own summary."""
    kind = controller_kind(controller)
    short, source, does = _KNOWN.get(controller, ("–", "", ""))
    return Account(
        controller, kind.label, information_of(kind), short, source, does or _sentence(kind.summary)
    )


def _sentence(words: str) -> str:
    """Return words as a sentence.

    >>> _sentence("goes to the middle")
    'Goes to the middle.'
    """
    return words[:1].upper() + words[1:].rstrip(".") + "."
