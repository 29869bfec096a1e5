"""The `membrane` plant: a balloon of incompressible rubber, computed from finite elasticity alone.

The plant shares no equation with the force law of the instrument.
"""
