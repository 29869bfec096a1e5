"""Permissions of the user that runs the service, for checks that root starts."""

from __future__ import annotations

import grp  # noqa: F401  # `support.permissions` uses it. The service user may not be able to import it
import os
import pwd
from collections.abc import Iterator
from contextlib import contextmanager

SERVICE_USER = "pneuforce"  #: `User=` of the systemd unit


@contextmanager
def service_permissions(name: str = SERVICE_USER) -> Iterator[bool]:
    """Give root the permissions of the service user in a with block. Provide True if they apply.

    The permissions of other users do not change. They apply if the process runs as the service user already.
    """
    try:
        account = pwd.getpwnam(name)
    except KeyError:  # the instrument does not run as a service on this computer
        yield False
        return
    if os.geteuid() != 0:
        yield os.geteuid() == account.pw_uid
        return
    group, groups = os.getegid(), os.getgroups()
    try:
        os.initgroups(name, account.pw_gid)
        os.setegid(account.pw_gid)
        os.seteuid(account.pw_uid)
        yield True
    finally:
        os.seteuid(0)
        os.setegid(group)
        os.setgroups(groups)
