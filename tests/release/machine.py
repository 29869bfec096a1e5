"""A minimal Debian on which systemd runs, in namespaces of this computer."""

import contextlib
import os
import subprocess
from pathlib import Path

from tests.system.waiting import wait_for

BASE = Path(__file__).parents[2] / "build/debian/root"
START = Path(__file__).with_name("machine.sh")
#: Units that would change settings of the kernel, which this computer and the minimal Debian share.
MASKED = ("systemd-modules-load", "systemd-sysctl", "systemd-udevd", "systemd-udev-trigger")


class Machine:
    """Running systemd, and the folder that is the root of its file system."""

    def __init__(self, root, init_pid):
        self.root, self.init_pid = root, init_pid

    def call(self, *command):
        """Run a command on the machine, and return the completed process."""
        enter = ("nsenter", f"--target={self.init_pid}", "-m", "-u", "-i", "-n", "-p", "-C", "-r", "-w")
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive"}
        return subprocess.run(
            [*enter, *command],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )

    def run(self, *command):
        """Run a command on the machine, and return its output. Its failure is a failure of the test."""
        done = self.call(*command)
        assert done.returncode == 0, f"{' '.join(command)}: {done.stdout}"
        return done.stdout.strip()

    def path(self, path):
        """Return the path on this computer of a path on the machine."""
        return self.root / str(path).lstrip("/")


@contextlib.contextmanager
def booted(folder):
    """Copy the minimal Debian to a folder and start systemd there. All processes end with the block."""
    root = folder / "root"
    subprocess.run(["cp", "--archive", "--reflink=auto", BASE, root], check=True)
    for unit in MASKED:
        (root / f"etc/systemd/system/{unit}.service").symlink_to("/dev/null")
    outside = subprocess.Popen([START, root], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        (child,) = wait_for(lambda: children_of(outside.pid), lambda pids: len(pids) == 1)
        machine = Machine(root, child)
        state = ("systemctl", "is-system-running")
        wait_for(lambda: machine.call(*state).stdout.strip(), {"running", "degraded"}.__contains__, 60)
        yield machine
    finally:
        outside.kill()  # unshare then kills process 1 of the namespace, and the kernel kills all others
        outside.wait()
        remove_control_groups(outside.pid)


def children_of(pid):
    """Return the numbers of the child processes of unshare; none while the process is still the shell."""
    if Path(f"/proc/{pid}/comm").read_text().strip() != "unshare":
        return []
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def remove_control_groups(pid):
    """Delete the control groups of a machine, as soon as its processes have ended."""
    for group in Path("/sys/fs/cgroup").glob(f"**/pneuforce-{pid}"):
        for path, _, _ in os.walk(group, topdown=False):
            wait_for(lambda path=path: removed(path), bool, 10)


def removed(path):
    with contextlib.suppress(OSError):
        os.rmdir(path)
    return not Path(path).exists()
