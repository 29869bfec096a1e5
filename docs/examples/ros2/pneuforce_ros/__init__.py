"""ROS 2 node for the force of a pneuforce instrument."""
