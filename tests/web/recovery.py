"""Recovery of the simulated rig from a trip, for tests in real time."""

import time

from pneuforce.errors import VentFailed
from pneuforce.registers.map import COMMAND_KEY

EMPTY_KPA, EMPTY_S = 0.2, 0.7  #: pressure and time after which the board allows a fault to be cleared


def recover(rig):
    """End a contact, vent, and clear faults that the previous test or a busy machine caused."""
    rig.release(wait=False)
    try:
        rig.vent()
    except VentFailed:  # of the previous test; the fault can be cleared when the balloon is empty
        rig.wait_for(lambda now: now["pressure"] < EMPTY_KPA, allow_trip=True)
        time.sleep(EMPTY_S)
    registers = rig.read()
    if registers["first_out_fault"]:
        rig.write("command_key", COMMAND_KEY)
        rig.write("command_code", "clear_faults")
        rig.write("command_sequence", registers["answer_sequence"] + 1)
        rig.wait_for(lambda now: not now["first_out_fault"], allow_trip=True)
