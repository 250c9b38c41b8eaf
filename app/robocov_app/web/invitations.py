"""Invitations to a served window: its link, and a QR code that opens it on a phone."""

from __future__ import annotations

from robocov_app.toolkit.window.share_link import ShareLink


def build_invitation(link: ShareLink) -> dict[str, str | bool]:
    """Build the invitation that the controlling page can show on a projector.

    Parameters
    ----------
    link : ShareLink

    Returns
    -------
    dict
        ``link``; ``qr_code`` as a data URI, which is empty if segno is not installed; and
        ``opens_own_window``. The dictionary is empty if only this computer can reach the server.
    """
    if link.is_local:
        return {}
    return {
        "link": link.address,
        "qr_code": build_qr_code(link.address),
        "opens_own_window": link.opens_own_window,
    }


def build_qr_code(link: str) -> str:
    """Return the QR code of a link as the data URI of an SVG image; empty if segno is not installed."""
    try:
        import segno
    except ImportError:
        return ""
    # Black on white in both themes, with the standard quiet zone, so that every camera can read it.
    return segno.make_qr(link, error="m").svg_data_uri(border=4, dark="#000", light="#fff")
