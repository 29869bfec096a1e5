"""Launch file for the node `pneuforce`. The arguments are the parameters of the node.

    ros2 launch pneuforce_ros pneuforce.launch.py url:=tcp://192.168.1.10:5020 setpoint_kpa:=6.0

`respawn` is not set: a node that ended unexpectedly must not start again without a person.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

#: Name, type, default and description of each argument.
ARGUMENTS = (
    ("url", str, "tcp://127.0.0.1:5020", "address of the instrument"),
    ("frame_id", str, "pneuforce_tip", "frame at the tip of the balloon, with z towards the tool"),
    ("proof_tests", bool, "true", "allow proof tests, which interrupt the force, during a hold"),
    ("setpoint_kpa", float, "8.0", "setpoint of the service hold, 2 to 12 kPa"),
    ("lease_s", float, "2.0", "time without the node after which the instrument vents, 0.2 to 60 s"),
    ("publish_nan", bool, "false", "publish an invalid force as NaN, instead of no message"),
)


def generate_launch_description():
    """Return the arguments and the node."""
    parameters = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind, _, _ in ARGUMENTS
    }
    node = Node(
        package="pneuforce_ros",
        executable="pneuforce_node",
        name="pneuforce",
        output="screen",
        parameters=[parameters],
    )
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, _, default, text in ARGUMENTS
    ]
    return LaunchDescription([*declared, node])
