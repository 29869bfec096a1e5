"""Section of the configuration file for MQTT. Each key has its default, its meaning and its limits."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from pneuforce.instrument.config.text_checks import Text, check_broker, check_topic_part, is_loopback
from pneuforce.support.broker_url import broker_address
from pneuforce.support.toml_sections import Section

TopicPart = Annotated[str, AfterValidator(check_topic_part)]


class MqttSection(Section):
    """MQTT with Sparkplug B: publish the values of the instrument to a broker. MQTT can only vent."""

    enabled: bool = Field(False, description="publish over MQTT")
    broker: Annotated[str, AfterValidator(check_broker)] = Field(
        "mqtt://127.0.0.1:1883",
        max_length=300,
        description="URL of the broker, with TLS: mqtts://host:8883",
        json_schema_extra={"allowed_values": "mqtt://host:port or mqtts://host:port"},
    )
    group: TopicPart = Field(
        "pneuforce", min_length=1, max_length=64, description="group of the Sparkplug topics"
    )
    edge_node: TopicPart = Field(
        "",
        max_length=64,
        description="name of the edge node, used by this instrument only; empty: pneuforce- with the serial "
        "number, or with the host name if there is none",
    )
    device: TopicPart = Field(
        "sensor", min_length=1, max_length=64, description="name of the device of the edge node"
    )
    period_s: float = Field(
        1.0, ge=0.05, le=3600, description="shortest time between two messages of measured values [s]"
    )
    force_deadband_n: float = Field(
        0.01, ge=0, le=10, description="change of force and uncertainty that is not published [N]"
    )
    pressure_deadband_kpa: float = Field(
        0.02, ge=0, le=10, description="change of a pressure that is not published [kPa]"
    )
    primary_host: TopicPart = Field(
        "",
        max_length=64,
        description="id of the host application for which values are stored while it is offline; empty: none",
    )
    user: Text = Field("", max_length=100, description="user name at the broker; empty: none")
    password_file: Text = Field(
        "", max_length=500, description="file whose first line is the password, relative to this file"
    )
    ca: Text = Field(
        "",
        max_length=500,
        description="mqtts: certificates of the authorities that sign the certificate of the broker (PEM); "
        "empty: those of the operating system",
    )
    certificate: Text = Field(
        "", max_length=500, description="mqtts: client certificate of this instrument (PEM); empty: none"
    )
    key: Text = Field("", max_length=500, description="mqtts: key of this certificate (PEM)")
    store: Text = Field(
        "mqtt.sqlite",
        max_length=500,
        description="file of the values that the broker has not received, relative to this file; empty: "
        "they are only kept in memory",
    )
    store_max_mb: float = Field(
        100.0, ge=1, le=100_000, description="size above which the oldest stored values are deleted [MB]"
    )
    store_max_age_h: float = Field(
        48.0, ge=0.1, le=8760, description="age above which stored values are deleted [h]"
    )

    @property
    def sends_password_openly(self) -> bool:
        """Return True if the password is sent over the network without encryption."""
        broker = broker_address(self.broker)
        return self.enabled and bool(self.password_file) and not broker.tls and not is_loopback(broker.host)
