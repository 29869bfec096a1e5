"""Tests of the end of a hold, of a release and of a closed sensor, over Modbus TCP and over CAN."""

import asyncio
import time
import traceback

import pytest

import pneuforce
from pneuforce.testing import simulated_rig

PRESSURE_KPA = 5.5
SHORT_LEASE_S = 1.0
LONG_LEASE_S = 60.0  #: its renewal is later than the end of each hold of this module
EACH_ORDER = pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["tcp holds", "can holds"])


@pytest.fixture(scope="module")
def rig():
    with simulated_rig() as running:
        yield running


@pytest.fixture
def peers(rig, order):
    urls = (rig.url, rig.can_url)
    rig.wait_for(lambda r: "not_zeroed" not in r["status"])
    with pneuforce.connect(urls[order[0]]) as holder, pneuforce.connect(urls[order[1]]) as other:
        yield holder, other
        (holder if order == (0, 1) else other).clear()  # over Modbus


@EACH_ORDER
def test_the_end_reports_a_vent_of_another_client_that_no_call_has_seen(rig, peers):
    holder, other = peers

    def hold():
        with holder.hold(PRESSURE_KPA, lease_s=LONG_LEASE_S):
            other.vent()
            rig.wait_for(lambda r: r["state"] == "vented")

    with pytest.raises(pneuforce.HoldEnded, match="another client"):
        hold()
    assert rig.read()["active_fault_count"] == 0


@EACH_ORDER
def test_each_read_after_the_end_of_a_hold_raises_a_short_traceback(rig, peers):
    holder, other = peers
    with holder.hold(PRESSURE_KPA, lease_s=SHORT_LEASE_S):
        other.vent()
        time.sleep(SHORT_LEASE_S)  # the thread that renews the lease finds the vent
        lengths = {len(traceback.extract_tb(_error_of(holder.read).__traceback__)) for _ in range(20)}
        assert max(lengths) < 10


def _error_of(call):
    with pytest.raises(pneuforce.HoldEnded) as caught:
        call()
    return caught.value


@EACH_ORDER
def test_the_end_reports_a_trip_that_no_call_has_seen(rig, peers):
    holder, _ = peers

    def hold():
        with holder.hold(PRESSURE_KPA, lease_s=LONG_LEASE_S):
            rig.inject_fault("burst")
            rig.wait_for(lambda r: r["state"] == "tripped", allow_trip=True)

    with pytest.raises(pneuforce.Tripped, match="burst"):
        hold()
    rig.remove_fault("burst")
    rig.wait_for(lambda r: r["pressure"] < 0.3, allow_trip=True)


@EACH_ORDER
def test_a_release_vents_and_is_rejected_while_another_client_has_the_lease(rig, peers):
    holder, other = peers

    def hold():
        with holder.hold(PRESSURE_KPA, lease_s=LONG_LEASE_S):
            with pytest.raises(pneuforce.Rejected) as caught:
                other.release()
            assert caught.value.reason == "lease"
            rig.wait_for(lambda r: r["state"] == "vented")

    with pytest.raises(pneuforce.HoldEnded):
        hold()
    other.release()


@pytest.mark.parametrize("bus", ["url", "can_url"])
def test_a_closed_asynchronous_sensor_raises_the_errors_of_a_closed_sensor(rig, bus):
    async def use_closed():
        async with pneuforce.aio.connect(getattr(rig, bus)) as sensor:
            await sensor.close()
            for call in (sensor.read, sensor.vent, sensor.details, sensor.clear, sensor.release):
                with pytest.raises(pneuforce.SensorClosed):
                    await call()
            with pytest.raises(pneuforce.SensorClosed):
                await anext(sensor.stream())
            await sensor.close()

    asyncio.run(use_closed())


def test_details_over_can_are_not_shown_after_the_end_of_the_instrument(rig):
    """This test is the last, because it kills the instrument of this module."""
    with pneuforce.connect(rig.can_url) as sensor:
        assert sensor.details().map_hash is not None
        rig.kill_instrument()
        time.sleep(1.5)  # longer than the silence after which the connection is lost
        with pytest.raises(pneuforce.ConnectionLost):
            sensor.details()
