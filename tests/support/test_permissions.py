"""Tests of the remedy for a file that a person cannot read: the group of a service stays."""

import os

import pytest

from pneuforce.support import permissions

GROUP = 4321


@pytest.mark.parametrize(
    ("user", "mode", "remedy"),
    [
        (1000, 0o640, f"run the command as a member of the group {GROUP}, or with sudo"),
        (1000, 0o600, "chgrp "),
        (100, 0o640, "chgrp "),  # a service needs the permission itself
    ],
)
def test_the_group_of_a_service_keeps_its_permission(tmp_path, monkeypatch, user, mode, remedy):
    file = tmp_path / "instrument.key"
    file.touch()
    file.chmod(mode)
    found = file.stat()
    status = os.stat_result((*found[:5], GROUP, *found[6:10]))
    monkeypatch.setattr(permissions.Path, "stat", lambda _: status)
    monkeypatch.setattr(os, "geteuid", lambda: user)
    assert permissions._remedy(file, "r").startswith(remedy)


def test_the_remedy_for_a_closed_folder_of_the_service_opens_this_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(permissions, "permitted", lambda *_: False)
    elsewhere = permissions.folder_problem(tmp_path)
    assert elsewhere.endswith("choose another folder, for a service /var/lib/pneuforce")
    monkeypatch.setattr(permissions, "SERVICE_FOLDER", tmp_path.parent)
    inside = permissions.folder_problem(tmp_path)
    assert inside.endswith(f": chown {permissions.account()} {tmp_path} && chmod u+rwx {tmp_path}")
