"""Tests of the verification and replay of recordings, also of a recording made with a disturbed line."""

import json
import shutil
import socket
import sqlite3
import struct
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from urllib.error import URLError
from urllib.request import urlopen

import can
import pytest

from pneuforce.instrument.recording.checkpoint import restore_session
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.replay_source import REPLAY_STATUS
from pneuforce.instrument.recording.schema import checksum
from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, encode, json_entry
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.registers.rdt.record import (
    COUNTS_PER_N,
    RDT_PORT,
    RdtCommand,
    decode_record,
    encode_request,
)
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, start, toml
from tests.command_runner import pneuforce
from tests.instrument.recording.virtual_host import eventful, write_recording
from tests.registers.rdt.serving import loopback_address
from tests.system.waiting import wait_for


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Return a recording in virtual time, which does not depend on the load of the machine."""
    file = tmp_path_factory.mktemp("replay") / "press.recording"
    write_recording(eventful()[1], file)
    return file


@pytest.fixture
def copy(recording, tmp_path):
    """Return a copy of the recording, which a test may damage."""
    return shutil.copy(recording, tmp_path / "copy.recording")


def verify(file):
    done = pneuforce("replay", file, "--json")
    return done.returncode, json.loads(done.stdout)


# ---- verification


def test_the_recording_of_a_running_instrument_is_equal_bit_for_bit(tmp_path):
    """The line is disturbed, and the machine may be busy."""
    file = tmp_path / "real.recording"
    with ExitStack() as children:
        parts = start(children, tmp_path / "rig", line_seed=7)
        plc = children.enter_context(ModbusClient.connect(port=parts.modbus_port))
        for _ in range(100):
            with suppress(ModbusClientError):
                plc.write("mode", "vent")
                plc.write("setpoint_requested", 5.0)
                plc.write("mode", "hold")
                break
            time.sleep(0.05)
        line = str(tmp_path / "pneuforce.sock")
        recorder = children.enter_context(
            ChildProcess("recorder", ["pneuforce", "record", str(file), "--socket", line])
        )
        parts.line.noise.bursts = 1e-3
        wait_for(lambda: samples_in(file), lambda samples: samples > 1000)
        plc.write("lease", 0.2)
        wait_for(lambda: samples_in(file), lambda samples: samples > 1500)
        parts.host.stop()
        wait_for(lambda: recorder.running, lambda runs: not runs)
    code, result = verify(file)
    assert (code, result["equal"], result["difference"], result["remark"]) == (0, True, None, "")
    assert result["samples"] == samples_in(file) > 1500
    assert result["duration_s"] > 2


def samples_in(file):
    with suppress(sqlite3.OperationalError), closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as db:
        return db.execute("SELECT count(*) FROM samples").fetchone()[0]
    return 0


def test_an_intact_recording_is_equal_bit_for_bit(recording):
    code, result = verify(recording)
    assert (code, result["equal"], result["difference"], result["remark"]) == (0, True, None, "")
    assert result["samples"] > 14_000
    assert result["duration_s"] == pytest.approx(30, abs=5)
    assert result["times_real_time"] == pytest.approx(result["duration_s"] / result["took_s"])


def test_the_result_is_printed(recording):
    done = pneuforce("replay", recording)
    assert done.returncode == 0
    assert "times real time" in done.stdout
    assert "equal" in done.stdout
    assert not done.stderr


def _flip_bit(batch):
    """Flip one bit of the rig's bytes in a batch of inputs. Return the batch and the time of the change."""
    entries = EntryDecoder().feed(batch)
    at = next(
        n for n, entry in enumerate(entries) if n > len(entries) / 2 and entry.kind is EntryKind.RECEIVED
    )
    body = bytearray(entries[at].body)
    body[len(body) // 2] ^= 4
    entries[at] = entries[at]._replace(body=bytes(body))
    return b"".join(map(encode, entries)), entries[at].t_s


def test_a_changed_bit_of_the_rig_is_reported_at_its_sample(copy):
    """The checksum is corrected, so that only the replay can detect the change."""
    with closing(sqlite3.connect(copy)) as db:
        number, first_s, batch = db.execute(
            "SELECT number, first_t_s, entries FROM inputs WHERE number > 5 LIMIT 1"
        ).fetchone()
        batch, changed_s = _flip_bit(batch)
        right = checksum((number, first_s, batch))
        db.execute("UPDATE inputs SET entries = ?, crc32 = ? WHERE number = ?", (batch, right, number))
        db.commit()
    code, result = verify(copy)
    assert code == 1
    assert not result["equal"]
    assert result["difference"]["t_s"] == pytest.approx(changed_s, abs=0.05)
    text = pneuforce("replay", copy).stdout
    assert f"(sequence {result['difference']['sequence']})" in text
    assert "differs" in text


def _execute(file, *statements):
    with closing(sqlite3.connect(file)) as db:
        for statement in statements:
            db.execute(statement)
        db.commit()


def test_the_recording_of_a_killed_recorder_is_replayed_to_its_end(copy):
    """The last batch of inputs may be on the disk without its samples."""
    _execute(copy, "DELETE FROM ending", "DELETE FROM samples WHERE number > 14000")
    code, result = verify(copy)
    assert (code, result["samples"], result["equal"]) == (0, 14_000, True)
    assert "has no end" in result["remark"]


def test_a_damaged_recording_is_replayed_to_its_last_intact_sample(copy):
    _execute(copy, "UPDATE samples SET force_n = 1.0 WHERE number = 801")
    code, result = verify(copy)
    assert (code, result["samples"], result["equal"]) == (1, 800, True)
    assert result["duration_s"] == pytest.approx(1.6, abs=0.1)
    assert "800 rows of samples" in result["remark"]
    text = pneuforce("replay", copy).stdout
    assert "equal" in text
    assert "differs" not in text


def test_inputs_are_replayed_up_to_the_damage(copy):
    _execute(copy, "UPDATE inputs SET entries = substr(entries, 2) WHERE number = 20")
    code, result = verify(copy)
    assert (code, result["equal"]) == (1, True)
    assert 0 < result["samples"] < 14_000
    assert "19 rows of inputs" in result["remark"]


def test_samples_without_inputs_are_a_difference(copy):
    _execute(copy, "DELETE FROM inputs WHERE number > 20")
    code, result = verify(copy)
    assert (code, result["equal"], result["remark"]) == (1, False, "")
    assert "differs" in pneuforce("replay", copy).stdout


def _set_metadata(file, key, value):
    with closing(sqlite3.connect(file)) as db:
        (number,) = db.execute("SELECT number FROM about WHERE key = ?", (key,)).fetchone()
        text = json.dumps(value)
        row = (number, key, text)
        db.execute("UPDATE about SET value = ?, crc32 = ? WHERE key = ?", (text, checksum(row), key))
        db.commit()


@pytest.mark.parametrize(("key", "other"), [("version", "0.0.1"), ("map_hash", "00c0ffee")])
def test_a_recording_of_another_version_is_not_replayed_but_exported(copy, tmp_path, key, other):
    _set_metadata(copy, key, other)
    for words in ((), ("--config", _make_configuration(tmp_path)[0])):
        done = pneuforce("replay", copy, *words)
        assert done.returncode == 2
        assert other in done.stderr
        assert "pneuforce export" in done.stderr
        assert "Traceback" not in done.stderr
    assert pneuforce("export", copy, tmp_path / "out.csv").returncode == 0


@pytest.mark.parametrize("state", [b"cos\nsystem\n(S'true'\ntR.", b"[" * 100_000, b"{}", "text", None])
def test_a_forged_checkpoint_is_reported_without_a_traceback(copy, tmp_path, state):
    with closing(sqlite3.connect(copy)) as db:
        ((t_s,),) = db.execute("SELECT t_s FROM checkpoint")
        row = (1, t_s, state)
        db.execute("UPDATE checkpoint SET state = ?, crc32 = ?", (row[2], checksum(row)))
        db.commit()
    for words in ((), ("--config", _make_configuration(tmp_path)[0])):
        done = pneuforce("replay", copy, *words)
        assert done.returncode == 2
        assert str(copy) in done.stderr
        assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("words", [["--speed", "2"], ["--loop"], ["--config", "/dev/null", "--json"]])
def test_options_without_effect_are_rejected(recording, words):
    done = pneuforce("replay", recording, *words)
    assert done.returncode == 2
    assert "--config" in done.stdout + done.stderr  # a failure with --json is on stdout


@pytest.mark.parametrize("speed", ["0.05", "101", "nan"])
def test_an_invalid_speed_is_rejected(recording, tmp_path, speed):
    done = pneuforce("replay", recording, "--config", _make_configuration(tmp_path)[0], "--speed", speed)
    assert done.returncode == 2


# ---- replay on the buses


def _make_configuration(folder, **tables):
    ports = {"modbus": {"port": free_port()}, "local": {"socket": str(folder / "replay.sock")}, **tables}
    file = folder / "replay.toml"
    file.write_text(toml(ports))
    return file, ports


@contextmanager
def replay_server(file, folder, *words, **tables):
    config, ports = _make_configuration(folder, **tables)
    arguments = ["pneuforce", "replay", str(file), "--config", str(config), *words]
    with ChildProcess("replay", arguments) as player:
        ready = player.ready()
        with ModbusClient.connect(port=ports["modbus"]["port"]) as plc:
            yield player, plc, ready


def test_modbus_shows_the_recorded_force_of_each_sample(recording, tmp_path):
    with open_recording(recording) as opened:
        first = restore_session(opened.checkpoint.body).instrument.sample_counter
        forces = [sample.force_n for sample in opened.samples()]
    with replay_server(recording, tmp_path) as (_, plc, ready):
        assert ready == {"modbus": plc._client.comm_params.port}
        seen = [seen for _ in range(300) if "stale" not in (seen := plc.read())["status"]]
        with pytest.raises(ModbusClientError, match="write_protect"):
            plc.write("setpoint_requested", 7.0)
        with pytest.raises(ModbusClientError, match="write_protect"):
            plc.write("mode", "hold")
        plc.vent()
        assert plc.read()["reject_reason"] == "none"
    assert len({now["sample_counter"] for now in seen}) > 50
    for now in seen:
        assert now["status"] >= REPLAY_STATUS
        recorded_n = forces[now["sample_counter"] - first - 1]
        assert struct.pack("<f", now["force"]) == struct.pack("<f", recorded_n)
        assert now["sample_age"] <= 0.1


def test_rdt_sends_the_recorded_force_of_each_sample(recording, tmp_path):
    with open_recording(recording) as opened:
        first = restore_session(opened.checkpoint.body).instrument.sample_counter
        forces = [sample.force_n for sample in opened.samples()]
    host = loopback_address()
    with (
        replay_server(recording, tmp_path, "--speed", "50", rdt={"enabled": True, "host": host}),
        closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as client,
    ):
        client.connect((host, RDT_PORT))
        client.settimeout(5.0)
        client.send(encode_request(RdtCommand.START_REALTIME))
        records = [decode_record(client.recv(64))]
        while not records[0].is_valid or records[-1].is_valid:  # the end of the recording is not valid
            records = [*(r for r in records if r.is_valid), decode_record(client.recv(64))]
    valid = records[:-1]
    assert len(valid) > 20
    for record in valid:
        assert abs(record.force_n - forces[record.ft_sequence - first - 1]) <= 0.5 / COUNTS_PER_N


def test_after_the_end_values_are_stale_and_the_link_is_lost(recording, tmp_path):
    with replay_server(recording, tmp_path, "--speed", "50") as (player, plc, _):
        seen = wait_for(plc.read, lambda seen: {"stale", "link_lost"} <= seen["status"])
        assert seen["force"] != seen["force"]
        assert seen["status"] >= REPLAY_STATUS
        wait_for(lambda: " ".join(player.stderr_lines), lambda said: "end of the recording" in said)


def test_a_loop_starts_the_recording_again(recording, tmp_path):
    with replay_server(recording, tmp_path, "--speed", "50", "--loop") as (player, plc, _):
        first = plc.read()["sample_counter"]
        high = wait_for(lambda: plc.read()["sample_counter"], lambda counter: counter > first + 200)
        wait_for(lambda: plc.read()["sample_counter"], lambda counter: counter < high)
        assert player.running


def test_the_buses_and_the_browser_show_a_simulated_rig_and_a_recorder_is_rejected(recording, tmp_path):
    with ChildProcess("CAN hub", ["pneuforce.registers.can.hub", "--port", "0"]) as hub:
        port = hub.ready()["port"]
        can_table = {"enabled": True, "interface": "socketcand", "port": port}
        web_table = {"enabled": True, "port": free_port()}
        with (
            can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True) as bus,
            replay_server(
                recording, tmp_path, "--speed", "10", "--loop", can=can_table, web=web_table
            ) as started,
        ):
            player, plc, ready = started
            # On a busy machine, the page may not be served yet.
            assert ready["web"] in (web_table["port"], None)
            assert "Traceback" not in " ".join(player.stderr_lines)
            frames = wait_for(
                lambda: [bus.recv(0.2) for _ in range(100)], lambda received: None not in received
            )
            assert {frame.arbitration_id for frame in frames} >= {0x185, 0x705}
            about = wait_for(lambda: _about(web_table["port"]), lambda answer: answer is not None)
            assert about["simulated"] is True
            assert set(_first_message(web_table["port"], "state")["status"]) >= REPLAY_STATUS
            samples = _first_message(web_table["port"], "samples")
            assert max(samples["t_s"]) == pytest.approx(time.monotonic(), abs=5.0)
            assert _first_message(web_table["port"], "event", "kind")["at"] >= "20"
            _check_recorder_is_rejected(tmp_path)
            assert player.running
            assert plc.read()["sample_age"] <= 0.1
            assert "Traceback" not in " ".join(player.stderr_lines)


def _about(port):
    """Return the facts about the instrument, or None while the page is not served."""
    try:
        with urlopen(f"http://127.0.0.1:{port}/api/about", timeout=60.0) as answer:
            return json.loads(answer.read())
    except URLError:
        return None


def _first_message(port, event, key="t_s"):
    """Return the first message of the type `event` to a browser in which `key` has a value."""
    until_s = time.monotonic() + 30.0
    with urlopen(f"http://127.0.0.1:{port}/api/live", timeout=60.0) as stream:
        kind = ""
        for line in stream:
            if time.monotonic() > until_s:
                break
            if line.startswith(b"event:"):
                kind = line.split(b":", 1)[1].strip().decode()
            elif line.startswith(b"data:") and kind == event:
                message = json.loads(line[5:])
                if message.get(key):
                    return message
    return pytest.fail(f"no {event}")


def _check_recorder_is_rejected(folder):
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(5.0)
        client.connect(str(folder / "replay.sock"))
        client.sendall(encode(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": "record"})))
        assert client.recv(1) == b""
