"""Who may talk to the server: the page that it sent itself, and nobody's page elsewhere.

What keeps other pages out: a request must name a host that the server is known by; what changes something must come from the page
itself (Origin); and a session is known by an id that can not be guessed.
"""

from collections.abc import Collection, Mapping

from charnerf.hosts import host_name, is_known

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
REPORT_HEADERS = {
    # a page of its own origin, that of nobody: what a drawing's name may have smuggled into it reaches no session
    "Content-Security-Policy": "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline';"
    " style-src 'unsafe-inline'; img-src data: blob:; media-src data:; connect-src data: blob:; base-uri 'none';"
    " form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "unsafe-none",  # browsers refuse a sandboxed page that has another
}


def refusal(method: str, headers: Mapping[str, str], names: Collection[str]) -> str | None:
    """Why a request is refused; None where it is not.

    Args:
        method: Of HTTP.
        headers: The request's.
        names: Hosts that the server is known by, in lower case, without ports; numbers are always right.
    """
    host = headers.get("Host", "")
    name = host_name(host)
    if not is_known(name, names):
        return (
            f"Host: found {host[:100]!r}, expected a name that this server is known by. If it is one, start charnerf app with"
            f" --name {name[:60] or 'NAME'}."
        )
    origin = headers.get("Origin")
    if method not in SAFE and (origin is None or origin.partition("://")[2].lower() != host.lower()):
        return "Origin: found another page's, expected this page's own. Open the page itself."
    if headers.get("Sec-Fetch-Site", "none") == "cross-site" and headers.get("Sec-Fetch-Mode") != "navigate":
        return "Sec-Fetch-Site: found another page's request, expected this page's own. Open the page itself."
    return None
