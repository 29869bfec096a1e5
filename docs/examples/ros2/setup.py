"""Installation of the ROS 2 package by `colcon build`."""

from setuptools import setup

setup(
    name="pneuforce_ros",
    version="0.1.0",
    packages=["pneuforce_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/pneuforce_ros"]),
        ("share/pneuforce_ros", ["package.xml"]),
        ("share/pneuforce_ros/launch", ["launch/pneuforce.launch.py"]),
    ],
    install_requires=["setuptools", "pneuforce"],
    zip_safe=True,
    maintainer="The pneuforce authors",
    maintainer_email="pneuforce@example.com",
    description="Node that publishes the force of a pneuforce instrument",
    license="MIT",
    entry_points={"console_scripts": ["pneuforce_node = pneuforce_ros.node:main"]},
)
