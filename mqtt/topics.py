"""Topics of Sparkplug B for one edge node with one device."""

from __future__ import annotations

from typing import NamedTuple

NAMESPACE = "spBv1.0"


class SparkplugTopics(NamedTuple):
    """Topics of an edge node. Its names contain none of the characters / + #."""

    group: str
    edge_node: str
    device: str

    def node(self, message_type: str) -> str:
        """Return the topic of a message of the edge node, for example NBIRTH."""
        return f"{NAMESPACE}/{self.group}/{message_type}/{self.edge_node}"

    def of_device(self, message_type: str) -> str:
        """Return the topic of a message of the device, for example DDATA."""
        return f"{self.node(message_type)}/{self.device}"

    @property
    def commands(self) -> tuple[str, str]:
        """Return the topics on which host applications send commands."""
        return self.node("NCMD"), self.of_device("DCMD")


def host_topic(host_id: str) -> str:
    """Return the topic on which a host application publishes whether it is online."""
    return f"{NAMESPACE}/STATE/{host_id}"
