"""By which name a browser asks: a server on this machine is reached by every page that the user has open.

A request that names a host by which the server is not known comes from a page elsewhere whose name was pointed at this
address ("DNS rebinding"). A number is none: nobody can point it elsewhere.
"""

import ipaddress
import re
from collections.abc import Collection

_HOST = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[^\[\]:/?#@\s]+)(?::\d*)?", re.ASCII)


def host_name(header: str) -> str:
    """The name in a Host header, without its port, in lower case; empty where there is none."""
    found = _HOST.fullmatch(header.lower())
    return "" if found is None else found["name"].strip("[]")


def is_known(name: str, names: Collection[str]) -> bool:
    """Whether a server is meant by a name: by one of its own, in lower case, or by a number."""
    return name in names or _is_number(name)


def _is_number(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
