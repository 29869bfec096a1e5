"""Errors that are planted in the host. For each rule, a search must find at least one."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from tests.code_copy import copy_code, replace_once

CORE = "instrument/core"


class PlantedError(NamedTuple):
    """Change of one file that breaks a rule. The named search must find it."""

    rule: str
    search: str
    file: str
    old: str
    new: str
    slow: bool = False  #: the search takes more than 2 s; `make prove` plants the error, `make test` does not


PLANTED_ERRORS = (
    PlantedError(
        "a_vent_is_always_accepted",
        "order",
        "controller.py",
        'elif values.get("mode") == "vent":\n            self.vent(now_s)',
        'elif values.get("mode") == "vent":\n            pass',
    ),
    PlantedError(
        "a_vent_is_always_accepted",
        "leases",
        "authorization.py",
        'if set(values) == {"mode"} and values["mode"] == "vent":',
        "if not values:",
    ),
    PlantedError(
        "only_an_accepted_hold_inflates",
        "leases",
        "requests.py",
        "    lease.renew(peer, now_s)",
        '    if "lease_s" in values and state.arming is Arming.READY and requested.setpoint_kpa > 0:\n'
        "        state.hold()",
    ),
    PlantedError(
        "a_hold_needs_all_steps",
        "order",
        "arming.py",
        "Step.CLEAR: Arming.CLEARED, Step.VENT: Arming.READY}",
        "Step.CLEAR: Arming.READY, Step.VENT: Arming.READY}",
    ),
    PlantedError(
        "a_repeated_hold_does_not_inflate",
        "order",
        "authorization.py",
        'if context.arming is Arming.READY and record.mode == "hold":',
        "if False:",
    ),
    PlantedError(
        "a_repeated_hold_does_not_inflate",
        "order",
        "controller.py",
        'if "mode" in values:',
        'if "mode" in values and reject_reason is RejectReason.NONE:',
    ),
    PlantedError(
        "a_complete_order_is_accepted",
        "order",
        "authorization.py",
        'if context.arming is Arming.READY and record.mode == "hold":',
        "if context.arming is Arming.HOLDING:",
    ),
    PlantedError(
        "a_lease_excludes_other_peers",
        "leases",
        "lease.py",
        "return self.holder is None or self.holder == peer",
        "return True",
    ),
    PlantedError(
        "a_lease_expires",
        "leases",
        "controller.py",
        "and self.lease.expire(now_s):",
        "and self.lease.expire(now_s - 0.1):",
    ),
    PlantedError(
        "a_lease_is_kept",
        "leases",
        "lease.py",
        "            self._until_s = now_s + self.duration_s",
        "            pass",
    ),
    PlantedError(
        "a_lease_expires",
        "leases",
        "controller.py",
        "            self.trip_after_contact(HostFault.LEASE_EXPIRED, now_s)",
        "            pass",
    ),
    PlantedError(
        "a_vent_reaches_the_board",
        "order",
        "state.py",
        "        if self.holding:\n            self.command_monitor.request_vent",
        "        if self.holding and self.measurement.rise_kpa >= 0:\n"
        "            self.command_monitor.request_vent",
    ),
    PlantedError(
        "a_board_that_ignores_commands_trips",
        "board",
        "controller.py",
        "        self.check_stall(now_s)\n        self._check_lease(now_s)\n",
        "        self._check_lease(now_s)\n        self.command_monitor._restart()\n",
    ),
    PlantedError(
        "clearing_moves_no_valve",
        "order",
        "arming.py",
        "Step.CLEAR: Arming.HOLDING,",
        "Step.CLEAR: Arming.READY,",
    ),
    PlantedError(
        "a_hold_ends_only_by_a_vent_or_a_trip",
        "order",
        "arming.py",
        "Step.CLEAR: Arming.HOLDING,",
        "Step.CLEAR: Arming.READY,",
    ),
    PlantedError(
        "a_lease_is_kept",
        "stalls",
        "controller.py",
        "if not self.lease.overdue_s(now_s) <= wait_s and self.lease",
        "if self.lease",
    ),
    PlantedError(
        "a_vent_reaches_the_board",
        "board",
        "controller.py",
        "return self.holding and not self.command_monitor.vent_due",
        "return self.holding",
    ),
    PlantedError(
        "a_board_that_ignores_commands_trips",
        "board",
        "command_monitor.py",
        "        if not self.vent_due:\n            self._changes",
        "        if True:\n            self._changes",
        slow=True,
    ),
    PlantedError(
        "a_fault_vents",
        "contacts",
        "state.py",
        "due_s = now_s + MAX_VENT_DELAY_S if",
        "due_s = now_s + 2 * MAX_VENT_DELAY_S if",
        slow=True,
    ),
    PlantedError(
        "a_fault_vents",
        "order",
        "state.py",
        "        self.advance(Step.TRIP)",
        "        self.revision += 1",
    ),
    PlantedError(
        "a_lost_link_trips",
        "faults",
        "controller.py",
        "if self.link_lost(now_s) and self.sample is not None and",
        "if self.link_lost(now_s) and self.holding and",
    ),
    PlantedError(
        "a_lost_link_trips",
        "stalls",
        "controller.py",
        "and self.age_s(now_s) <= self.settings.host_timeout_s",
        "",
        slow=True,
    ),
    PlantedError(
        "a_restart_and_a_pulled_cable_trip",
        "faults",
        "controller.py",
        "if self.raw is not None:",
        "if self.holding:",
    ),
    PlantedError(
        "a_fault_of_the_board_trips",
        "order",
        "controller.py",
        "if code not in self.clearing.faults:",
        "if not self.clearing.faults and self.holding:",
    ),
    PlantedError(
        "a_board_that_ignores_commands_trips",
        "board",
        "command_monitor.py",
        "(follows or self._deviating_s <= FOLLOW_S)",
        "(follows or self._deviating_s <= 2 * FOLLOW_S)",
    ),
    PlantedError(
        "faults_end_only_by_clearing",
        "order",
        "operations.py",
        "confirmed = state.sample.faults == 0 and state",
        "confirmed = state",
    ),
    PlantedError(
        "faults_end_only_by_clearing",
        "faults",
        "operations.py",
        "state.measurement.t_s - clearing.since_s >= CLEAR_HEARD_S",
        "now_s - clearing.since_s >= CLEAR_HEARD_S",
        slow=True,
    ),
    PlantedError(
        "clearing_moves_no_valve",
        "order",
        "operations.py",
        "    clearing.since_s = now_s",
        "    clearing.since_s = now_s\n    state.vent(now_s)",
    ),
    PlantedError(
        "clearing_ends",
        "order",
        "authorization.py",
        "if context.busy and sequence",
        "if context.link_lost and sequence",
    ),
    PlantedError(
        "clearing_ends",
        "order",
        "operations.py",
        "now_s - clearing.since_s <= CLEAR_ANSWER_S",
        "now_s - clearing.since_s <= 4 * CLEAR_ANSWER_S",
    ),
    PlantedError(
        "a_trip_shows_no_force",
        "faults",
        "snapshot.py",
        "return m.without_force() if state.tripped else m",
        "return m",
    ),
    PlantedError(
        "each_state_leads_back_to_a_held_balloon",
        "order",
        "operations.py",
        "    clearing.faults = set()\n    clearing.since_s = None\n",
        "    clearing.faults = set()\n",
        slow=True,
    ),
)


def finding_of(planted: PlantedError) -> str:
    """Return the line of the search that shows the violated rule in a copy with the error, or "".

    Only this rule is checked.

    Raises ValueError if the text does not occur exactly once in the file.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        copy_code(copy, "instrument")
        replace_once(copy / CORE / planted.file, planted.old, planted.new)
        done = subprocess.run(
            (sys.executable, "-B", "-m", "tests.rules", planted.search, "--rule", planted.rule),
            cwd=copy, env={**os.environ, "PYTHONPATH": folder}, capture_output=True, text=True,
        )  # fmt: skip
    if done.returncode == 0:
        return ""
    return next((line for line in done.stdout.splitlines() if "does not hold" in line), done.stderr)
