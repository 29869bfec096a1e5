"""Tests of the checks of the Host and Origin headers, and of the operator's token."""

import pytest

from pneuforce.web.operator_token import (
    ATTEMPT_PERIOD_S,
    MAX_ADDRESSES,
    MAX_ATTEMPTS,
    TokenResult,
    TokenVerifier,
)
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
    assert is_same_origin({"host": "rig7:8080", **headers}) is is_same


TOKEN = "correct-horse-battery"


def test_only_the_exact_token_is_valid():
    assert TokenVerifier(TOKEN).verify(TOKEN, "10.0.0.1", 0.0) is TokenResult.VALID
    for token in ("", TOKEN[:-1], TOKEN + " ", TOKEN.upper(), None, 7, [TOKEN], "\ud800"):
        assert TokenVerifier(TOKEN).verify(token, "10.0.0.1", 0.0) is TokenResult.INVALID


def test_without_a_configured_token_every_token_is_invalid():
    tokens = TokenVerifier("")
    assert not tokens.is_configured
    assert tokens.verify("", "10.0.0.1", 0.0) is TokenResult.INVALID


def compared_guesses(tokens, address, seconds):
    """Send ten wrong tokens per second. Return the number of tokens that were compared."""
    results = [tokens.verify("guess", address, i / 10) for i in range(round(10 * seconds))]
    return results.count(TokenResult.INVALID)


def test_the_rate_of_guesses_is_limited():
    expected = MAX_ATTEMPTS + 3600 / ATTEMPT_PERIOD_S
    assert compared_guesses(TokenVerifier(TOKEN), "10.0.0.1", 3600) == pytest.approx(expected, abs=1)


def test_the_rate_limit_applies_to_valid_tokens_and_to_one_address_only():
    tokens = TokenVerifier(TOKEN)
    compared_guesses(tokens, "10.0.0.1", 5)
    assert tokens.verify(TOKEN, "10.0.0.1", 5.0) is TokenResult.RATE_LIMITED
    assert tokens.verify(TOKEN, "10.0.0.2", 5.0) is TokenResult.VALID
    assert tokens.verify(TOKEN, "10.0.0.1", 5.0 + MAX_ATTEMPTS * ATTEMPT_PERIOD_S) is TokenResult.VALID


def test_an_ipv6_network_has_one_rate_limit():
    tokens = TokenVerifier(TOKEN)
    results = [tokens.verify("guess", f"fd00::{i:x}", 0.0) for i in range(1, 100)]
    assert results.count(TokenResult.INVALID) == MAX_ATTEMPTS


def test_the_number_of_stored_addresses_is_limited():
    tokens = TokenVerifier(TOKEN)
    for i in range(20_000):
        tokens.verify("guess", f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", 0.0)
    assert len(tokens._bucket_empty_s) <= MAX_ADDRESSES
