"""What the host has done before it greets a board, so that nothing holds up its commands later."""

import time

from tests.system.conftest import running
from tests.system.waiting import inflate


def test_nothing_is_imported_any_more_once_the_board_has_answered(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPROFILEIMPORTTIME", "1")
    with running(tmp_path / "rig") as stack:
        with stack.plc() as plc:
            inflate(plc, 8.0)
            stack.order(press=2.0)
            time.sleep(1.0)
            plc.read()
        stack.host.stop()
        said = list(stack.host.said)
    answered = next(n for n, line in enumerate(said) if "answered" in line)
    assert any(line.startswith("import time:") for line in said[:answered])
    assert [line for line in said[answered:] if line.startswith("import time:")] == []
