"""The link with which others open a served window."""

import ipaddress
from dataclasses import dataclass
from urllib.parse import urlsplit


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

    @property
    def is_local(self) -> bool:
        """Whether only this computer can open the address.

        Examples
        --------
        >>> ShareLink("http://127.0.0.1:8765/?token=watch", "127.0.0.1").is_local
        True
        >>> ShareLink("http://192.0.2.1:8765/?token=watch", "0.0.0.0").is_local
        False
        """
        name = urlsplit(self.address).hostname
        if name is None or name == "localhost":
            return True
        try:
            return ipaddress.ip_address(name).is_loopback
        except ValueError:  # the name of a computer
            return False
