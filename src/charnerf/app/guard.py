"""Who may talk to the server: the page that it sent itself, and nobody's page elsewhere.

A server on localhost is reached by every page that the user has open. What keeps those out: a request must name the host that
the server is known by (a foreign name that was pointed at this address, "DNS rebinding", does not); what changes something must
come from the page itself (Origin); and a session is known by an id that can not be guessed.
"""

import ipaddress
from collections.abc import Collection, Mapping
from urllib.parse import urlsplit

SAFE = ("GET", "HEAD")
HEADERS = {
    # 'unsafe-inline' is for styles alone: the mesh viewer brings its own
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; media-src 'self'; connect-src 'self' blob: data:;"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


def refusal(method: str, headers: Mapping[str, str], names: Collection[str]) -> str | None:
    """Why a request is refused; None where it is not.

    Args:
        method: Of HTTP.
        headers: The request's.
        names: Hosts that the server is known by, in lower case, without ports; numbers are always right: a rebound name is none.
    """
    host = headers.get("Host", "")
    name = _name(host)
    if name not in names and not _is_number(name):
        return (
            f"Host: found {host[:100]!r}, expected a name that this server is known by. If it is one, start charnerf app with"
            f" --name {name[:60] or 'NAME'}."
        )
    origin = headers.get("Origin")
    if method not in SAFE and (origin is None or urlsplit(origin).netloc.lower() != host.lower()):
        return "Origin: found another page's, expected this page's own. Open the page itself."
    if headers.get("Sec-Fetch-Site", "none") == "cross-site" and headers.get("Sec-Fetch-Mode") != "navigate":
        return "Sec-Fetch-Site: found another page's request, expected this page's own. Open the page itself."
    return None


def _name(host: str) -> str:
    """A Host header without its port, in lower case; empty where it is none."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_number(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
