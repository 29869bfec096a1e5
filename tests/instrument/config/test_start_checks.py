"""Tests of `pneuforce config --check`: what would stop the start of the instrument is reported before."""

import asyncio
import contextlib
import grp
import json
import os
import pwd
import re
import shutil
import socket
import sqlite3
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from pneuforce.errors import ConfigurationError, ConfigurationFileError, PneuforceError
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.instrument.cli.config_check import check_config
from pneuforce.instrument.commissioning.certificates import key_pem
from pneuforce.instrument.config import Configuration, load
from pneuforce.instrument.service.audit_log import audited
from pneuforce.instrument.service.checks.file_checks import SERVICE_FOLDERS, check_files
from pneuforce.instrument.service.checks.service_user import service_permissions
from pneuforce.instrument.service.checks.start_checks import load_checked
from pneuforce.instrument.service.local_socket.unix_socket import LocalSocket
from pneuforce.instrument.users.file import write_users
from pneuforce.support.network_name import is_host, is_socket_url
from pneuforce.support.permissions import write_problem
from pneuforce.support.serial_port import SerialPort
from tests.command_runner import pneuforce
from tests.instrument.audit.event_log_files import make_log
from tests.registers.modbus_security.serving import Pki
from tests.source_tree import ROOT

ALLOW = 'allow = ["10.0.0.1"]\n'
CANOPEN = '[can]\nenabled = true\nmode = "canopen"\ninterface = "virtual"\nparameter_file = '
REJECTED = [
    ("measurement.calibration", '[measurement]\ncalibration = "\\u0000"\n'),
    ("modbus_rtu.port", '[modbus_rtu]\nenabled = true\nport = "\\u0000"\n'),
    ("modbus.host", f'[modbus]\nhost = "a..b"\n{ALLOW}'),
    ("modbus.host", f'[modbus]\nhost = "{"x" * 64}"\n{ALLOW}'),
    ("modbus.host", f'[modbus]\nhost = "é.example"\n{ALLOW}'),
    ("web.host", f'[web]\nenabled = true\nhost = "a..b"\n{ALLOW}'),
    ("can.host", '[can]\nhost = "a..b"\n'),
    ("can.channel", '[can]\nchannel = "../can0"\n'),
    ("local.socket", '[local]\nsocket = "\\u0000"\n'),
    ("local.socket", f'[local]\nsocket = "{"é" * 60}"\n'),
    ("local.socket", '[local]\nsocket = ""\n[web]\nenabled = true\n'),
    ("events.file", '[events]\nfile = "\\u0000"\n'),
    ("identity.url", '[identity]\nurl = "\\u001b[2J"\n'),
    ("rig.port", '[rig]\nport = "\\u0000"\n'),
    ("rig.port", '[rig]\nport = "alt:///dev/null?class=os"\n'),
    ("rig.port", '[rig]\nport = "loop://"\n'),
    ("rig.port", '[rig]\nport = "SPY:///dev/null"\n'),
    ("rig.port", '[rig]\nport = "socket://127.0.0.1:70000"\n'),
    ("rig.port", '[rig]\nport = "socket://127.0.0.1:5000?logging=debug"\n'),
    ("rig.port", '[rig]\nport = "/dev/ttyUSB0"\n[modbus_rtu]\nenabled = true\n'),
    ("modbus.port and web.port", f'[modbus]\nport = 8080\nhost = "0.0.0.0"\n{ALLOW}[web]\nenabled = true\n'),
]
#: Configurations in which a port or a file is used twice, with the two keys. "": there is no collision.
COLLISIONS = [
    ("modbus.port web.port", "[modbus]\nport = 8080\n[web]\nenabled = true\n"),
    ("modbus.port web.port", '[modbus]\nport = 8080\nhost = "localhost"\n[web]\nenabled = true\n'),
    ("modbus.port can.port", '[can]\nenabled = true\ninterface = "socketcand"\nport = 5020\n'),
    (
        "web.port can.port",
        '[web]\nenabled = true\nport = 29536\n[can]\nenabled = true\ninterface = "socketcand"\n',
    ),
    ("rig.port modbus.port", '[rig]\nport = "socket://127.0.0.1:5020"\n'),
    ("web.key", '[web]\nenabled = true\ncertificate = "page.pem"\n'),
    ("web.certificate", '[web]\nenabled = true\nkey = "page.key"\n'),
    ("page.pem", '[web]\nenabled = true\ncertificate = "page.pem"\nkey = "page.key"\n'),
    ("events.file local.socket", '[local]\nsocket = "./events.sqlite"\n'),
    ("file events.file", '[events]\nfile = "instrument.toml"\n'),
    ("file can.parameter_file", f'{CANOPEN}"instrument.toml"\n'),
    ("events.file can.parameter_file", f'{CANOPEN}"events.sqlite"\n'),
    ("", "[modbus]\nport = 8080\n"),
    ("", f'[modbus]\nport = 8080\nhost = "10.0.0.1"\n{ALLOW}[web]\nenabled = true\n'),
    ("", f'[rig]\nport = "socket://10.0.0.1:5020"\n[modbus]\nhost = "0.0.0.0"\n{ALLOW}'),
    ("", "[rdt]\nenabled = true\nport = 5020\n"),  # UDP
    ("", "[can]\nenabled = true\nport = 5020\n"),  # no TCP
    ("", '[can]\nenabled = true\nparameter_file = "events.sqlite"\n'),  # no CANopen, so no such file
    ("events.file web.recordings", '[web]\nenabled = true\nrecordings = "events.sqlite"\n'),
    ("events.file web.users_file", '[web]\nenabled = true\nusers_file = "events.sqlite"\n'),
    ("", '[events]\nfile = ""\n[local]\nsocket = ""\n'),
]


@pytest.mark.parametrize("command", [("config", "--check"), ("run", "--config")])
@pytest.mark.parametrize(("key", "text"), REJECTED, ids=range(len(REJECTED)))
def test_what_stops_the_start_is_reported_with_file_and_key(tmp_path, command, key, text):
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    done = pneuforce(*command, file)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (78, "", 1)
    assert done.stderr.startswith(f"pneuforce: {file}: ")
    assert key in done.stderr
    assert done.stderr.strip().isprintable()


@pytest.mark.parametrize(("keys", "text"), COLLISIONS, ids=range(len(COLLISIONS)))
def test_a_port_or_a_file_that_is_used_twice_is_reported_with_both_keys(tmp_path, keys, text):
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    if not keys:
        load_checked(file)
        return
    with pytest.raises(ConfigurationFileError) as caught:
        load_checked(file)
    assert all(key in str(caught.value) for key in keys.split())


#: Files that cannot be used, with the key and a word of the reason. "": the file can be used.
FILES = [
    ("events.file", "missing", '[events]\nfile = "absent/events.sqlite"\n'),
    ("events.file", "folder", '[events]\nfile = "folder"\n'),
    ("events.file", "event log", '[events]\nfile = "text"\n'),
    ("events.file", "another program", '[events]\nfile = "other.sqlite"\n'),
    ("events.file", "damaged", '[events]\nfile = "damaged.sqlite"\n'),
    ("events.file", "was moved without this file", '[events]\nfile = "moved.sqlite"\n'),
    ("events.file", "not a folder", '[events]\nfile = "text/events.sqlite"\n'),
    ("local.socket", "missing", '[local]\nsocket = "absent/socket"\n'),
    ("local.socket", "not a socket", '[local]\nsocket = "text"\n'),
    ("can.parameter_file", "missing", f'{CANOPEN}"absent/canopen.json"\n'),
    ("can.parameter_file", "damaged", f'{CANOPEN}"text"\n'),
    ("web.recordings", "not a folder", '[web]\nenabled = true\nrecordings = "text"\n'),
    ("", "", '[can]\nenabled = true\ninterface = "virtual"\nparameter_file = "text"\n'),
    ("", "", '[web]\nenabled = true\nrecordings = "absent/recordings"\n'),
    ("", "", '[web]\nrecordings = "text"\n'),
    ("", "", '[events]\nfile = "log.sqlite"\n'),
]


@pytest.mark.parametrize(("key", "why", "text"), FILES, ids=range(len(FILES)))
def test_a_file_that_cannot_be_used_is_reported_with_its_key(tmp_path, key, why, text):
    (tmp_path / "text").write_text("no event log, no socket, no parameters" * 20)
    (tmp_path / "folder").mkdir()
    with contextlib.closing(sqlite3.connect(tmp_path / "other.sqlite")) as db:
        db.execute("CREATE TABLE other (a)")
    EventLogFile(tmp_path / "log.sqlite").close()
    damaged = make_log(tmp_path / "damaged.sqlite", range(60)).read_bytes()
    (tmp_path / "damaged.sqlite").write_bytes(damaged[:-8192] + bytes(8192))
    (tmp_path / "moved.sqlite-wal").write_text("records")
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    before = sorted(tmp_path.iterdir())
    problems, remarks = check_files(load_checked(file), file)
    assert [problem.partition(":")[0] for problem in problems] == ([key] if key else [])
    assert all(why in problem for problem in problems)
    assert (remarks, sorted(tmp_path.iterdir())) == ([], before)


def test_the_check_and_the_start_report_a_damaged_event_log_with_the_same_sentence(tmp_path):
    log = make_log(tmp_path / "log.sqlite", range(60))
    log.write_bytes(log.read_bytes()[:-8192] + bytes(8192))
    file = tmp_path / "instrument.toml"
    file.write_text('[events]\nfile = "log.sqlite"\n[local]\nsocket = ""\n')
    check, start = pneuforce("config", "--check", file), pneuforce("run", "--config", file)
    assert (check.returncode, start.returncode) == (78, 78)
    assert check.stderr.replace(f"{file}: ", "") == start.stderr


@pytest.mark.parametrize(("key", "other"), [("events.file", "local.socket"), ("local.socket", "events.file")])
def test_a_missing_folder_is_an_error_of_the_configuration_also_at_the_start(tmp_path, key, other):
    file = tmp_path / "instrument.toml"
    sections = [f'[{section}]\n{name} = "absent/x"\n' for section, name in [key.split(".")]]
    sections += [f'[{section}]\n{name} = ""\n' for section, name in [other.split(".")]]
    file.write_text("".join(sections))
    check, start = pneuforce("config", "--check", file), pneuforce("run", "--config", file)
    assert (check.returncode, start.returncode) == (78, 78)
    for done in (check, start):
        assert key in done.stderr
        assert f"the folder {tmp_path}/absent is missing: create the folder" in done.stderr


def test_a_file_that_the_user_may_not_write_stops_the_start_as_it_fails_the_check(etc):
    log, socket_path, folders = etc / "own/log", etc / "socket", [etc / "closed", etc / "own"]
    for folder in folders:
        folder.mkdir(0o700)
    log.touch(0o644)
    os.chown(log.parent, 65534, 65534)
    for name, words in (("own/log", "chown nobody"), ("new", "choose another"), ("closed/in/x", "chgrp")):
        with (
            service_permissions("nobody"),
            pytest.raises(ConfigurationFileError, match=rf"events\.file: the user nobody cannot .*{words}"),
            audited(None, Configuration(), etc / name, None),
        ):
            pass
    with service_permissions("nobody"), pytest.raises(ConfigurationFileError, match=r"local\.socket"):
        asyncio.run(LocalSocket(socket_path, asyncio.Protocol).open())
    assert sorted(etc.rglob("*")) == [*folders, log]


def test_a_read_only_file_system_does_not_prevent_the_start(monkeypatch, tmp_path):
    read_only = os.statvfs_result([*os.statvfs(tmp_path)[:8], os.ST_RDONLY, 255])
    monkeypatch.setattr(os, "statvfs", lambda _: read_only)
    monkeypatch.setattr(os, "access", lambda path, access, **_: not access & os.W_OK)
    file = tmp_path / "instrument.toml"
    file.write_text('[local]\nsocket = ""\n')
    problems, remarks = check_files(load_checked(file), file, "no-such-user")
    assert (problems, [remark.partition(": the file system")[0] for remark in remarks]) == (
        [],
        ["events.file"],
    )
    assert write_problem(tmp_path / "events.sqlite") == ""


@pytest.mark.parametrize(("min_free_mb", "is_full"), [(99, False), (101, True)])
def test_a_disk_that_is_too_full_for_a_recording_is_reported(monkeypatch, tmp_path, min_free_mb, is_full):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=100e6))
    file = tmp_path / "instrument.toml"
    file.write_text(
        '[local]\nsocket = "socket"\n[web]\nenabled = true\nrecordings = "new/folder"\n'
        f"recording_min_free_mb = {min_free_mb}\n"
    )
    problems, remarks = check_files(load_checked(file), file)
    texts = [remark for remark in remarks if "must stay free" in remark]
    assert (problems, len(texts)) == ([], is_full)


def test_the_command_reports_each_file_that_cannot_be_used(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text('[events]\nfile = "absent/events.sqlite"\n[local]\nsocket = "absent/socket"\n')
    done = pneuforce("config", "--check", file)
    lines = done.stderr.splitlines()
    assert (done.returncode, len(lines)) == (78, 2)
    assert all(
        f"{file}: {key}: " in line for key, line in zip(("events.file", "local.socket"), lines, strict=True)
    )


#: A configuration with many problems, and the beginnings of the lines that report them.
BAD_EVERYWHERE = """
[measurement]
calibration = "absent.toml"
[events]
file = "absent/events.sqlite"
[modbus]
port = 8080
[modbus_security]
enabled = true
ca = "absent.pem"
certificate = "absent.pem"
key = "absent.key"
[web]
enabled = true
certificate = "absent.pem"
[mqtt]
enabled = true
password_file = "absent"
key = "absent.key"
"""
ALL_KEYS = [
    "measurement.calibration",
    "modbus.port and web.port",
    *("web.key", "modbus_security.certificate", "modbus_security.key", "modbus_security.ca"),
    *("mqtt", "mqtt", "mqtt.key", "mqtt.password_file"),
    *("events.file", "web.certificate"),
]


def test_all_problems_of_a_configuration_are_reported_at_once(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(BAD_EVERYWHERE)
    with pytest.raises(ConfigurationFileError) as caught:
        check_config([file], as_json=False)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{file}: ") for line in lines)
    keys = [line.removeprefix(f"{file}: ").partition(":")[0].partition(" are both")[0] for line in lines]
    assert [key.partition(" is empty")[0] for key in keys] == ALL_KEYS
    with pytest.raises(ConfigurationFileError) as at_start:
        load_checked(file)
    assert set(str(at_start.value).splitlines()) <= set(lines)


def test_the_folders_of_the_service_may_be_missing_before_its_first_start():
    unit = (ROOT / "instrument/deploy/pneuforce.service").read_text()
    assert all(f"{name}Directory=pneuforce\n" in unit for name in ("State", "Runtime"))
    file = ROOT / "instrument/deploy/plc.toml"
    problems, remarks = check_files(load_checked(file), file)
    missing = sum(not folder.exists() for folder in SERVICE_FOLDERS)
    assert (problems, len(remarks)) == ([], missing)


@pytest.mark.parametrize(
    "port",
    ["/dev/ttyACM0", "rig", "socket://127.0.0.1:5000", "socket://[::1]:5000", "socket://rig.example:1"],
)
def test_a_device_or_a_tcp_connection_is_accepted_as_port_of_the_rig(tmp_path, port):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{port}"\n')
    assert load(file).rig.port == port


@pytest.mark.parametrize("key", ["\\u001b[2J", "\\n", "a b", "x" * 500])
def test_an_unknown_key_is_quoted_and_cut(tmp_path, key):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\n"{key}" = 1\n')
    with pytest.raises(ConfigurationError) as caught:
        load(file)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < len(str(file)) + 150


@pytest.mark.parametrize("url", ["alt:///dev/null?class=os", "loop://", "socket://a..b:1", "socket://h:²"])
def test_a_port_that_is_no_device_cannot_be_opened(url):
    with pytest.raises(PneuforceError):
        SerialPort(url)


def test_the_resolver_of_the_operating_system_accepts_every_host_name():
    for name in ("localhost", "localhost.", "127.0.0.1", "::1", "a_b", "1.2.3.4", "x" * 63, "fe80::1%lo"):
        assert is_host(name)
        with contextlib.suppress(OSError):
            socket.getaddrinfo(name, 1, flags=socket.AI_NUMERICHOST)  # no question to a name server


NO_HOSTS = ["", ".", "a..b", ".a", "-a", "a-", "a b", "x" * 64, "a." * 127, "☃", "a\n", "[::1]"]


@pytest.mark.parametrize("name", NO_HOSTS)
def test_a_text_that_is_no_host_name_is_recognised(name):
    assert not is_host(name)
    assert not is_socket_url(f"socket://{name}:1") or name == "[::1]"


def test_a_certificate_that_has_expired_is_a_warning_and_one_without_its_key_is_an_error(tmp_path, capsys):
    pki = Pki(tmp_path / "pki")
    file = tmp_path / "instrument.toml"
    names = 'certificate = "pki/instrument.pem"\nkey = "pki/instrument.key"\n'
    file.write_text(f'[web]\nenabled = true\nhost = "0.0.0.0"\n{ALLOW}{names}')
    for days, age_days, words in (
        (365, 0, ""),
        (10, 0, "expires in 10 days"),
        (1, 2, "has expired"),
        (365, -2, "valid from"),
    ):
        pki.renew_instrument(days=days, age_days=age_days)
        check_config([file], as_json=False)
        warning = capsys.readouterr().out
        assert warning.startswith(f"{file}: good")
        assert ("web: the certificate" in warning, words in warning) == (bool(words), True)
    pki.write("instrument", pki.client("plc", "operator"))
    with pytest.raises(ConfigurationFileError, match="not for server authentication"):
        check_config([file], as_json=False)
    (pki.folder / "instrument.key").write_bytes(key_pem(pki.authority.key))
    with pytest.raises(ConfigurationFileError, match="is not the key of the certificate"):
        check_config([file], as_json=False)


def test_a_section_without_enabled_is_reported_as_off(tmp_path, capsys):
    file = tmp_path / "instrument.toml"
    file.write_text(
        "[rdt]\nport = 49152\n[web]\nenabled = false\n[mqtt]\n[modbus]\nport = 5020\n[can]\nenabled = true\n"
    )
    check_config([file], as_json=False)
    hash_line, *notes = capsys.readouterr().out.splitlines()[1:]
    assert re.fullmatch("configuration hash [0-9a-f]{8}", hash_line)
    assert notes == [
        "[mqtt] is off: add enabled = true to use it",
        "[rdt] is off: add enabled = true to use it",
    ]
    check_config([file], as_json=True)
    assert len(json.loads(capsys.readouterr().out)["notes"]) == 2


@pytest.fixture
def etc():
    """Yield a folder that every user may enter, as /etc. The folders of pytest belong to one user."""
    if os.geteuid() != 0:
        pytest.skip("only root can check with the permissions of another user")
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Path(folder)


def test_root_checks_with_the_permissions_of_the_service(etc):
    Pki(etc / "pki")
    (etc / "pki").chmod(0o755)
    (etc / "users.toml").touch(0o600)
    own = etc / "own"
    own.mkdir()
    os.chown(own, 65534, 65534)
    (own / "events.sqlite").touch(0o644)  # belongs to root
    file = etc / "instrument.toml"
    file.write_text(
        '[modbus_security]\nenabled = true\nca = "pki/ca.pem"\ncertificate = "pki/instrument.pem"\n'
        'key = "pki/instrument.key"\n[events]\nfile = "own/events.sqlite"\n[local]\nsocket = "own/socket"\n'
        '[web]\nenabled = true\nrecordings = "own/recordings"\n[mqtt]\nenabled = true\n'
    )
    file.chmod(0o600)
    (etc / "pki/instrument.key").chmod(0o600)
    configuration = load_checked(file)
    with service_permissions("nobody") as is_service_user:
        assert (is_service_user, os.geteuid()) == (True, 65534)
    problems, remarks = check_files(configuration, file, "nobody")
    assert (os.geteuid(), os.getegid()) == (0, 0)
    keys = [problem.partition(":")[0] for problem in problems]
    assert keys == [
        *("the configuration file", "events.file", "modbus_security.key", "mqtt.store", "web.users_file"),
    ]
    assert all("the user nobody cannot" in problem for problem in problems)
    written = {problem.partition(":")[0]: problem for problem in problems}
    for key, name in (("events.file", own / "events.sqlite"), ("web.users_file", etc / "users.toml")):
        assert written[key].endswith(f": chown nobody {name}")
    assert [remark.partition(":")[0] for remark in remarks] == ["local.socket", "web.recordings"]
    assert all("ReadWritePaths" in remark for remark in remarks)
    assert check_files(configuration, file, "no-such-user").problems == []
    (etc / "pki").chmod(0o700)
    assert any("modbus_security.ca: " in problem for problem in check_files(configuration, file, "nobody")[0])


def test_a_key_or_a_password_that_every_user_can_read_is_a_remark(etc):
    Pki(etc / "pki")
    folder, password, key = etc / "pki", etc / "password", etc / "pki/instrument.key"
    password.write_text("secret-12345")
    users = etc / "users.toml"
    write_users(users, {})
    file = etc / "instrument.toml"
    names = 'certificate = "pki/instrument.pem"\nkey = "pki/instrument.key"\n'
    file.write_text(
        f'[modbus_security]\nenabled = true\nca = "pki/ca.pem"\n{names}[web]\nenabled = true\n{names}'
        f'[mqtt]\nenabled = true\nbroker = "mqtts://b"\nuser = "a"\npassword_file = "password"\n{names}'
    )
    configuration = load_checked(file)
    keys = ["modbus_security.key", "mqtt.key", "mqtt.password_file", "web.key", "web.users_file"]
    for folder_mode, mode, expected in (
        (0o755, 0o644, keys),
        (0o755, 0o640, []),
        (0o750, 0o644, ["mqtt.password_file", "web.users_file"]),
    ):
        folder.chmod(folder_mode)
        key.chmod(mode)
        password.chmod(mode)
        users.chmod(mode)
        problems, remarks = check_files(configuration, file, "no-such-user")
        assert sorted(remark.partition(":")[0] for remark in remarks) == expected
        assert problems == []
    users.chmod(0o666)
    assert [
        problem.partition(":")[0] for problem in check_files(configuration, file, "no-such-user").problems
    ] == ["web.users_file"]


def test_an_unreadable_configuration_names_the_user_and_the_remedy(etc):
    file = etc / "instrument.toml"
    file.touch()
    file.chmod(0o640)
    group = grp.getgrgid(pwd.getpwnam("nobody").pw_gid).gr_name
    for path, mode, remedy in ((file, 0o640, f"chgrp {group} {file}"), (etc, 0o700, f"chgrp {group} {etc} ")):
        path.chmod(mode)
        with service_permissions("nobody"), pytest.raises(ConfigurationFileError) as caught:
            load_checked(file)
        assert str(caught.value).startswith(f"{file}: the user nobody cannot")
        assert remedy in str(caught.value)


def test_the_folders_of_an_instance_may_be_missing_before_its_first_start(tmp_path):
    paths = [f'[events]\nfile = "/var/lib/pneuforce/{name}/e"\n' for name in ("left", "right")]
    file = tmp_path / "left.toml"
    found = []
    for text in paths:
        file.write_text(text)
        found.append(check_files(load_checked(file), file))
    assert (len(found[0].problems), len(found[0].remarks)) == (0, 1)
    assert len(found[1].problems) == 1


def test_all_problems_are_reported_together_and_each_unreadable_file_with_its_remedy(etc):
    Pki(etc / "pki")
    (etc / "pki").chmod(0o755)
    for name in ("instrument.pem", "instrument.key"):
        (etc / "pki" / name).chmod(0o600)
    file = etc / "instrument.toml"
    names = 'certificate = "pki/instrument.pem"\nkey = "pki/instrument.key"\n'
    file.write_text(
        f'[modbus_security]\nenabled = true\nca = "pki/ca.pem"\ncrl = "pki/absent.pem"\n{names}'
        f'[web]\nenabled = true\n{names}[mqtt]\nenabled = true\nbroker = "mqtts://b"\n{names}'
        '[events]\nfile = "absent/events.sqlite"\n'
    )
    with service_permissions("nobody"), pytest.raises(ConfigurationFileError) as caught:
        check_config([file], as_json=False)
    text = str(caught.value)
    group = grp.getgrgid(pwd.getpwnam("nobody").pw_gid).gr_name
    for section in ("modbus_security", "web", "mqtt"):
        assert (
            text.count(f"{section}.key: the user nobody cannot read {etc}/pki/instrument.key: chgrp {group} ")
            == 1
        )
        assert text.count(f"{section}.certificate: the user nobody cannot read ") == 1
    assert text.count(f"modbus_security.crl: {etc}/pki/absent.pem: no such file") == 1
    assert "events.file: the folder" in text


def test_a_recording_without_a_local_socket_is_an_error_of_the_configuration(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text('[local]\nsocket = ""\n')
    done = pneuforce("run", "--config", file, "--record", tmp_path / "new.recording")
    assert (done.returncode, done.stdout) == (78, "")
    assert done.stderr.startswith(f"pneuforce: {file}: --record ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '[web]\nenabled = true\nhost = "0.0.0.0"\nallow = ["10.0.0.1"]\n',
            "web.allow_plain_http is not set: ",
        ),
        ('[modbus]\nhost = "0.0.0.0"\n', "modbus.allow is not set: "),
        ('[modbus]\nallow = ["192.168.1.20/24"]\n', "write the network 192.168.1.0/24"),
        ('[modbus]\nallow = ["fd00::1/64"]\n', "write the network fd00::/64"),
    ],
)
def test_the_message_says_what_to_write(tmp_path, text, words):
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    with pytest.raises(ConfigurationError) as caught:
        load(file)
    assert words in str(caught.value)
    assert "= False" not in str(caught.value)
