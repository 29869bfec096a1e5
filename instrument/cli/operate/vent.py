"""`pneuforce vent`: send a vent, then wait until the sensor shows that the vent is verified."""

from __future__ import annotations

from pneuforce.client.address import connect, send_vent
from pneuforce.errors import ClientError, ConnectionFailed, VentNotConfirmed
from pneuforce.instrument.cli.operate.confirmed_vent import STOP_SWITCH, vented_text
from pneuforce.instrument.cli.terminal.output import print_done


class AnswerLost(VentNotConfirmed):
    """Vent that was sent to an instrument whose pressure cannot be read afterwards."""

    def __init__(self, error: ClientError) -> None:
        ClientError.__init__(self, f"the vent was sent, but not confirmed: {error}; {STOP_SWITCH}")
        self.pressure_kpa = None


def vent_and_confirm(url: str, timeout_s: float, as_json: bool) -> None:
    """Vent, wait for the confirmation, and print the result.

    Raises ConnectionFailed if the vent was not sent, VentNotConfirmed if the vent was sent but not confirmed.
    """
    try:
        send_vent(url)
    except ConnectionFailed as error:
        raise ConnectionFailed(f"the vent was NOT sent: {error}; {STOP_SWITCH}") from None
    try:
        with connect(url) as sensor:
            pressure_kpa = sensor.wait_until_vented(timeout_s).pressure_kpa
    except VentNotConfirmed:
        raise
    except ClientError as error:
        raise AnswerLost(error) from None
    print_done(vented_text(pressure_kpa), as_json, pressure_kpa=pressure_kpa, balloon_may_be_inflated=False)
