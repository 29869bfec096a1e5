"""Test stand: instrument, CAN hub and simulated rig as processes, for the demo and for tests of users."""
