"""The `membrane` plant: a balloon of incompressible rubber, from finite elasticity and nothing else.

It shares no equation with the law that the instrument believes in.
"""
