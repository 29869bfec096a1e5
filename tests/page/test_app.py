"""What the page shows, over real sockets, of an instrument that the tests speak for."""

import contextlib
import socket
import time

import pytest

from registers.can.frames import FORCE, encode
from registers.map import BLOCKS, REGISTERS
from registers.modbus.bank import Bank
from tests.page.entries import begin, health, measured, real_snapshot, snapshot
from tests.page.serving import say_again, until
from tests.system.waiting import wait_for


def test_it_wants_to_be_a_page(site, station):
    assert station.wanted == [{"want": "page"}]


def test_it_says_what_it_is_about(site):
    status, _, about = site.get("/api/about")
    assert status == 200
    assert (about["version"], about["replay"]) == ("1.2", "")
    assert about["writable"] is True
    assert {r["name"] for r in about["registers"]} == {r.name for r in REGISTERS}
    assert about["faults"]["5"]["name"] == "burst"
    assert all(about["faults"][code].keys() == {"name", "what", "do"} for code in about["faults"])
    assert about["status"]["burst"]["bit"] == 13


def test_a_replay_is_said_to_be_one(site, station):
    station.say(begin(replay="tuesday.pfr"))
    wait_for(lambda: site.get("/api/about")[2]["replay"], lambda name: name == "tuesday.pfr")


def test_a_browser_that_connects_knows_at_once_what_there_is(site, station):
    say_again(station, site, {"state": "holding"})
    with site.live() as stream:
        assert [name for name, _ in (next(stream) for _ in range(3))] == ["link", "state", "contacts"]


def test_the_words_are_those_that_modbus_would_answer(site, station):
    shown, plain = real_snapshot()
    say_again(station, site, plain)
    _, _, answer = site.get("/api/registers")
    for (first, last), block in zip(BLOCKS, answer["blocks"], strict=True):
        words = Bank().reader(first, last - first + 1)(shown)
        assert block["address"] == first
        assert b"".join(word.to_bytes(2, "big") for word in block["words"]) == words


def test_frames_have_their_values_by_name_and_nonsense_has_none(site, station):
    shown, plain = real_snapshot()
    data = encode(FORCE, shown, counter=3).hex(" ")
    seen = [
        {"id": 0x185, "name": name, "data": data_, "count": 1, "age_s": 0.0, "out": True}
        for name, data_ in [("Force", data), ("Force", "00"), ("", data), ("State", "zz")]
    ]
    say_again(station, site, plain)
    station.say(health(time.monotonic(), can={"frames": seen}))
    wait_for(lambda: site.parts.view.health, bool)
    say_again(station, site, plain)
    _, _, answer = site.get("/api/frames")
    assert answer["frames"][0]["values"]["counter"] == 3
    assert answer["frames"][0]["values"]["pressure"] == pytest.approx(8.0, abs=0.1)
    assert [frame["values"] for frame in answer["frames"][1:]] == [{}, {}, {}]


@pytest.mark.parametrize("path", ["/api/registers", "/api/frames"])
def test_without_an_instrument_there_are_no_numbers(site, path):
    status, _, answer = site.get(path)
    assert status == 503
    assert answer["text"].endswith(".")


def test_an_instrument_that_goes_is_told_and_comes_back(site, station):
    with site.live() as stream:
        until(stream, "link")
        say_again(station, site, {"state": "holding"})
        assert until(stream, "link", lambda link: link["up"])["why"] == ""
        station.close()
        assert until(stream, "link")["up"] is False
        assert site.get("/api/registers")[0] == 503
        station.open()
        wait_for(lambda: station.wanted, lambda wanted: len(wanted) == 2)
        station.say(begin())
        say_again(station, site, {"state": "vented"})
        assert until(stream, "link")["up"] is True
        assert until(stream, "state")["state"] == "vented"


def test_an_instrument_that_speaks_nonsense_is_left_and_tried_again(site, station):
    station.guests[-1].sendall(b"\xff" * 100)
    wait_for(lambda: station.wanted, lambda wanted: len(wanted) == 2)
    assert "another version" in site.parts.view.why


def test_thousands_of_samples_a_second_are_read_while_browsers_do_not(site, station):
    """The host cuts off who is 8 MB behind: the page must read on, whatever its browsers do."""
    with contextlib.closing(socket.create_connection(("127.0.0.1", site.port))) as slow:
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        for second in range(20):
            station.say(*(measured(second + i / 500) for i in range(500)))
        now_s = time.monotonic()
        station.say(snapshot(now_s))
        wait_for(lambda: site.parts.view.snapshot, lambda known: known is not None)
