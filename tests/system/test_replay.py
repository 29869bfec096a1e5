"""A recording of the real thing, over a line that is disturbed, goes through the program once more."""

import json
import shutil
import socket
import sqlite3
import struct
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from urllib.request import urlopen

import can
import pytest

from instrument.played import MARKS
from instrument.tape.checkpoint import thaw
from instrument.tape.entry import Decoder, Kind, encode, told
from instrument.tape.opening import opened
from instrument.tape.schema import checksum
from registers.modbus.client import Plc, PlcError
from tests.instrument.tape.virtual_host import eventful, write
from tests.system.waiting import wait_for
from tests.typed import pneuforce
from teststand.children import Child
from teststand.stack import free_port, start, toml


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Begun in the middle of a contact, in virtual time: a busy machine changes nothing of it."""
    file = tmp_path_factory.mktemp("tape") / "press.tape"
    write(eventful()[1], file)
    return file


@pytest.fixture
def copy(recording, tmp_path):
    """One that may be spoiled."""
    return shutil.copy(recording, tmp_path / "copy.tape")


def verdict_of(file):
    done = pneuforce("replay", file, "--json")
    return done.returncode, json.loads(done.stdout)


# ---- verified


def test_the_real_thing_is_the_same_again_to_the_last_bit(tmp_path):
    """Over a line that is disturbed, and however it goes on a machine that may be busy."""
    file = tmp_path / "real.tape"
    with ExitStack() as children:
        parts = start(children, tmp_path / "rig", line_seed=7)
        plc = children.enter_context(Plc.connect(port=parts.modbus_port))
        for _ in range(100):
            with suppress(PlcError):
                plc.write("mode", "vent")
                plc.write("setpoint_requested", 5.0)
                plc.write("mode", "hold")
                break
            time.sleep(0.05)
        line = str(tmp_path / "pneuforce.sock")
        recorder = children.enter_context(
            Child("recorder", ["instrument", "record", str(file), "--socket", line])
        )
        parts.line.noise.bursts = 1e-3
        wait_for(lambda: samples_in(file), lambda samples: samples > 1000)
        plc.write("lease", 0.2)
        wait_for(lambda: samples_in(file), lambda samples: samples > 1500)
        parts.host.stop()
        wait_for(lambda: recorder.running, lambda runs: not runs)
    code, verdict = verdict_of(file)
    assert (code, verdict["equal"], verdict["difference"], verdict["remark"]) == (0, True, None, "")
    assert verdict["samples"] == samples_in(file) > 1500
    assert verdict["duration_s"] > 2


def samples_in(file):
    with suppress(sqlite3.OperationalError), closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as db:
        return db.execute("SELECT count(*) FROM samples").fetchone()[0]
    return 0


def test_a_whole_recording_is_the_same_again(recording):
    code, verdict = verdict_of(recording)
    assert (code, verdict["equal"], verdict["difference"], verdict["remark"]) == (0, True, None, "")
    assert verdict["samples"] > 14_000
    assert verdict["duration_s"] == pytest.approx(30, abs=5)
    assert verdict["times_real_time"] == pytest.approx(verdict["duration_s"] / verdict["took_s"])


def test_it_is_told_in_words(recording):
    done = pneuforce("replay", recording)
    assert done.returncode == 0
    assert "times real time" in done.stdout
    assert "all equal, to the last bit" in done.stdout
    assert not done.stderr


def _altered(batch):
    """A batch of inputs, one bit of the rig's bytes in its middle flipped."""
    entries = Decoder().feed(batch)
    at = next(n for n, entry in enumerate(entries) if n > len(entries) / 2 and entry.kind is Kind.RECEIVED)
    body = bytearray(entries[at].body)
    body[len(body) // 2] ^= 4
    entries[at] = entries[at]._replace(body=bytes(body))
    return b"".join(map(encode, entries)), entries[at].t_s


def test_one_altered_bit_of_what_the_rig_said_is_found_where_it_is(copy):
    """Its checksum made right, so that nothing but the replay can tell."""
    with closing(sqlite3.connect(copy)) as db:
        number, first_s, batch = db.execute(
            "SELECT number, first_t_s, entries FROM tape WHERE number > 5 LIMIT 1"
        ).fetchone()
        batch, altered_s = _altered(batch)
        right = checksum((number, first_s, batch))
        db.execute("UPDATE tape SET entries = ?, crc32 = ? WHERE number = ?", (batch, right, number))
        db.commit()
    code, verdict = verdict_of(copy)
    assert code == 1
    assert not verdict["equal"]
    assert verdict["difference"]["t_s"] == pytest.approx(altered_s, abs=0.05)
    said = pneuforce("replay", copy).stdout
    assert f"(sequence {verdict['difference']['sequence']})" in said
    assert "differs" in said


def _spoil(file, *statements):
    with closing(sqlite3.connect(file)) as db:
        for statement in statements:
            db.execute(statement)
        db.commit()


def test_a_recording_whose_recorder_was_killed_is_replayed_to_its_end(copy):
    """The last batch of inputs may be on the disk without all that was made of it."""
    _spoil(copy, "DELETE FROM ending", "DELETE FROM samples WHERE number > 14000")
    code, verdict = verdict_of(copy)
    assert (code, verdict["samples"], verdict["equal"]) == (0, 14_000, True)
    assert "has no end" in verdict["remark"]


def test_a_damaged_recording_is_replayed_to_its_last_whole_sample(copy):
    _spoil(copy, "UPDATE samples SET force_n = 1.0 WHERE number = 801")
    code, verdict = verdict_of(copy)
    assert (code, verdict["samples"], verdict["equal"]) == (1, 800, True)
    assert verdict["duration_s"] == pytest.approx(1.6, abs=0.1)
    assert "800 rows of samples" in verdict["remark"]
    assert "all that is whole is equal" in pneuforce("replay", copy).stdout


def test_damaged_inputs_are_replayed_as_far_as_they_are_whole(copy):
    _spoil(copy, "UPDATE tape SET entries = substr(entries, 2) WHERE number = 20")
    code, verdict = verdict_of(copy)
    assert (code, verdict["equal"]) == (1, True)
    assert 0 < verdict["samples"] < 14_000
    assert "19 rows of tape" in verdict["remark"]


def test_samples_that_nothing_brings_about_are_a_difference(copy):
    _spoil(copy, "DELETE FROM tape WHERE number > 20")
    code, verdict = verdict_of(copy)
    assert (code, verdict["equal"], verdict["remark"]) == (1, False, "")
    assert "more samples were recorded" in pneuforce("replay", copy).stdout


def _say_of_itself(file, key, value):
    with closing(sqlite3.connect(file)) as db:
        (number,) = db.execute("SELECT number FROM about WHERE key = ?", (key,)).fetchone()
        text = json.dumps(value)
        row = (number, key, text)
        db.execute("UPDATE about SET value = ?, crc32 = ? WHERE key = ?", (text, checksum(row), key))
        db.commit()


@pytest.mark.parametrize(("key", "other"), [("version", "0.0.1"), ("map_hash", "00c0ffee")])
def test_another_programs_recording_is_refused_but_exported(copy, tmp_path, key, other):
    _say_of_itself(copy, key, other)
    for words in ((), ("--config", _configured(tmp_path)[0])):
        done = pneuforce("replay", copy, *words)
        assert done.returncode == 2
        assert other in done.stderr
        assert "pneuforce export" in done.stderr
        assert "Traceback" not in done.stderr
    assert pneuforce("export", copy, tmp_path / "out.csv").returncode == 0


def test_a_checkpoint_that_is_none_is_told_in_a_sentence(copy, tmp_path):
    with closing(sqlite3.connect(copy)) as db:
        ((t_s,),) = db.execute("SELECT t_s FROM checkpoint")
        row = (1, t_s, b"cos\nsystem\n(S'true'\ntR.")
        db.execute("UPDATE checkpoint SET state = ?, crc32 = ?", (row[2], checksum(row)))
        db.commit()
    for words in ((), ("--config", _configured(tmp_path)[0])):
        done = pneuforce("replay", copy, *words)
        assert done.returncode == 2
        assert "checkpoint asks for" in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("words", [["--speed", "2"], ["--loop"], ["--config", "/dev/null", "--json"]])
def test_what_is_of_no_use_together_is_refused(recording, words):
    done = pneuforce("replay", recording, *words)
    assert done.returncode == 2
    assert "--config" in done.stderr


@pytest.mark.parametrize("speed", ["0.05", "101", "nan"])
def test_no_other_speed_is_played(recording, tmp_path, speed):
    done = pneuforce("replay", recording, "--config", _configured(tmp_path)[0], "--speed", speed)
    assert done.returncode == 2


# ---- on the buses


def _configured(folder, **tables):
    ports = {"modbus": {"port": free_port()}, "local": {"socket": str(folder / "replay.sock")}, **tables}
    file = folder / "replay.toml"
    file.write_text(toml(ports))
    return file, ports


@contextmanager
def playing(file, folder, *words, **tables):
    config, ports = _configured(folder, **tables)
    arguments = ["instrument", "replay", str(file), "--config", str(config), *words]
    with Child("replay", arguments) as player:
        ready = player.ready()
        with Plc.connect(port=ports["modbus"]["port"]) as plc:
            yield player, plc, ready


def test_over_modbus_the_force_is_the_recorded_one_of_that_sample(recording, tmp_path):
    with opened(recording) as tape:
        first = thaw(tape.checkpoint.body).instrument.sample_counter
        forces = [sample.force_n for sample in tape.samples()]
    with playing(recording, tmp_path) as (_, plc, ready):
        assert ready == {"modbus": plc._client.comm_params.port}
        seen = [seen for _ in range(300) if "stale" not in (seen := plc.read())["status"]]
        with pytest.raises(PlcError, match="write_lock"):
            plc.write("setpoint_requested", 7.0)
        with pytest.raises(PlcError, match="write_lock"):
            plc.write("mode", "hold")
        plc.vent()
        assert plc.read()["refusal"] == "none"
    assert len({now["sample_counter"] for now in seen}) > 50
    for now in seen:
        assert now["status"] >= MARKS
        recorded_n = forces[now["sample_counter"] - first - 1]
        assert struct.pack("<f", now["force"]) == struct.pack("<f", recorded_n)
        assert now["sample_age"] <= 0.1


def test_at_its_end_values_are_stale_and_the_link_is_lost(recording, tmp_path):
    with playing(recording, tmp_path, "--speed", "50") as (player, plc, _):
        seen = wait_for(plc.read, lambda seen: {"stale", "link_lost"} <= seen["status"])
        assert seen["force"] != seen["force"]
        assert seen["status"] >= MARKS
        wait_for(lambda: " ".join(player.said), lambda said: "the recording is over" in said)


def test_in_a_loop_it_begins_again(recording, tmp_path):
    with playing(recording, tmp_path, "--speed", "50", "--loop") as (player, plc, _):
        first = plc.read()["sample_counter"]
        most = wait_for(lambda: plc.read()["sample_counter"], lambda counter: counter > first + 200)
        wait_for(lambda: plc.read()["sample_counter"], lambda counter: counter < most)
        assert player.running


def test_a_robot_and_a_browser_see_a_simulated_rig_and_nobody_records_it(recording, tmp_path):
    with Child("CAN hub", ["registers.can.hub", "--port", "0"]) as hub:
        port = hub.ready()["port"]
        own = {"enabled": True, "interface": "socketcand", "port": port}
        page = {"enabled": True, "port": free_port(), "token": "correct-horse-battery"}
        with (
            can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True) as bus,
            playing(recording, tmp_path, "--speed", "10", "--loop", can=own, page=page) as started,
        ):
            player, plc, ready = started
            assert ready["page"] == page["port"]
            assert "Traceback" not in " ".join(player.said)
            frames = wait_for(lambda: [bus.recv(0.2) for _ in range(100)], lambda heard: None not in heard)
            assert {frame.arbitration_id for frame in frames} >= {0x185, 0x705}
            assert _about(page["port"])["simulated"] is True
            assert set(_told(page["port"], "state")["status"]) >= MARKS
            samples = _told(page["port"], "samples")
            assert max(samples["t_s"]) == pytest.approx(time.monotonic(), abs=5.0)
            assert _told(page["port"], "event", "text")["at"] >= "20"
            _refused_recorder(tmp_path)
            assert player.running
            assert plc.read()["sample_age"] <= 0.1
            assert "Traceback" not in " ".join(player.said)


def _about(port):
    with urlopen(f"http://127.0.0.1:{port}/api/about", timeout=5.0) as answer:
        return json.loads(answer.read())


def _told(port, event, key="t_s"):
    """The first message of a kind that a browser is told, with something in it."""
    with urlopen(f"http://127.0.0.1:{port}/api/live", timeout=10.0) as stream:
        kind = ""
        for line in stream:
            if line.startswith(b"event:"):
                kind = line.split(b":", 1)[1].strip().decode()
            elif line.startswith(b"data:") and kind == event:
                facts = json.loads(line[5:])
                if facts.get(key):
                    return facts
    return pytest.fail(f"no {event}")


def _refused_recorder(folder):
    with socket.socket(socket.AF_UNIX) as guest:
        guest.settimeout(5.0)
        guest.connect(str(folder / "replay.sock"))
        guest.sendall(encode(told(Kind.WANT, 0.0, {"want": "record"})))
        assert guest.recv(1) == b""
