"""Tests of the read routes of the web server, with real sockets and a fake instrument."""

import contextlib
import gzip
import json
import socket
import time
from xml.etree import ElementTree

import pytest

from pneuforce.registers.advice import STATUS_ADVICE
from pneuforce.registers.can.frames import FORCE, encode
from pneuforce.registers.map import BLOCKS, REGISTERS
from pneuforce.registers.modbus.register_bank import RegisterBank
from tests.system.waiting import wait_for
from tests.web.entries import header, health, real_snapshot, sample, snapshot
from tests.web.serving import send_until_received, until


def test_the_web_server_subscribes_to_the_stream_for_web_pages(site, instrument):
    assert instrument.subscriptions == [{"want": "web"}]


def test_about_describes_the_instrument_and_its_codes(site):
    status, _, info = site.get("/api/about")
    assert status == 200
    assert (info["version"], info["replay"]) == ("1.2", "")
    assert {r["name"] for r in info["registers"]} == {r.name for r in REGISTERS}
    assert info["faults"]["5"]["name"] == "burst"
    assert all(fault.keys() == {"name", "title", "meaning", "action"} for fault in info["faults"].values())
    assert info["status"]["burst"]["bit"] == 13


def test_what_a_browser_loads_once_is_compressed(site):
    for path in ("/", "/static/main.js", "/static/vendor/uPlot.esm.js", "/api/about"):
        plain = site.request("GET", path, **{"Accept-Encoding": "identity"})[2]
        with contextlib.closing(site.connect()) as connection:
            connection.request("GET", path, headers={"Accept-Encoding": "gzip"})
            answer = connection.getresponse()
            assert answer.headers["content-encoding"] == "gzip"
            packed = answer.read()
        text = gzip.decompress(packed)
        assert (json.loads(text) if path == "/api/about" else text) == plain
        assert len(packed) < len(text) / 2


def test_about_names_the_file_of_a_replay(site, instrument):
    instrument.send(header(replay="tuesday.recording"))
    wait_for(lambda: site.get("/api/about")[2]["replay"], lambda name: name == "tuesday.recording")


def test_prometheus_gets_the_metrics_without_a_login_in_the_format_that_it_requests(site, instrument):
    send_until_received(instrument, site, {"state": "holding"})
    instrument.send(health(time.monotonic(), started_utc_s=1.8e9))

    def scrape():
        return site.get("/metrics", Accept="application/openmetrics-text;version=1.0.0")

    status, headers, text = wait_for(scrape, lambda answer: b"pneuforce_instrument_up 1.0" in answer[2])
    assert status == 200
    assert headers["content-type"].startswith("application/openmetrics-text; version=1.0.0")
    assert b'pneuforce_state{state="holding"} 1.0' in text
    _, headers, text = site.get("/metrics")
    assert headers["content-type"].startswith("text/plain; version=0.0.4")
    assert b"pneuforce_start_time_seconds 1.8e+09" in text
    assert site.request("HEAD", "/metrics")[0] == 200
    assert site.post("/metrics", {})[0] == 405


@pytest.mark.parametrize(
    ("bits", "status", "words"),
    [
        (["vented", "maintenance_required"], 200, ""),
        (["stale", "link_lost"], 503, STATUS_ADVICE["link_lost"].what),
        (["sensor_fault"], 503, STATUS_ADVICE["sensor_fault"].what),
        (["stale"], 503, STATUS_ADVICE["stale"].what),
    ],
)
def test_health_needs_no_login_and_states_whether_the_instrument_measures(
    site, instrument, bits, status, words
):
    send_until_received(instrument, site, {"status": bits})
    answer = site.get("/health")
    assert (answer[0], answer[2]) == (status, {"ok": status == 200, "problem": words})


def test_health_is_503_while_no_value_has_arrived(site):
    status, _, answer = site.get("/health")
    assert (status, answer["ok"]) == (503, False)
    assert answer["problem"]


def test_a_new_browser_gets_the_current_state_at_once(site, instrument):
    send_until_received(instrument, site, {"state": "holding"})
    with site.event_stream() as stream:
        assert [name for name, _ in (next(stream) for _ in range(3))] == ["link", "state", "contacts"]


def test_register_words_are_those_of_a_modbus_answer(site, instrument):
    real, plain = real_snapshot()
    send_until_received(instrument, site, plain)
    _, _, answer = site.get("/api/registers")
    for (first, last), block in zip(BLOCKS, answer["blocks"], strict=True):
        words = RegisterBank().reader(first, last - first + 1)(real)
        assert block["address"] == first
        assert b"".join(word.to_bytes(2, "big") for word in block["words"]) == words


def test_can_frames_are_decoded_and_invalid_frames_have_no_values(site, instrument):
    real, plain = real_snapshot()
    data = encode(FORCE, real, counter=3).hex(" ")
    frames = [
        {"id": 0x185, "name": name, "data": data_, "count": 1, "age_s": 0.0, "out": True}
        for name, data_ in [("Force", data), ("Force", "00"), ("", data), ("State", "zz")]
    ]
    send_until_received(instrument, site, plain)
    instrument.send(health(time.monotonic(), can={"frames": frames}))
    wait_for(lambda: site.services.feed.health, bool)
    send_until_received(instrument, site, plain)
    _, _, answer = site.get("/api/frames")
    assert answer["frames"][0]["values"]["counter"] == 3
    assert answer["frames"][0]["values"]["pressure"] == pytest.approx(8.0, abs=0.1)
    assert [frame["values"] for frame in answer["frames"][1:]] == [{}, {}, {}]


PAGES = ["/netftapi2.xml", "/netftcalapi.xml"]


@pytest.mark.parametrize("path", PAGES)
def test_the_pages_of_ati_sensors_exist_only_while_rdt_is_enabled(site, instrument, path):
    for enabled, status in ((False, 404), (True, 200), (False, 404)):
        instrument.send(header(configuration={"rdt": {"enabled": enabled}}))
        wait_for(lambda: site.get(path)[0], lambda received, wanted=status: received == wanted)


def test_the_pages_of_ati_sensors_contain_scale_and_units(site, instrument):
    instrument.send(header(configuration={"rdt": {"enabled": True}}))
    wait_for(lambda: site.get(PAGES[0])[0], lambda status: status == 200)
    settings, calibration = (ElementTree.fromstring(site.get(path)[2]) for path in PAGES)
    assert (settings.tag, calibration.tag) == ("netft", "netftCalibration")  # for ros2_net_ft_driver
    names = ("cfgcpf", "cfgcpt", "scfgfu", "scfgtu", "comrdtrate")
    assert [settings.findtext(name) for name in names] == ["1000000", "1000000", "N", "N-m", "500"]
    assert "simulated" in settings.findtext("prodname")
    names = ("calcpf", "calcpt", "scalfu", "scaltu", "calsn")
    assert [calibration.findtext(name) for name in names] == ["1000000", "1000000", "N", "N-m", "7"]


@pytest.mark.parametrize("path", ["/api/registers", "/api/frames"])
def test_without_values_of_the_instrument_the_status_is_503(site, path):
    status, _, answer = site.get(path)
    assert status == 503
    assert answer["text"].endswith(".")


def test_the_stream_reports_a_lost_instrument_and_its_return(site, instrument):
    with site.event_stream() as stream:
        until(stream, "link")
        send_until_received(instrument, site, {"state": "holding"})
        assert until(stream, "link", lambda link: link["up"])["reason"] == ""
        instrument.close()
        assert until(stream, "link")["up"] is False
        assert site.get("/api/registers")[0] == 503
        instrument.open()
        wait_for(lambda: instrument.subscriptions, lambda subscriptions: len(subscriptions) == 2)
        instrument.send(header())
        send_until_received(instrument, site, {"state": "vented"})
        assert until(stream, "link")["up"] is True
        assert until(stream, "state")["state"] == "vented"


def test_after_an_invalid_entry_the_web_server_connects_again(site, instrument):
    instrument.clients[-1].sendall(b"\xff" * 100)
    wait_for(lambda: instrument.subscriptions, lambda subscriptions: len(subscriptions) == 2)
    assert "version" in site.services.feed.down_reason


def test_the_stream_of_the_instrument_is_read_even_if_a_browser_does_not_read(site, instrument):
    """The host process disconnects clients that lag by 8 MB. A slow browser must not delay the web server."""
    with contextlib.closing(socket.create_connection(("127.0.0.1", site.port))) as slow:
        slow.sendall(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        for second in range(20):
            instrument.send(*(sample(second + i / 500) for i in range(500)))
        instrument.send(snapshot(time.monotonic()))
        wait_for(lambda: site.services.feed.snapshot, lambda received: received is not None)
