"""ROS 2 node `pneuforce`: force, diagnostics, and services to vent, hold and clear (docs/how-to/ros2.md)."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.time import Time
from std_srvs.srv import Trigger

from pneuforce import Measurement, PneuforceError
from pneuforce_ros.diagnosis import ERROR, Diagnosis, changes_at, connection_lost, diagnose
from pneuforce_ros.sample_time import sample_time_ns
from pneuforce_ros.sensor_link import SensorLink

#: Longest time between two messages with a valid force. A subscriber can request this deadline.
DEADLINE_S = 0.1
DIAGNOSTICS_PERIOD_S = 1.0
DIAGNOSIS_MAX_AGE_S = 5.0  #: an older diagnosis is reported as an error
#: One thread for hold or clear, one for the vent, one for the timer and one for commands that are rejected.
THREADS = 4
#: Sensor data (best effort, newest 5 messages), with a deadline that reports a missing force.
WRENCH_QOS = QoSProfile(
    history=qos_profile_sensor_data.history,
    depth=qos_profile_sensor_data.depth,
    reliability=qos_profile_sensor_data.reliability,
    durability=qos_profile_sensor_data.durability,
    deadline=Duration(seconds=DEADLINE_S),
)


class PneuforceNode(Node):
    """Node for one instrument."""

    def __init__(self) -> None:
        super().__init__("pneuforce")
        self._url = self._read_only("url", "tcp://127.0.0.1:5020", "address of the instrument")
        self._frame_id = self._read_only("frame_id", "pneuforce_tip", "frame of the force at the balloon")
        self._publishes_nan = self._read_only("publish_nan", False, "publish an invalid force as NaN")
        self._proof_tests = self._read_only("proof_tests", True, "allow proof tests during a hold")
        self._declare_number("setpoint_kpa", 8.0, 2.0, 12.0, "setpoint of the service hold [kPa]")
        self._declare_number("lease_s", 2.0, 0.2, 60.0, "lease of the service hold [s]")
        self._diagnosis_lock = threading.Lock()
        self._diagnosis = Diagnosis(ERROR, f"no connection to {self._url} yet")
        self._diagnosed_s = time.monotonic()
        self._changes: object = None
        self._trip = ""
        self._last_sample_ns = 0
        self._wrenches = self.create_publisher(WrenchStamped, "~/wrench", WRENCH_QOS)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._link = SensorLink(self._url, self._on_measurement, self._on_lost, self._on_hold_ended)
        commands = ReentrantCallbackGroup()
        self._serve("vent", self._link.vent, MutuallyExclusiveCallbackGroup())
        self._serve("hold", self._hold, commands)
        self._serve("clear", self._link.clear, commands)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnosis, MutuallyExclusiveCallbackGroup())
        self._link.start()

    def close(self) -> None:
        """Vent if this node holds the balloon, and disconnect."""
        self._link.close()

    # ---- parameters

    def _read_only(self, name: str, default: Any, description: str) -> Any:
        descriptor = ParameterDescriptor(description=description, read_only=True)
        return self.declare_parameter(name, default, descriptor).value

    def _declare_number(self, name: str, default: float, low: float, high: float, description: str) -> None:
        allowed = FloatingPointRange(from_value=low, to_value=high)
        descriptor = ParameterDescriptor(description=description, floating_point_range=[allowed])
        self.declare_parameter(name, default, descriptor)

    # ---- force

    def _on_measurement(self, measurement: Measurement) -> None:
        """Publish a valid force, and the diagnosis if it has changed. An invalid force is never a number."""
        if measurement.valid:
            self._publish_wrench(measurement.force_n, 0.0, measurement.age_s or 0.0)
        elif self._publishes_nan:
            self._publish_wrench(math.nan, math.nan, 0.0)
        self._set_diagnosis(diagnose(measurement, self._trip), changes_at(measurement))

    def _publish_wrench(self, force_n: float, others: float, age_s: float) -> None:
        message = WrenchStamped()
        now_ns = self.get_clock().now().nanoseconds
        self._last_sample_ns = sample_time_ns(now_ns, age_s, self._last_sample_ns)
        message.header.stamp = Time(nanoseconds=self._last_sample_ns).to_msg()
        message.header.frame_id = self._frame_id
        message.wrench = Wrench(
            force=Vector3(x=others, y=others, z=force_n), torque=Vector3(x=others, y=others, z=others)
        )
        self._publish(self._wrenches, message)

    def _publish(self, publisher: Publisher, message: Any) -> None:
        """Publish. After a shutdown of ROS, the message is dropped."""
        try:
            publisher.publish(message)
        except Exception:
            if self.context.ok():
                raise

    # ---- diagnostics

    def _on_lost(self, error: Exception) -> None:
        if self._publishes_nan:
            self._publish_wrench(math.nan, math.nan, 0.0)
        self._set_diagnosis(connection_lost(error), str(error))

    def _on_hold_ended(self, error: Exception) -> None:
        self._trip = str(error)
        self.get_logger().error(f"hold ended: {error}")

    def _set_diagnosis(self, diagnosis: Diagnosis, changes: object) -> None:
        with self._diagnosis_lock:
            changed, self._changes = changes != self._changes, changes
            self._diagnosis, self._diagnosed_s = diagnosis, time.monotonic()
        if changed:
            if diagnosis.level == ERROR:
                self.get_logger().error(diagnosis.message)
            self._publish_diagnosis()

    def _publish_diagnosis(self) -> None:
        with self._diagnosis_lock:
            diagnosis, age_s = self._diagnosis, time.monotonic() - self._diagnosed_s
        if not age_s <= DIAGNOSIS_MAX_AGE_S:
            diagnosis = Diagnosis(ERROR, f"no measurement has arrived for {age_s:.0f} s: restart the node")
        status = DiagnosticStatus(
            level=bytes([diagnosis.level]),
            name=f"{self.get_name()}: force sensor",
            message=diagnosis.message,
            hardware_id=self._url,
            values=[KeyValue(key=key, value=value) for key, value in diagnosis.values],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._publish(self._diagnostics, message)

    # ---- services

    def _serve(self, name: str, command: Callable[[], None], group: object) -> None:
        def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                command()
            except PneuforceError as error:
                response.success, response.message = False, f"{name} failed: {error}"
                self.get_logger().warning(response.message)
            else:
                response.success, response.message = True, f"{name} done"
            return response

        self.create_service(Trigger, f"~/{name}", answer, callback_group=group)

    def _hold(self) -> None:
        setpoint_kpa, lease_s = (self.get_parameter(name).value for name in ("setpoint_kpa", "lease_s"))
        self._trip = ""
        self._link.hold(setpoint_kpa, lease_s, self._proof_tests)


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    rclpy.init()
    try:
        node = PneuforceNode()
    except ParameterException as error:
        sys.exit(f"pneuforce: a parameter is invalid: {error}")
    executor = MultiThreadedExecutor(THREADS)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.close()
        rclpy.try_shutdown()
