"""Simulated hand: plays the contacts of a scenario while the balloon is held, or contacts on request."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence

from pneuforce.sim.contacts.contact import Contact, Phase
from pneuforce.sim.contacts.push import Push
from pneuforce.sim.contacts.tool import MovedTool
from pneuforce.sim.contacts.trajectory import Trajectory, constant, smooth_change

#: Time for which the balloon must be held at the setpoint of the phase before the hand starts a contact.
READY_S = 1.0
#: Additional waiting time after a change of the setpoint, until the host has commanded the new setpoint.
UNCOMMANDED_S = 1.0
REST = Contact(Trajectory.of(constant(0.0, 1e-3)))


class Hand:
    """Hand that plays the contacts of all phases in order, once or repeatedly.

    A contact that was interrupted is played again.
    """

    def __init__(
        self, plays_phases: bool, phases: Sequence[Phase] | None = None, repeat: bool = True
    ) -> None:
        """Start without a contact. If `phases` is None, the hand plays the phases of the scenario `demo`."""
        self.plays_phases = plays_phases  #: if False, the hand plays requested contacts only
        self.push: Push
        self._contact: Contact
        self._elapsed_s: float
        self._pusher: Callable[[float], Push]
        self._value: float  # force [N] or travel [mm]
        self._queue = [
            (phase.setpoint_kpa, contact) for phase in _or_demo(phases) for contact in phase.contacts
        ]
        self._position = 0  # index of the next contact in the queue
        self._repeat = repeat
        self._in_phase_contact = False  # False during a requested contact
        self._keeps_pressing = False  # True from a requested press until the release
        self._requested: deque[Contact] = deque()
        self._held_s = 0.0
        self._tool: MovedTool | None = None  # a robot holds the balloon, so the hand does not press
        self._start(REST)

    @property
    def setpoint_kpa(self) -> float:
        """Return the setpoint that the scenario requires now [kPa]."""
        return self._queue[min(self._position, len(self._queue) - 1)][0]

    @property
    def finished(self) -> bool:
        """Return True if all phases have been played. A hand that repeats its phases never finishes."""
        return self._position == len(self._queue)

    def press(self, force_n: float) -> None:
        """Press with `force_n` until the hand is released."""
        start_n = self.push.last_n
        self._request([])
        self._keeps_pressing = True
        self._start(Contact(Trajectory.of(smooth_change(start_n, force_n))))

    def release(self) -> None:
        """End the contact. A hand that plays phases then continues to play them."""
        self._request([])

    def play(self, contacts: Iterable[Contact]) -> None:
        """End the present contact and play `contacts` once. A hand that plays phases then continues."""
        self._request(contacts)

    def give_to_robot(self, tool: MovedTool) -> None:
        """Let a robot move the balloon until the next press, contact or release."""
        self._request([])
        self._tool = tool

    def move(self, speed_mm_per_s: float) -> bool:
        """Command the speed of the robot. Return False if no robot moves the balloon."""
        if self._tool is not None:
            self._tool.command(speed_mm_per_s)
        return self._tool is not None

    def step(self, held: bool, dt_s: float) -> Push:
        """Advance the time by `dt_s` and return the push. `held` is True if the board holds the balloon."""
        if self._tool is not None:
            self.push = self._tool.step(dt_s)
            return self.push
        self._held_s = self._held_s + dt_s if held else 0.0
        self._elapsed_s += dt_s
        if (
            self._in_phase_contact
            and not self._ready
            and self._elapsed_s < self._contact.trajectory.duration_s
        ):
            self._retract()
        elif self._elapsed_s >= self._contact.duration_s:
            self._start_next()
        self._value = self._contact.trajectory.at(self._elapsed_s)
        self.push = self._pusher(self._value)
        return self.push

    @property
    def _ready(self) -> bool:
        return self.plays_phases and self._held_s > READY_S

    def _start_next(self) -> None:
        if self._in_phase_contact:
            self._in_phase_contact = False
            self._advance()
        if self._requested:
            self._start(self._requested.popleft())
        elif self._ready and not self._keeps_pressing and not self.finished:
            self._in_phase_contact = True
            self._start(self._queue[self._position][1])

    def _advance(self) -> None:
        """Advance to the next contact. After a change of the setpoint, wait for the host to command it."""
        before_kpa = self.setpoint_kpa
        self._position += 1
        if self._repeat and self.finished:
            self._position = 0
        if self.setpoint_kpa != before_kpa:
            self._held_s = -UNCOMMANDED_S

    def _request(self, contacts: Iterable[Contact]) -> None:
        self._take_from_robot()
        self._requested = deque(contacts)
        self._keeps_pressing = False
        self._retract()

    def _take_from_robot(self) -> None:
        if self._tool is not None:
            force_n, self._tool = self.push.last_n, None
            self._start(REST)
            self._value = force_n

    def _retract(self) -> None:
        self._in_phase_contact = False
        to_zero = Trajectory.of(smooth_change(self._value, 0.0))
        self._contact = self._contact._replace(trajectory=to_zero, pause_s=0.0)
        self._elapsed_s = 0.0

    def _start(self, contact: Contact) -> None:
        self._contact, self._elapsed_s = contact, 0.0
        self._pusher = contact.pusher()
        self._value = contact.trajectory.at(0.0)
        self.push = self._pusher(self._value)


def _or_demo(phases: Sequence[Phase] | None) -> Sequence[Phase]:
    if phases is not None:
        return phases
    from pneuforce.sim.scenario import load

    return load("demo").phases
