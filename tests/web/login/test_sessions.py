"""Tests of the sessions of users in virtual time."""

from dataclasses import replace

import pytest

from pneuforce.web.login.sessions import MAX_SESSIONS_PER_USER, WebSessions
from tests.web.users import OPERATOR, USERS, VIEWER, with_password

IDLE_S, MAX_S = 600.0, 3600.0
ADDRESS = "10.0.0.5"


def begun(name=OPERATOR, now_s=0.0):
    sessions = WebSessions(IDLE_S, MAX_S)
    return sessions, sessions.begin(USERS[name], ADDRESS, now_s)


def test_a_session_ends_after_a_time_without_input_and_after_its_longest_time():
    sessions, key = begun()
    assert sessions.find(key, USERS, IDLE_S).user == USERS[OPERATOR]
    assert sessions.find(key, USERS, IDLE_S + 1) is None
    for now_s in range(0, int(MAX_S) + 1, 300):
        sessions.find(key, USERS, now_s).active_s = now_s
    assert sessions.remove_old(USERS, MAX_S) == []
    ((session, why),) = sessions.remove_old(USERS, MAX_S + 1)
    assert (session.user.name, session.address, why) == (OPERATOR, ADDRESS, "expired")
    assert sessions.remove_old(USERS, MAX_S + 1) == []


@pytest.mark.parametrize(
    "users",
    [
        {},
        {VIEWER: USERS[VIEWER]},
        with_password(OPERATOR, "another-password"),
        USERS | {OPERATOR: replace(USERS[OPERATOR], role="viewer")},
    ],
    ids=["none", "removed", "password", "role"],
)
def test_a_session_ends_when_its_user_is_removed_or_changed(users):
    sessions, key = begun()
    assert sessions.find(key, users, 1.0) is None
    assert [why for _, why in sessions.remove_old(users, 1.0)] == ["user_changed"]
    assert sessions.find(key, USERS, 1.0) is None


def test_keys_are_random_and_unknown_keys_belong_to_nobody():
    sessions, key = begun()
    another = sessions.begin(USERS[OPERATOR], ADDRESS, 0.0)
    assert len({key, another}) == 2
    assert len(key) >= 43  # 256 bits
    assert [sessions.find(each, USERS, 0.0) for each in ("", "x" * 43, key[:-1])] == [None] * 3
    assert sessions.end(key).user.name == OPERATOR
    assert sessions.end(key) is None


def test_further_logins_of_a_user_end_the_oldest_sessions_of_this_user_only():
    sessions, operator = begun()
    keys = [sessions.begin(USERS[VIEWER], ADDRESS, 1.0) for _ in range(MAX_SESSIONS_PER_USER + 2)]
    assert [why for _, why in sessions.remove_old(USERS, 1.0)] == ["too_many_sessions"] * 2
    assert [sessions.find(key, USERS, 1.0) is not None for key in keys] == [False] * 2 + [True] * (
        len(keys) - 2
    )
    assert sessions.find(operator, USERS, 1.0)
