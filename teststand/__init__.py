"""Test stand for the demo and for users' tests: instrument, CAN hub and simulated rig as processes."""
