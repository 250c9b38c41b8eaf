"""The link with which others open a served window."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ShareLink:
    """The link with which others open a served window.

    Attributes
    ----------
    address : str
    host : str
        Address at which its server listens.
    opens_own_window : bool
        Whether everyone who follows it gets a window of their own, instead of watching this one.
    """

    address: str
    host: str
    opens_own_window: bool = False
