"""Function nodes of the Node-RED flow, run by Node.js in virtual time with the words of a register bank."""

import json
import subprocess

from pneuforce.registers.map import BLOCKS, BY_NAME, REGISTERS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.register_bank import RegisterBank
from tests.peers.clients.client import NODE

HELD = {
    "force": 1.25, "force_uncertainty": 0.05, "pressure": 8.5, "state": 4, "status": 4, "sample_age": 2,
    "map_hash": MAP_HASH, "answer_sequence": 65535,
}  # fmt: skip


class FunctionNodes:
    """Process that runs the function nodes."""

    def __init__(self, program, flow):
        self._process = subprocess.Popen(
            [NODE, program, flow], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def close(self):
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def restart(self):
        """Give each node its first state, as after a deployment."""
        self._ask("restart")

    def send(self, node, topic, **properties):
        """Send a message to a node, and return the messages of its three outputs as lists."""
        outputs = self._ask({"node": node, "msg": {"topic": topic, **properties}}) or []
        outputs += [None] * (3 - len(outputs))
        return [o if isinstance(o, list) else [] if o is None else [o] for o in outputs]

    def _ask(self, request):
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def read(self, values, order="ABCD", **errors):
        """Run one cycle of the node "Read" with the codes of an instrument. Return the readings."""
        requests, readings, _ = self.send("Read", "tick")
        for request in requests:
            _, answer, _ = self.answer(request, memory(values, order), **errors)
            readings += answer
        return [reading["payload"] for reading in readings]

    def answer(self, request, words, **changes):
        """Answer a request of the node "Read"."""
        address, quantity = request["payload"]["address"], request["payload"]["quantity"]
        message = {"cycle": request["cycle"], "payload": words[address : address + quantity], **changes}
        return self.send("Read", request["topic"], **message)


def memory(values, order="ABCD"):
    """Return the words from address 0 of an instrument whose registers have these codes; others are 0."""
    bank = RegisterBank(word_swap=order == "CDAB")
    words = [0] * (max(last for _, last in BLOCKS) + 1)
    codes = {r.name: r.constant for r in REGISTERS if r.constant is not None} | values
    for name, code in codes.items():
        data = bank.encode_words(BY_NAME[name], code)
        for at in range(0, len(data), 2):
            words[BY_NAME[name].address + at // 2] = int.from_bytes(data[at : at + 2], "big")
    return words
