"""Fixtures: the ROS 2 package built by colcon, its node as a process, and a ROS 2 client."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "docs/examples/ros2"
sys.path.append(str(PACKAGE))  # for the tests of the modules that need no ROS
BIN = Path(sys.executable).parent


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """Build the package in a workspace, and return the folder of the installed package."""
    workspace = tmp_path_factory.mktemp("workspace")
    done = subprocess.run(
        [BIN / "colcon", "build", "--base-paths", PACKAGE],
        cwd=workspace,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return workspace / "install/pneuforce_ros"


@pytest.fixture(scope="session")
def ros(tmp_path_factory):
    """Start ROS 2 in this process, visible only on this computer."""
    os.environ["ROS_LOG_DIR"] = str(tmp_path_factory.mktemp("log"))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
    import rclpy

    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    yield
    rclpy.shutdown()


@pytest.fixture
def client(ros):
    """Return a ROS 2 client."""
    from tests.ros.ros_client import RosClient

    client = RosClient()
    yield client
    client.close()


@pytest.fixture
def start_node(installed, ros, tmp_path):
    """Return a function that starts the node as a process, and returns the process and its log file."""
    (packages,) = installed.glob("lib/python*/site-packages")
    environment = os.environ | {"PYTHONPATH": str(packages), "PATH": f"{BIN}:{os.environ['PATH']}"}
    log = tmp_path / "node.log"
    processes = []

    def start(url, **parameters):
        settings = [text for name, value in parameters.items() for text in ("-p", f"{name}:={value}")]
        program = installed / "lib/pneuforce_ros/pneuforce_node"
        command = [program, "--ros-args", "-p", f"url:={url}", *settings]
        with log.open("a") as output:
            processes.append(subprocess.Popen(command, env=environment, stdout=output, stderr=output))
        return processes[-1], log

    yield start
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.wait()
    print(log.read_text() if log.exists() else "")


@pytest.fixture
def run_node(start_node, client):
    """Return a context manager that runs the node until the end of the context."""

    @contextmanager
    def run(url, **parameters):
        process, _ = start_node(url, **parameters)
        client.wait_for_diagnosis(lambda status, _: status.hardware_id == url)
        yield process
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.wait(10.0)

    return run
