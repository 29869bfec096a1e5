"""Tests that user and password of a URL are in no message."""

import pytest

from pneuforce.client.address import parse_url
from pneuforce.errors import PneuforceError
from pneuforce.instrument.cli.log.prometheus_query import stored_heads
from pneuforce.instrument.config import parse
from pneuforce.support.serial_port import SerialPort
from pneuforce.support.user_part import without_user


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("mqtt://bob:secret@127.0.0.1:1883", "mqtt://…@127.0.0.1:1883"),
        ("mqtt://bob:sec/r@e#t@[fd00::1]", "mqtt://…@[fd00::1]"),
        ("'bob:secret@host'", "'…@host'"),
        ("mqtt://host:1883/a", "mqtt://host:1883/a"),
    ],
)
def test_only_the_user_part_is_removed(url, shown):
    assert without_user(url) == shown


def configured(section, key):
    """Return a function that reads a configuration in which this key has the value."""
    return lambda url: parse({section: {key: url}}, "instrument.toml")


READERS = {
    "mqtt.broker": configured("mqtt", "broker"),
    "mqtt.broker without a scheme": lambda url: configured("mqtt", "broker")(url.partition("://")[2]),
    "rig.port": configured("rig", "port"),
    "modbus.host": configured("modbus", "host"),
    "can.host": configured("can", "host"),
    "unknown section": lambda url: parse({"broker": url}, "instrument.toml"),
    "wrong type": lambda url: parse({"mqtt": {"broker": [url]}}, "instrument.toml"),
    "connect": parse_url,
    "--witness": lambda url: stored_heads(url, None),
    "rig link": SerialPort,
}
URLS = [
    *(f"{scheme}://bob:secret@127.0.0.1:1" for scheme in ("mqtt", "mqtts", "socket", "tcp", "tls", "http")),
    "tls://bob:secret@host?ca=a&certificate=b&key=c",
    "tcp://[bob:secret@host]:1",
    "tcp://bob:secret@ho℀st",
    "mqtt://bob:" + "x" * 300 + "secret@127.0.0.1",
    "mqtt://bob:sec:ret@secret@host",
]


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
@pytest.mark.parametrize("url", URLS, ids=range(len(URLS)))
def test_no_message_contains_user_or_password(read, url):
    with pytest.raises(PneuforceError) as caught:
        read(url)
    assert not [part for part in ("bob", "secret") if part in str(caught.value)]
