"""Tests of the observer: event rates, old values, and lost connections."""

import socket
import time
from threading import Event, Thread

from pneuforce.registers.can.bus import CanAddress
from pneuforce.teststand.observer import CanNodeAddress, EventRate, ObservedValues, Observer
from pneuforce.teststand.stack import free_port


def test_a_rate_can_be_read_while_another_thread_counts():
    rate, stop = EventRate(), Event()

    def count():
        while not stop.is_set():
            rate.add(time.monotonic())

    counting = Thread(target=count)
    counting.start()
    try:
        until_s = time.monotonic() + 0.5
        while time.monotonic() < until_s:
            assert rate.per_s(time.monotonic()) <= 2000
    finally:
        stop.set()
        counting.join()


def test_a_rate_counts_the_last_second():
    rate = EventRate()
    for number in range(30):
        rate.add(number / 10)
    assert (rate.per_s(2.9), rate.count) == (10, 30)


def test_the_values_of_a_silent_source_are_removed():
    values = ObservedValues(modbus={"force": 1.0}, can={"force": 1.1})
    values.polls.add(10.0)
    values.frames.add(9.9)
    values.forget_old(10.45)
    assert (values.modbus, values.can) == ({"force": 1.0}, {})
    values.forget_old(10.55)
    assert values.modbus == {}


def test_a_lost_can_connection_is_opened_again():
    with socket.create_server(("127.0.0.1", 0)) as hub:
        hub.settimeout(5.0)
        node = CanNodeAddress(CanAddress(interface="socketcand", port=hub.getsockname()[1]))
        observer = Observer(free_port(), node, free_port())
        observer.start()
        try:
            for _ in range(2):
                with hub.accept()[0] as link:
                    link.sendall(b"< hi >< ok >< ok >")
        finally:
            observer.stop()
