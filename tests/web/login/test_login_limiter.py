"""Tests of the rate limit of logins in virtual time: rate of guesses, and login during a flood."""

import itertools

import pytest

from pneuforce.web.login.login_limiter import (
    ATTEMPT_PERIOD_S,
    MAX_ATTEMPTS,
    MAX_CLIENTS,
    PLACE_TIMEOUT_S,
    LoginLimiter,
)
from pneuforce.web.server.client_network import client_network

NAME, PASSWORD = "anna", "correct-horse-battery"
CLIENT = "10.0.0.1"
FLOOD_PER_S = 20
#: Wrong passwords that a program sends: a new one each time, always the same, or some of them in turn.
FLOODS = {
    "new": lambda: (f"guess {number}" for number in itertools.count()),
    "same": lambda: itertools.repeat("guess"),
    "in turn": lambda: itertools.cycle([f"guess {number}" for number in range(10)]),
}


def flood(limiter, guesses, begin_s, end_s):
    """Send wrong passwords. Return the number of passwords that were compared."""
    times_s = (begin_s + number / FLOOD_PER_S for number in itertools.count())
    return sum(
        limiter.take_turn(CLIENT, NAME, next(guesses), now_s)
        for now_s in itertools.takewhile(lambda now_s: now_s < end_s, times_s)
    )


@pytest.mark.parametrize("kind", FLOODS)
def test_the_rate_of_guesses_is_limited(kind):
    compared = flood(LoginLimiter(), FLOODS[kind](), 0.0, 3600.0)
    assert MAX_ATTEMPTS <= compared <= MAX_ATTEMPTS + 3600 / ATTEMPT_PERIOD_S
    if kind != "new":  # a new password is never sent again, so that it never reaches the first place
        assert compared == pytest.approx(MAX_ATTEMPTS + 3600 / ATTEMPT_PERIOD_S, abs=1)


def login_s(limiter, guesses, period_s):
    """Return the time until the right password is compared during a flood."""
    begin_s = 600.0
    flood(limiter, guesses, 0.0, begin_s)
    now_s = begin_s
    while not limiter.take_turn(CLIENT, NAME, PASSWORD, now_s):
        flood(limiter, guesses, now_s + 0.01, now_s + period_s)
        now_s += period_s
        assert now_s < begin_s + 600.0
    return now_s - begin_s


@pytest.mark.parametrize("period_s", [0.5, 2.0, 10.0])
@pytest.mark.parametrize(("kind", "repeated"), [("new", 1), ("same", 1), ("in turn", 10)])
def test_the_right_password_is_compared_within_a_limited_time_during_a_flood(kind, repeated, period_s):
    limit_s = (repeated + 1) * ATTEMPT_PERIOD_S + PLACE_TIMEOUT_S
    assert 0.0 < login_s(LoginLimiter(), FLOODS[kind](), period_s) <= limit_s + period_s


def test_the_limit_applies_to_every_user_but_to_one_client_only():
    limiter = LoginLimiter()
    flood(limiter, FLOODS["same"](), 0.0, 5.0)
    assert not limiter.take_turn(CLIENT, NAME, PASSWORD, 5.0)
    assert not limiter.take_turn(CLIENT, "another", PASSWORD, 5.0)
    assert limiter.take_turn("10.0.0.2", NAME, PASSWORD, 5.0)
    assert limiter.take_turn(CLIENT, NAME, PASSWORD, 5.0 + MAX_ATTEMPTS * ATTEMPT_PERIOD_S)


def test_attempts_are_counted_before_their_comparison_ends_and_right_ones_are_taken_back():
    limiter = LoginLimiter()
    turns = [limiter.take_turn(CLIENT, NAME, PASSWORD, 0.0) for _ in range(MAX_ATTEMPTS + 1)]
    assert turns == [True] * MAX_ATTEMPTS + [False]
    limiter.take_back(CLIENT)
    assert limiter.take_turn(CLIENT, NAME, PASSWORD, 0.0)
    for _ in range(100):
        limiter.take_back(CLIENT)
        assert limiter.take_turn(CLIENT, NAME, PASSWORD, 0.0)


def test_an_ipv6_network_is_one_client():
    networks = {client_network(f"fd00::{i:x}") for i in range(1, 100)}
    assert networks == {"fd00::/64"}
    assert client_network("fd00:0:0:1::1") != client_network("fd00::1")
    assert client_network("::ffff:10.0.0.1") == client_network("10.0.0.1") == "10.0.0.1"


def test_the_memory_of_clients_and_attempts_is_limited():
    limiter = LoginLimiter()
    for i in range(20_000):
        limiter.take_turn(f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", NAME, "guess", 0.0)
    assert len(limiter._limits) <= MAX_CLIENTS
    flood(limiter, FLOODS["new"](), 0.0, 600.0)
    flood(limiter, FLOODS["same"](), 600.0, 620.0)
    assert {client: len(limit.waiting) for client, limit in limiter._limits.items()} == {CLIENT: 1}
