"""Who may ask: the page itself, by a name of the server; nobody else's page."""

import pytest

from charnerf.app.guard import HEADERS, refusal

NAMES = {"localhost"}
OWN = {"Host": "localhost:8765", "Origin": "http://localhost:8765"}


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:1", "127.0.0.1:8765", "[::1]:8765", "192.168.1.7"])
def test_a_name_of_the_server_or_a_number_is_right(host):
    assert refusal("GET", {"Host": host}, NAMES) is None
    assert refusal("POST", {"Host": host, "Origin": f"http://{host}"}, NAMES) is None


@pytest.mark.parametrize(
    "host",
    ["", "evil.example:8765", "localhost.evil.example", "127.0.0.1.evil.example", "[::1", "2130706433"],
)
def test_a_foreign_name_that_points_here_is_refused(host):
    assert "expected a name" in (refusal("GET", {"Host": host, "Origin": f"http://{host}"}, NAMES) or "")


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "null",
        "http://evil.example",
        "http://localhost",
        "http://localhost:9",
        "http://localhost:8765.evil",
        "http://[",
        "http://\u2100.com",
    ],
)
def test_another_page_changes_nothing(origin):
    headers = {"Host": OWN["Host"]} | ({} if origin is None else {"Origin": origin})
    for method in ("POST", "DELETE", "PUT", "OPTIONS"):
        assert "Origin" in (refusal(method, headers, NAMES) or "")
        assert refusal(method, OWN, NAMES) is None


def test_another_page_embeds_nothing_but_may_link():
    other = {**OWN, "Sec-Fetch-Site": "cross-site"}
    assert refusal("GET", {**other, "Sec-Fetch-Mode": "no-cors"}, NAMES) is not None
    assert refusal("GET", {**other, "Sec-Fetch-Mode": "navigate"}, NAMES) is None


def test_the_policy_lets_the_page_ask_nobody_else():
    policy = dict(part.strip().split(" ", 1) for part in HEADERS["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["form-action"] == "'none'"
    assert policy["script-src"] == "'self'"
    assert set(" ".join(policy.values()).split()) <= {"'self'", "'none'", "'unsafe-inline'", "data:", "blob:"}
