"""Tests of the addresses of browsers: writes, leases and failed logins in the event log and the journal."""

import asyncio
import logging
import time

import pytest

from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, json_entry
from pneuforce.support.throttle import MAX_LINES
from tests.instrument.audit.event_log_files import MemorySink
from tests.instrument.service.local_socket.test_server import TIMEOUT_S, Client, serving, until

LAPTOP, TABLET = "10.0.0.5", "10.0.0.6"


def run_with_web_process(folder, use, subscription="web"):
    """Run a local server and `await use(server, client)`. Return the records of the event log."""
    sink = MemorySink()

    async def run():
        async with serving(folder, sink) as (server, _):
            web = await Client.connect(folder, subscription)
            await until(lambda: server.broadcaster.subscribers)
            ticking = asyncio.create_task(tick(server))
            await use(server, web)
            ticking.cancel()
            server.source.end("end of the test", time.monotonic())
            web.close()

    asyncio.run(run())
    return sink


async def tick(server):
    """Call the server periodically, as the host does."""
    while True:
        server.tick(time.monotonic())
        await asyncio.sleep(0.01)


async def write(web, address, **values):
    """Return the reject reason of a write request."""
    request = {"id": 1, "address": address, "values": values, "seen_s": time.monotonic()}
    web.send(json_entry(EntryKind.REQUEST, 0.0, request))
    return (await web.receive(EntryKind.ANSWER)).json_body["reject_reason"]


def test_a_write_from_the_page_is_logged_with_the_address_of_the_browser(tmp_path):
    async def use(_, web):
        await write(web, LAPTOP, mode="vent")
        await write(web, TABLET, force_limit=3.0)

    records = run_with_web_process(tmp_path, use).of_kind("write")
    assert [record["who"] for record in records] == [f"web {LAPTOP}", f"web {TABLET}"]


def test_browsers_at_two_addresses_are_two_peers(tmp_path):
    async def use(server, web):
        assert await write(web, LAPTOP, lease=5000) == "none"
        assert server.session.instrument.lease.holder == ("web", LAPTOP)
        assert await write(web, TABLET, force_limit=3.0) == "lease"
        assert await write(web, TABLET, lease=0) == "lease"
        assert await write(web, LAPTOP, force_limit=2.0) == "none"
        assert await write(web, TABLET, mode="vent") == "none"

    run_with_web_process(tmp_path, use)


def test_the_page_shows_the_reject_reason_of_the_last_write(tmp_path):
    async def use(_, web):
        reason = await write(web, LAPTOP, mode="hold")  # there is no setpoint
        reasons = [(await web.receive(EntryKind.SNAPSHOT)).json_body["reject_reason"] for _ in range(2)]
        assert reasons[-1] == reason != "none"

    run_with_web_process(tmp_path, use)


def report(address, result="wrong_password", times=1, kind="login", user=""):
    """Return an entry about logins."""
    facts = {"kind": kind, "address": address, "result": result, "times": times, "user": user}
    return json_entry(EntryKind.LOGIN, 0.0, facts)


def test_each_login_logout_and_write_is_logged_with_user_and_address(tmp_path, caplog):
    async def use(_, web):
        for _ in range(2):
            web.send(report(f"anna@{LAPTOP}", "accepted"))
            await write(web, f"anna@{LAPTOP}", force_limit=3.0)
            web.send(report(f"anna@{LAPTOP}", "requested", kind="logout"))
        web.send(report(LAPTOP, user="eve"))
        await write(web, LAPTOP, mode="vent")  # the answer follows all entries

    with caplog.at_level(logging.WARNING, "pneuforce"):
        sink = run_with_web_process(tmp_path, use)
    assert f"login from {LAPTOP} failed 1 time: wrong password" in caplog.text
    who = f"web anna@{LAPTOP}"
    assert sink.of_kind("logout") == [{"kind": "logout", "who": who, "result": "requested"}] * 2
    accepted = {"kind": "login", "who": who, "result": "accepted"}
    failed = {"kind": "login", "who": f"web {LAPTOP}", "result": "wrong_password", "user": "eve"}
    assert sink.of_kind("login") == [accepted, accepted, failed]
    assert [record["who"] for record in sink.of_kind("write")] == [who, f"web {LAPTOP}"]
    assert {record["who"] for record in sink.of_kind("repeated")} == {who}


def test_a_flood_of_logins_of_a_user_is_limited_and_counted(tmp_path):
    async def use(_, web):
        for _ in range(500):
            web.send(report(f"anna@{LAPTOP}", "accepted"))
        await write(web, LAPTOP, mode="vent")

    sink = run_with_web_process(tmp_path, use)
    logged = len(sink.of_kind("login"))
    assert 200 <= logged < 300
    assert [record["times"] for record in sink.of_kind("held_back")] == [500 - logged]


def test_a_flood_of_failed_logins_is_one_record_for_each_reason_and_counts(tmp_path, caplog):
    async def use(_, web):
        for _ in range(50):
            web.send(report(LAPTOP, "wrong_password", 1))
            web.send(report(LAPTOP, "too_many_attempts", 20))
        web.send(report(TABLET, "wrong_password", 3))
        await write(web, LAPTOP, mode="vent")  # the answer follows all entries

    with caplog.at_level(logging.WARNING, "pneuforce"):
        sink = run_with_web_process(tmp_path, use)
    assert sink.of_kind("login") == [
        {"kind": "login", "who": f"web {LAPTOP}", "result": "wrong_password"},
        {"kind": "login", "who": f"web {LAPTOP}", "result": "too_many_attempts"},
        {"kind": "login", "who": f"web {TABLET}", "result": "wrong_password"},
    ]
    counted = {(r["who"], r["of"]["result"]): r["times"] for r in sink.of_kind("repeated")}
    assert counted == {
        (f"web {LAPTOP}", "wrong_password"): 49,
        (f"web {LAPTOP}", "too_many_attempts"): 999,
        (f"web {TABLET}", "wrong_password"): 2,
    }
    lines = [line for line in caplog.messages if LAPTOP in line]
    assert 1 <= len(lines) <= MAX_LINES


@pytest.mark.parametrize(
    "entry",
    [
        report("x" * 81),
        report("a\nb"),
        report(None),
        report(LAPTOP, "x" * 81),
        report(LAPTOP, user="x" * 81),
        report(LAPTOP, user="a\nb"),
        report(LAPTOP, kind="write"),
        report(LAPTOP, times=0),
        report(LAPTOP, times=10**10),
        report(LAPTOP, times="1"),
        StreamEntry(EntryKind.LOGIN, 0.0, b"[]"),
        json_entry(EntryKind.REQUEST, 0.0, {"id": 1, "address": 7, "values": {"mode": "vent"}}),
    ],
)
def test_an_invalid_address_or_count_disconnects_the_client(tmp_path, entry):
    async def run():
        async with serving(tmp_path) as (server, _):
            web = await Client.connect(tmp_path, "web")
            await until(lambda: server.broadcaster.subscribers)
            web.send(entry)
            async with asyncio.timeout(TIMEOUT_S):
                await until(lambda: not server.clients)

    asyncio.run(run())


def test_a_client_for_mqtt_can_only_vent(tmp_path):
    async def use(server, mqtt):
        assert await write(mqtt, "broker", force_limit=3.0) == "malformed"
        assert await write(mqtt, "broker", mode="hold") == "malformed"
        assert await write(mqtt, "broker", mode="vent", force_limit=3.0) == "malformed"
        assert await write(mqtt, "broker", mode="vent") == "none"
        assert server.source.snapshot(("mqtt", ""), time.monotonic()).force_limit_n != 3.0

    records = run_with_web_process(tmp_path, use, "mqtt").of_kind("write")
    assert {record["who"] for record in records} == {"mqtt broker"}
    assert [record["result"] for record in records][-1] == "accepted"
