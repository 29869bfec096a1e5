"""Tests of the checks of the Host and Origin headers."""

import pytest

from pneuforce.web.request_guard import is_same_origin, is_this_machine, machine_names

NAMES = frozenset(("localhost", "rig7", "rig7.local"))
VALID = (
    "localhost",
    "LOCALHOST:8080",
    "127.0.0.1",
    "127.0.0.1:8080",
    "192.168.1.5:8080",
    "[::1]",
    "[::1]:8080",
)
FOREIGN = ("", "evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example")
MALFORMED = ("::1", "[::1", "]", "[]", "[rig7]", "localhost:80x", "127.0.0.1:8080:90", "a]b", "local host")


@pytest.mark.parametrize("host", [*VALID, "rig7", "rig7.local:8080"])
def test_a_host_header_with_an_address_or_an_own_name_is_accepted(host):
    assert is_this_machine(host, NAMES)


@pytest.mark.parametrize("host", [*FOREIGN, *MALFORMED])
def test_any_other_host_header_is_rejected(host):
    assert not is_this_machine(host, NAMES)


def test_localhost_is_always_an_own_name():
    assert "localhost" in machine_names()


@pytest.mark.parametrize(
    ("headers", "is_same"),
    [
        ({}, True),  # a program that is not a browser
        ({"origin": "http://rig7:8080"}, True),
        ({"origin": "https://RIG7:8080"}, True),
        ({"origin": "http://rig7:8081"}, False),
        ({"origin": "http://rig7"}, False),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"origin": ""}, False),
        ({"origin": "file://rig7:8080"}, False),
        ({"sec-fetch-site": "same-origin"}, True),
        ({"sec-fetch-site": "cross-site"}, False),
        ({"sec-fetch-site": "same-site"}, False),
    ],
)
def test_only_the_own_page_and_other_programs_have_the_same_origin(headers, is_same):
    assert is_same_origin({"host": "rig7:8080", **headers}, "http") is is_same
