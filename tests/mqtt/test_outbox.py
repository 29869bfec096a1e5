"""Tests of store and forward: values reach the broker in order, or wait in the file."""

import sqlite3
import subprocess
import sys

import pytest

from pneuforce.mqtt.change_filter import ChangeFilter
from pneuforce.mqtt.outbox import BATCH_RECORDS, Outbox
from pneuforce.mqtt.session import EdgeSession
from pneuforce.mqtt.store import DeliveryStore
from tests.mqtt.sparkplug import decoded, summary
from tests.mqtt.test_session import TOPICS, values


class Edge:
    """Outbox whose messages a broker receives. The number of contacts identifies each value."""

    def __init__(self, path, max_bytes=1e8, max_age_s=1e6):
        self.warnings = []
        self.store = DeliveryStore(str(path), max_bytes, max_age_s, self.warnings.append)
        self.outbox = Outbox(ChangeFilter(1.0, {}), self.store)
        self.received, self.number = [], 0

    def connect(self):
        self.outbox.session = EdgeSession(TOPICS, 0)
        self.outbox.birth(self.number)

    def measure(self, count=1):
        for _ in range(count):
            self.number += 1
            self.outbox.on_values(values(contact_counter=self.number), self.number, self.number)

    def deliver(self, confirm=True):
        self.received += self.outbox.messages
        self.outbox.messages.clear()
        if confirm:
            self.outbox.confirmed(self.outbox.unconfirmed_values)

    def forward(self):
        while self.store.count:
            self.outbox.add_stored(self.number)
            self.deliver()

    def contacts(self, historical):
        """Return the numbers of contacts in received data messages."""
        metrics = [
            m for each in self.received if "DDATA" in each.topic for m in decoded(each.payload)[0].metrics
        ]
        return [
            m.long_value for m in metrics if m.name == "contact_counter" and m.is_historical == historical
        ]


@pytest.fixture
def edge(tmp_path):
    edge = Edge(tmp_path / "store.sqlite")
    yield edge
    edge.store.close()


def test_values_of_an_interruption_are_delivered_in_order_and_flagged_as_historical(edge):
    edge.connect()
    edge.measure(3)
    edge.deliver()
    edge.outbox.disconnected()
    edge.measure(2 * BATCH_RECORDS)
    edge.connect()
    edge.measure()
    edge.deliver()
    edge.forward()
    last = 3 + 2 * BATCH_RECORDS
    assert edge.contacts(historical=False) == [2, 3, last + 1]
    assert edge.contacts(historical=True) == list(range(4, last + 1))
    assert edge.store.lost == 0
    assert edge.warnings == []


def test_unconfirmed_values_are_delivered_again(edge):
    edge.measure()
    edge.connect()
    edge.deliver()
    edge.measure(5)
    edge.deliver(confirm=False)  # received by a broker that was killed before it could publish the values
    edge.measure(5)
    edge.outbox.disconnected()
    edge.received.clear()
    edge.connect()
    edge.deliver()
    edge.forward()
    assert edge.contacts(historical=True) == list(range(1, 12))


def test_stored_values_stay_until_the_broker_has_confirmed_them(edge):
    edge.measure(3)
    edge.connect()
    edge.outbox.add_stored(9)
    edge.outbox.disconnected()
    assert len(edge.store.oldest(10)) == 4  # and the values of the birth
    edge.connect()
    edge.forward()
    assert edge.store.oldest(10) == []


def test_stored_values_survive_the_process(edge):
    edge.measure(3)
    edge.store.close()
    again = Edge(edge.store.path)
    assert again.store.count == 3
    assert [again.store.next_birth_number(256) for _ in range(2)] == [0, 1]
    again.store.close()
    assert Edge(edge.store.path).store.next_birth_number(256) == 2


def test_the_birth_number_wraps_to_0(edge):
    assert [edge.store.next_birth_number(3) for _ in range(5)] == [0, 1, 2, 0, 1]


def test_the_loss_of_the_instrument_is_stored_without_values(edge):
    edge.measure()
    edge.outbox.on_instrument_lost(2)
    edge.outbox.on_instrument_lost(3)
    records = edge.store.oldest(10)
    assert len(records) == 2
    found = decoded(records[1].metrics)[1]
    assert (found["force"], found["force_valid"], found["state"]) == (None, False, None)


def test_the_device_dies_with_the_instrument_and_is_born_again(edge):
    edge.measure()
    edge.connect()
    edge.outbox.on_instrument_lost(2)
    edge.measure()
    assert [name for name, _ in summary(edge.outbox.messages)] == ["NBIRTH", "DBIRTH", "DDEATH", "DBIRTH"]


def test_stored_values_wait_for_the_birth_of_the_device(edge):
    edge.measure()
    edge.outbox.on_instrument_lost(2)
    edge.connect()
    edge.outbox.add_stored(3)
    assert [name for name, _ in summary(edge.outbox.messages)] == ["NBIRTH"]


def test_a_full_store_deletes_the_oldest_values(tmp_path):
    edge = Edge(tmp_path / "store.sqlite", max_bytes=100_000)
    edge.measure(5000)
    numbers = [decoded(r.metrics)[1]["contact_counter"] for r in edge.store.oldest(10_000)]
    assert numbers == list(range(numbers[0], 5001))
    assert numbers[0] > 1000
    assert edge.store.count == len(numbers) == 5000 - edge.store.lost
    assert (tmp_path / "store.sqlite").stat().st_size < 150_000
    assert "deleted" in edge.warnings[0]
    edge.store.close()


def test_values_that_are_too_old_are_deleted(tmp_path):
    edge = Edge(tmp_path / "store.sqlite", max_age_s=0.1)
    edge.measure(1000)  # 1 ms apart
    assert len(edge.store.oldest(10_000)) == 1000 - edge.store.lost <= 100 + 64
    edge.store.close()


@pytest.mark.parametrize(
    "content", [b"no database" * 500, b"SQLite format 3\0" + bytes(4080)], ids=("text", "zeros")
)
def test_a_damaged_file_is_renamed_and_replaced(tmp_path, content):
    path = tmp_path / "store.sqlite"
    path.write_bytes(content)
    edge = Edge(path)
    edge.measure(3)
    assert edge.store.count == len(edge.store.oldest(10)) == 3
    assert (tmp_path / "store.sqlite.damaged").read_bytes() == content
    assert len(edge.warnings) == 1
    edge.store.close()


def test_a_file_that_is_damaged_while_it_is_open_is_replaced(edge, tmp_path):
    edge.measure(2000)
    edge.store.close()
    with (tmp_path / "store.sqlite").open("r+b") as file:
        file.seek(4096)
        file.write(b"\xa5" * 60_000)
    edge.measure(1000)
    edge.store.oldest(10_000)
    assert any("damaged" in sentence for sentence in edge.warnings)
    edge.measure(3)
    assert [decoded(r.metrics)[1]["contact_counter"] for r in edge.store.oldest(10_000)][-1] == 3003


def test_the_file_of_another_program_is_not_changed(tmp_path):
    path = tmp_path / "other.sqlite"
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE other (a)")
    db.close()
    before = path.read_bytes()
    edge = Edge(path)
    edge.measure(3)
    assert path.read_bytes() == before
    assert "another program" in edge.warnings[0]


def test_a_missing_folder_loses_values_with_a_sentence(tmp_path):
    edge = Edge(tmp_path / "absent" / "store.sqlite")
    edge.measure(3)
    assert "lost" in edge.warnings[0]
    (tmp_path / "absent").mkdir()
    edge.measure(2)
    assert (edge.store.count, edge.store.lost) == (2, 3)
    edge.store.close()


FULL_DISK = """
import resource, signal, sys
from tests.mqtt.test_outbox import Edge
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
edge = Edge(sys.argv[1])
edge.measure(50)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
edge.measure(5000)
stored = edge.store.count
assert 50 < stored < 5000, stored
assert "cannot be used" in edge.warnings[0], edge.warnings
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
edge.measure(100)
assert edge.store.count == stored + 100 == len(edge.store.oldest(10_000))
"""


def test_a_full_disk_loses_only_new_values(tmp_path):
    words = [sys.executable, "-c", FULL_DISK, str(tmp_path / "store.sqlite")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
