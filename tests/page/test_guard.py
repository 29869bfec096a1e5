"""Whose requests are looked at, and how slowly a token is guessed."""

import pytest

from page.guard import is_own, is_same_origin, own_names
from page.tokens import MOST_ADDRESSES, TRIES, TRY_AGAIN_S, Tokens, Verdict

NAMES = frozenset(("localhost", "rig7", "rig7.local"))
OWN = (
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


@pytest.mark.parametrize("host", [*OWN, "rig7", "rig7.local:8080"])
def test_this_machine_is_known_by_its_addresses_and_its_names(host):
    assert is_own(host, NAMES)


@pytest.mark.parametrize("host", [*FOREIGN, *MALFORMED])
def test_no_other_name_is_this_machines(host):
    assert not is_own(host, NAMES)


def test_localhost_is_always_one_of_its_names():
    assert "localhost" in own_names()


@pytest.mark.parametrize(
    ("headers", "same"),
    [
        ({}, True),  # no browser
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
def test_only_our_own_page_and_no_browser_at_all_may_order(headers, same):
    assert is_same_origin({"host": "rig7:8080", **headers}) is same


TOKEN = "correct-horse-battery"


def test_the_token_is_right_and_nothing_else():
    tokens = Tokens(TOKEN)
    assert tokens.judge(TOKEN, "10.0.0.1", 0.0) is Verdict.RIGHT
    for given in ("", TOKEN[:-1], TOKEN + " ", TOKEN.upper(), None, 7, [TOKEN], "\ud800"):
        assert Tokens(TOKEN).judge(given, "10.0.0.1", 0.0) is Verdict.WRONG


def test_without_a_token_nobody_has_it():
    tokens = Tokens("")
    assert not tokens.writable
    assert tokens.judge("", "10.0.0.1", 0.0) is Verdict.WRONG


def guesses(tokens, address, seconds):
    """How many guesses of one a tenth of a second were looked at."""
    verdicts = [tokens.judge("guess", address, i / 10) for i in range(round(10 * seconds))]
    return verdicts.count(Verdict.WRONG)


def test_guessing_is_slow():
    assert guesses(Tokens(TOKEN), "10.0.0.1", 3600) == pytest.approx(TRIES + 3600 / TRY_AGAIN_S, abs=1)


def test_who_guesses_is_not_looked_at_even_when_right_and_others_are():
    tokens = Tokens(TOKEN)
    guesses(tokens, "10.0.0.1", 5)
    assert tokens.judge(TOKEN, "10.0.0.1", 5.0) is Verdict.WAIT
    assert tokens.judge(TOKEN, "10.0.0.2", 5.0) is Verdict.RIGHT
    assert tokens.judge(TOKEN, "10.0.0.1", 5.0 + TRIES * TRY_AGAIN_S) is Verdict.RIGHT


def test_a_network_of_ipv6_is_one_guesser():
    tokens = Tokens(TOKEN)
    looked_at = [tokens.judge("guess", f"fd00::{i:x}", 0.0) for i in range(1, 100)].count(Verdict.WRONG)
    assert looked_at == TRIES


def test_a_million_guessers_fill_no_memory():
    tokens = Tokens(TOKEN)
    for i in range(20_000):
        tokens.judge("guess", f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", 0.0)
    assert len(tokens._clear_s) <= MOST_ADDRESSES
