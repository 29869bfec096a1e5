"""Test that the host process imports nothing after the handshake, because an import delays commands."""

import time

from tests.system.conftest import running
from tests.system.waiting import inflate


def test_nothing_is_imported_after_the_board_has_answered(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPROFILEIMPORTTIME", "1")
    with running(tmp_path / "rig") as stack:
        with stack.plc() as plc:
            inflate(plc, 8.0)
            stack.request(press=2.0)
            time.sleep(1.0)
            plc.read()
        stack.host.stop()
        lines = list(stack.host.stderr_lines)
    answered = next(n for n, line in enumerate(lines) if "answered" in line)
    assert any(line.startswith("import time:") for line in lines[:answered])
    assert [line for line in lines[answered:] if line.startswith("import time:")] == []
