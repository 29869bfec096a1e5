"""Tests of the warning before a list of revoked certificates ends."""

import time

import pytest

from pneuforce.support.renewed_context import RenewedContext
from pneuforce.support.revocation_list import list_warning
from tests.registers.modbus_security.serving import Pki

HOUR_S, DAY_S = 3600.0, 86_400.0


@pytest.mark.parametrize(
    ("left_s", "part"),
    [
        (DAY_S, ""),
        (17 * HOUR_S, ""),  # the list is valid for 7 days, so the warning begins 16.8 hours before its end
        (16 * HOUR_S, "ends at 20"),
        (-60.0, "overdue since today"),
        (-3 * DAY_S, "overdue for 3 days"),
    ],
)
def test_the_warning_begins_when_a_tenth_of_the_validity_is_left(tmp_path, left_s, part):
    pki = Pki(tmp_path)
    crl = pki.write_overdue_list(0).read_bytes()
    warning = list_warning(crl, pki.now.timestamp() - left_s)
    assert bool(warning) is bool(part)
    assert part in warning


def test_a_renewed_list_ends_the_warning_without_a_restart(tmp_path):
    pki = Pki(tmp_path)
    crl = pki.write_overdue_list(1)
    tls = RenewedContext(pki.files(str(crl)), "Modbus/TCP Security")
    assert "overdue for 1 day" in tls.list_warning(time.time())
    pki.write_overdue_list(-5)
    tls.renew(time.time())
    assert tls.list_warning(time.time()) == ""
    assert RenewedContext(pki.files(), "Modbus/TCP Security").list_warning(time.time()) == ""
