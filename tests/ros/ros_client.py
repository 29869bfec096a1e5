"""ROS 2 client of the tests: receives the messages of the node `pneuforce` and calls its services."""

import threading
import time
from collections.abc import Callable

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from std_srvs.srv import Trigger

SERVICES = ("vent", "hold", "clear")
DEADLINE_S = 0.1
QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=DEADLINE_S))


class RosClient:
    """Node in this process. A thread receives messages; the lists grow until `forget` is called."""

    def __init__(self):
        self.wrenches = []  # (time of arrival [s since 1970], message)
        self.diagnoses = []  # (time of arrival [monotonic s], status)
        self.missed_deadlines = []  # times [monotonic s]
        self.node = rclpy.create_node("test_client")
        events = SubscriptionEventCallbacks(deadline=self._on_missed)
        self.node.create_subscription(
            WrenchStamped, "/pneuforce/wrench", self._on_wrench, QOS, event_callbacks=events
        )
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self._services = {name: self.node.create_client(Trigger, f"/pneuforce/{name}") for name in SERVICES}
        self._parameters = self.node.create_client(SetParameters, "/pneuforce/set_parameters")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def close(self):
        self._executor.shutdown()
        self._thread.join(2.0)
        self.node.destroy_node()

    def _on_wrench(self, message):
        self.wrenches.append((time.time(), message))

    def _on_diagnostics(self, message):
        self.diagnoses += [(time.monotonic(), status) for status in message.status]

    def _on_missed(self, _):
        self.missed_deadlines.append(time.monotonic())

    def forget(self):
        """Forget everything that was received."""
        for received in (self.wrenches, self.diagnoses, self.missed_deadlines):
            received.clear()

    def request(self, name):
        """Send a request, and return the future of the answer."""
        assert self._services[name].wait_for_service(20.0), name
        return self._services[name].call_async(Trigger.Request())

    def call(self, name, timeout_s=30.0):
        """Return the answer of a service."""
        return answer_of(self.request(name), timeout_s)

    def hold(self):
        """Hold the balloon by the service of the node, and wait for the first force."""
        self.wait_for_diagnosis(lambda _, values: values.get("state") == "vented")
        answer = self.call("hold")
        assert answer.success, answer.message
        self.wait_for_wrench(lambda message: message.wrench.force.z >= 0.0)

    def set_number(self, name, value):
        """Set a parameter of the node, and return the result."""
        assert self._parameters.wait_for_service(20.0)
        number = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParameters.Request(parameters=[Parameter(name=name, value=number)])
        return answer_of(self._parameters.call_async(request)).results[0]

    def wait_for_diagnosis(self, condition: Callable[[object, dict], bool], timeout_s=20.0):
        """Return the first diagnosis, received from now on, whose status and values fulfil a condition."""
        seen, until_s = len(self.diagnoses), time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            for _, status in self.diagnoses[seen:]:
                seen += 1
                values = {pair.key: pair.value for pair in status.values}
                if condition(status, values):
                    return status, values
            time.sleep(0.02)
        raise AssertionError(f"no such diagnosis in {timeout_s} s; the last ones: {self.diagnoses[-3:]}")

    def wait_for_wrench(self, condition, timeout_s=10.0):
        """Return the first message, received from now on, that fulfils a condition."""
        seen, until_s = len(self.wrenches), time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            for _, message in self.wrenches[seen:]:
                seen += 1
                if condition(message):
                    return message
            time.sleep(0.01)
        raise AssertionError(f"no such message in {timeout_s} s; the last ones: {self.wrenches[-3:]}")


def answer_of(future, timeout_s=30.0):
    """Return the answer of a service when it arrives."""
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    assert done.wait(timeout_s), f"no answer within {timeout_s} s"
    return future.result()


def stamp_s(message):
    """Return the time of the sample [s since 1970]."""
    return Time.from_msg(message.header.stamp).nanoseconds * 1e-9
