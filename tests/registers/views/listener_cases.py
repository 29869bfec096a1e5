"""Frames and cases for the tests of both listeners of the robot guide."""

import pytest


def force_frame(counter, status=0x82, force_mn=500):
    return force_mn.to_bytes(2, "little") + bytes(4) + bytes((status, counter))


UNUSABLE = pytest.mark.parametrize(
    "frame",
    [
        force_frame(2, status=0x02),  # the force is a number, but its valid bit is 0
        force_frame(2, force_mn=0x7FFF),  # the valid bit is 1, but the force is not available
        force_frame(2, status=0x92),  # the force is above its limit
    ],
)


ENDS_OF_A_HOLD = pytest.mark.parametrize(
    "states", [("tripped",), ("vented", "inflating", "holding", "venting"), ("holding", "tripped")]
)


REJECTIONS = pytest.mark.parametrize(
    ("sequence", "result", "last"),  # sequence number of the rejected Command, and the mode of the last one
    [
        (1, "rejected_lease", "lease"),
        (1, "rejected_write_protect", "lease"),
        (3, "rejected_fault_latched", "vent"),
        (4, "rejected_lease", "lease"),
    ],
    ids=["other holder", "write protection", "fault", "lost lease"],
)
