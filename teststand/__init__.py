"""The test stand: instrument, CAN hub and simulated rig as processes, for the demo and for users' tests."""
