"""Tests of the operator's token in virtual time: verification, rate of guesses, and login during a flood."""

import itertools

import pytest

from pneuforce.web.client_network import client_network
from pneuforce.web.operator_token import (
    ATTEMPT_PERIOD_S,
    MAX_ATTEMPTS,
    MAX_CLIENTS,
    PLACE_TIMEOUT_S,
    TokenResult,
    TokenVerifier,
)

TOKEN = "correct-horse-battery"
CLIENT = "10.0.0.1"
FLOOD_PER_S = 20
#: Wrong tokens that a program sends: a new token each time, always the same, or some tokens in turn.
FLOODS = {
    "new": lambda: (f"guess {number}" for number in itertools.count()),
    "same": lambda: itertools.repeat("guess"),
    "in turn": lambda: itertools.cycle([f"guess {number}" for number in range(10)]),
}


def test_only_the_exact_token_is_valid():
    assert TokenVerifier(TOKEN).verify(TOKEN, CLIENT, 0.0) is TokenResult.VALID
    for token in ("", TOKEN[:-1], TOKEN + " ", TOKEN.upper(), None, 7, [TOKEN], "\ud800"):
        assert TokenVerifier(TOKEN).verify(token, CLIENT, 0.0) is TokenResult.INVALID


def test_without_a_configured_token_every_token_is_invalid():
    tokens = TokenVerifier("")
    assert not tokens.is_configured
    assert tokens.verify("", CLIENT, 0.0) is TokenResult.INVALID


def flood(tokens, guesses, begin_s, end_s):
    """Send wrong tokens. Return the number of tokens that were compared."""
    times_s = (begin_s + number / FLOOD_PER_S for number in itertools.count())
    results = [
        tokens.verify(next(guesses), CLIENT, now_s)
        for now_s in itertools.takewhile(lambda now_s: now_s < end_s, times_s)
    ]
    return results.count(TokenResult.INVALID)


@pytest.mark.parametrize("kind", FLOODS)
def test_the_rate_of_guesses_is_limited(kind):
    compared = flood(TokenVerifier(TOKEN), FLOODS[kind](), 0.0, 3600.0)
    assert MAX_ATTEMPTS <= compared <= MAX_ATTEMPTS + 3600 / ATTEMPT_PERIOD_S
    if kind != "new":  # a new token is never sent again, so that it never reaches the first place
        assert compared == pytest.approx(MAX_ATTEMPTS + 3600 / ATTEMPT_PERIOD_S, abs=1)


def login_s(tokens, guesses, period_s):
    """Return the time until the right token is accepted during a flood."""
    begin_s = 600.0
    flood(tokens, guesses, 0.0, begin_s)
    now_s = begin_s
    while tokens.verify(TOKEN, CLIENT, now_s) is not TokenResult.VALID:
        flood(tokens, guesses, now_s + 0.01, now_s + period_s)
        now_s += period_s
        assert now_s < begin_s + 600.0
    return now_s - begin_s


@pytest.mark.parametrize("period_s", [0.5, 2.0, 10.0])
@pytest.mark.parametrize(("kind", "repeated"), [("new", 1), ("same", 1), ("in turn", 10)])
def test_the_right_token_is_accepted_within_a_limited_time_during_a_flood(kind, repeated, period_s):
    limit_s = (repeated + 1) * ATTEMPT_PERIOD_S + PLACE_TIMEOUT_S
    assert 0.0 < login_s(TokenVerifier(TOKEN), FLOODS[kind](), period_s) <= limit_s + period_s


def test_the_limit_applies_to_the_right_token_and_to_one_client_only():
    tokens = TokenVerifier(TOKEN)
    flood(tokens, FLOODS["same"](), 0.0, 5.0)
    assert tokens.verify(TOKEN, CLIENT, 5.0) is TokenResult.RATE_LIMITED
    assert tokens.verify(TOKEN, "10.0.0.2", 5.0) is TokenResult.VALID
    assert tokens.verify(TOKEN, CLIENT, 5.0 + MAX_ATTEMPTS * ATTEMPT_PERIOD_S) is TokenResult.VALID


def test_an_ipv6_network_is_one_client():
    networks = {client_network(f"fd00::{i:x}") for i in range(1, 100)}
    assert networks == {"fd00::/64"}
    assert client_network("fd00:0:0:1::1") != client_network("fd00::1")
    assert client_network("::ffff:10.0.0.1") == client_network("10.0.0.1") == "10.0.0.1"


def test_the_memory_of_clients_and_tokens_is_limited():
    tokens = TokenVerifier(TOKEN)
    for i in range(20_000):
        tokens.verify("guess", f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", 0.0)
    assert len(tokens._limits) <= MAX_CLIENTS
    flood(tokens, FLOODS["new"](), 0.0, 600.0)
    flood(tokens, FLOODS["same"](), 600.0, 620.0)
    assert {client: len(limit.waiting) for client, limit in tokens._limits.items()} == {CLIENT: 1}
