"""Publisher: connects to the broker, publishes the messages of the outbox, and executes commands."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from aiomqtt import Client, Message, MqttError, Will

from pneuforce.mqtt.change_filter import ChangeFilter
from pneuforce.mqtt.commands import SparkplugCommand, parse_commands
from pneuforce.mqtt.outbox import Outbox
from pneuforce.mqtt.session import BIRTH_NUMBERS, EdgeSession
from pneuforce.mqtt.store import DeliveryStore
from pneuforce.mqtt.topics import SparkplugTopics, host_topic
from pneuforce.registers.sparkplug import Reading, values_of
from pneuforce.support.backoff import Backoff
from pneuforce.support.certificate_days import days_left
from pneuforce.support.client_tls import client_context
from pneuforce.support.throttle import RateLimitedLogger
from pneuforce.support.together import run_together

log = logging.getLogger("pneuforce.mqtt")
client_log = logging.getLogger("pneuforce.mqtt.client")
client_log.setLevel(logging.CRITICAL)  # the publisher logs each lost connection in one sentence

TIMED_OUT = "Operation timed out"  #: text of aiomqtt's error
RECONNECT_FIRST_S, RECONNECT_MAX_S, STABLE_S = 0.5, 30.0, 10.0
KEEP_ALIVE_S = 10  #: the broker publishes the will after 1.5 times this silence
CONNECT_TIMEOUT_S = 3.0  #: for the answer to the connection request, after the TLS handshake
TIMEOUT_S = 10.0  #: for each answer of the broker
DEATH_TIMEOUT_S = 0.5
RADIUS_DEADBAND_MM = 0.02
SEND_PERIOD_S = 0.05
CONFIRM_PERIOD_S = 2.0  #: period at which the broker has to confirm the published values
STORED_PERIOD_S = 0.2  #: period of the messages with stored records, so that they do not delay current values
REBIRTH_PERIOD_S = 1.0  #: a flood of rebirth commands causes one birth in this time
LOG_PERIOD_S = 60.0
MAX_WAITING_COMMANDS = 64
NOT_AUTHORIZED = 0x80  #: smallest code with which a broker rejects a subscription


class PublisherSettings(NamedTuple):
    """Settings of a publisher, with the names of the configuration keys."""

    host: str
    port: int
    tls: bool
    group: str
    edge_node: str
    device: str
    period_s: float = 1.0
    force_deadband_n: float = 0.0
    pressure_deadband_kpa: float = 0.0
    primary_host: str = ""
    user: str = ""
    password_file: str = ""
    ca: str = ""
    certificate: str = ""
    key: str = ""
    store: str = ""
    store_max_mb: float = 100.0
    store_max_age_h: float = 48.0

    @property
    def address(self) -> str:
        """Return the address of the broker."""
        return f"{self.host}:{self.port}"


class Publisher:
    """Edge node of one instrument."""

    def __init__(self, settings: PublisherSettings) -> None:
        """Open the store. `run` connects to the broker."""
        self._settings = settings
        self._topics = SparkplugTopics(settings.group, settings.edge_node, settings.device)
        self._logger = RateLimitedLogger(log, LOG_PERIOD_S)
        deadbands = {
            "N": settings.force_deadband_n,
            "kPa": settings.pressure_deadband_kpa,
            "mm": RADIUS_DEADBAND_MM,
        }
        store = DeliveryStore(
            settings.store, settings.store_max_mb * 1e6, settings.store_max_age_h * 3600.0, self._warn
        )
        self.outbox = Outbox(ChangeFilter(settings.period_s, deadbands), store)
        self.vent_requested = asyncio.Event()
        self._rebirth_requested = False
        self._reason = ""  # why the broker cannot be reached; empty while it is connected

    def certificate_days(self, now_s: float) -> float | None:
        """Return the days until the client certificate in the file expires, None without a certificate.

        The file is read again, because it may be renewed. `now_s` is in seconds since 1970-01-01 UTC.
        """
        if not self._settings.certificate:
            return None
        try:
            return round(days_left(Path(self._settings.certificate).read_bytes(), now_s), 3)
        except (OSError, ValueError):
            return None

    @property
    def connected(self) -> bool:
        """Return True if the broker is connected."""
        return self.outbox.session is not None

    # ---- the instrument

    def on_reading(self, reading: Reading, t_s: float) -> None:
        """Handle a snapshot of the time `t_s` on the monotonic clock."""
        now_s = time.monotonic()
        self.outbox.on_values(values_of(reading), now_s, _utc_ms(t_s - now_s))

    def on_lost(self, why: str) -> None:
        """Handle the loss of the instrument."""
        self._warn(why)
        self.outbox.on_instrument_lost(_utc_ms())

    def on_vent_result(self, result: str) -> None:
        """Handle the answer of the instrument to a vent."""
        self.outbox.on_vent_result(result, _utc_ms())

    # ---- the broker

    async def run(self) -> None:
        """Publish until cancelled, and connect again after each failure."""
        backoff = Backoff(RECONNECT_FIRST_S, RECONNECT_MAX_S, STABLE_S)
        loop = asyncio.get_running_loop()
        while True:
            session = self._new_session()
            try:
                async with self._client(session) as client:
                    client.timeout = TIMEOUT_S
                    backoff.opened(loop.time())
                    await self._serve(client, session)
            except (MqttError, OSError, ValueError) as error:
                self._disconnected(str(error) or type(error).__name__)
            backoff.failed(loop.time())
            await asyncio.sleep(backoff.wait_s)
            backoff.attempted()

    def close(self) -> None:
        """Keep what the broker has not confirmed, and close the store."""
        self.outbox.disconnected()
        self.outbox.store.close()

    def _new_session(self) -> EdgeSession:
        number = self.outbox.store.next_birth_number(BIRTH_NUMBERS)
        return EdgeSession(self._topics, number, self._settings.primary_host)

    def _client(self, session: EdgeSession) -> Client:
        """Return a client with the will of this session. Raises OSError if a file cannot be read."""
        settings, will = self._settings, session.death(_utc_ms())
        context: ssl.SSLContext | None = None
        if settings.tls:
            context = client_context(settings.ca, settings.certificate, settings.key)
        return Client(
            settings.host,
            settings.port,
            username=settings.user or None,
            password=_password(settings.password_file) if settings.password_file else None,
            identifier=f"{settings.group}-{settings.edge_node}",
            will=Will(will.topic, will.payload, will.qos),
            clean_session=True,
            keepalive=KEEP_ALIVE_S,
            timeout=CONNECT_TIMEOUT_S,
            tls_context=context,
            logger=client_log,
            max_queued_incoming_messages=MAX_WAITING_COMMANDS,
        )

    async def _serve(self, client: Client, session: EdgeSession) -> None:
        """Publish and receive until the connection fails, or the primary host application is offline."""
        if self._settings.primary_host:
            await client.subscribe(host_topic(self._settings.primary_host), qos=1)
        if not await self._subscribe_to_commands(client):
            self._warn("the broker does not permit the edge node to receive commands: a vent by MQTT fails")
        self._connected(session)
        try:
            await run_together(self._receive(client), self._send(client, session))
        finally:
            self.outbox.disconnected()
            await self._publish_death(client, session)

    async def _publish_death(self, client: Client, session: EdgeSession) -> None:
        """Publish the death before the client disconnects: the broker then no longer publishes the will."""
        death = session.death(_utc_ms())
        with suppress(MqttError):
            await client.publish(death.topic, death.payload, death.qos, timeout=DEATH_TIMEOUT_S)

    async def _subscribe_to_commands(self, client: Client) -> bool:
        """Subscribe to the commands. Return True if the broker permits this."""
        granted = await client.subscribe([(topic, 1) for topic in self._topics.commands])
        return all(code < NOT_AUTHORIZED for code in granted if isinstance(code, int))

    def _connected(self, session: EdgeSession) -> None:
        self.outbox.session = session
        stored = self.outbox.store.count
        if self._reason:
            log.warning("MQTT: connected to %s; stored records to send: %d", self._settings.address, stored)
        self._reason = ""
        if session.host_online:
            self.outbox.birth(_utc_ms())

    def _disconnected(self, why: str) -> None:
        if why == TIMED_OUT:
            why = "the broker does not answer, or rejects the client certificate"
        if why != self._reason:
            address = self._settings.address
            log.warning("MQTT: no connection to %s: %s; values are stored until it works", address, why)
        self._reason = why

    # ---- while connected

    async def _receive(self, client: Client) -> None:
        async for message in client.messages:
            self._on_message(message)

    def _on_message(self, message: Message) -> None:
        payload = message.payload if isinstance(message.payload, bytes) else b""
        session = self.outbox.session
        if message.topic.value not in self._topics.commands:
            if session is not None:
                session.on_host_state(payload)
            return
        commands, rejected = parse_commands(payload, retained=message.retain)
        for sentence in rejected:
            self._warn(sentence)
        if SparkplugCommand.VENT in commands:
            self.vent_requested.set()
        if SparkplugCommand.REBIRTH in commands:
            self._rebirth_requested = True

    async def _send(self, client: Client, session: EdgeSession) -> None:
        """Publish the outbox until the primary host application is offline."""
        loop = asyncio.get_running_loop()
        rebirth_due_s = confirm_due_s = stored_due_s = 0.0
        while session.host_online or not session.is_born:
            now_s = loop.time()
            if session.host_online and not session.is_born:
                self.outbox.birth(_utc_ms())
            if self._rebirth_requested and session.is_born and now_s >= rebirth_due_s:
                self._rebirth_requested, rebirth_due_s = False, now_s + REBIRTH_PERIOD_S
                self.outbox.birth(_utc_ms())
            if now_s >= stored_due_s and self.outbox.store.count:
                self.outbox.add_stored(_utc_ms())
                stored_due_s, confirm_due_s = now_s + STORED_PERIOD_S, now_s
            await self._publish_all(client)
            if now_s >= confirm_due_s and not self.outbox.all_confirmed:
                confirm_due_s = now_s + CONFIRM_PERIOD_S
                await self._confirm(client)
            await asyncio.sleep(SEND_PERIOD_S)

    async def _publish_all(self, client: Client) -> None:
        while self.outbox.messages:
            message = self.outbox.messages.popleft()
            await client.publish(message.topic, message.payload, message.qos)

    async def _confirm(self, client: Client) -> None:
        """Wait for the answer to a request: the broker has then received all messages before it."""
        values = self.outbox.unconfirmed_values
        await client.unsubscribe(self._topics.node("NDEATH"))  # it is not subscribed, so this changes nothing
        self.outbox.confirmed(values)

    def _warn(self, sentence: str) -> None:
        self._logger.warning(time.monotonic(), "MQTT: %s", sentence)


def _utc_ms(offset_s: float = 0.0) -> int:
    """Return the time since 1970 [ms], `offset_s` after now."""
    return round((time.time() + offset_s) * 1e3)


def _password(path: str) -> str:
    """Return the first line of a file. Raises OSError with a sentence that contains only the path."""
    try:
        with open(path, encoding="utf-8") as file:
            return file.readline().rstrip("\r\n")
    except OSError as error:
        raise OSError(f"{path}: {error.strerror}") from None
    except ValueError:
        raise OSError(f"{path}: the password is not UTF-8 text") from None
