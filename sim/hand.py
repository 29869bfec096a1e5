"""The simulated hand: plays the contacts of a scenario while the balloon is held, or what it is ordered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence

from sim.contacts.contact import Contact, Phase
from sim.contacts.course import Course, stay, stroke
from sim.contacts.push import Push

#: The hand waits until the balloon has been held for this long at the phase's setpoint.
READY_S = 1.0
#: How much longer, while nobody has yet commanded the setpoint of the next phase.
UNCOMMANDED_S = 1.0
REST = Contact(Course.of(stay(0.0, 1e-3)))


class Hand:
    """Plays phases in order, again and again or once. A contact that is broken off comes again."""

    def __init__(self, works: bool, phases: Sequence[Phase] | None = None, again: bool = True) -> None:
        """Without phases it plays those of the scenario `demo`."""
        self.works = works  #: whether it goes through its phases
        self.push: Push
        self._contact: Contact
        self._since_s: float
        self._pusher: Callable[[float], Push]
        self._value: float  # force [N] or travel [mm]
        self._turns = [
            (phase.setpoint_kpa, contact) for phase in _or_demo(phases) for contact in phase.contacts
        ]
        self._turn = 0
        self._again = again
        self._plays = False  # a contact of the phases, not an ordered one
        self._stays = False  # until released
        self._orders: deque[Contact] = deque()
        self._held_s = 0.0
        self._begin(REST)

    @property
    def setpoint_kpa(self) -> float:
        """What the scenario wants the balloon to be held at now."""
        return self._turns[min(self._turn, len(self._turns) - 1)][0]

    @property
    def finished(self) -> bool:
        """Whether all phases have been played, once."""
        return self._turn == len(self._turns)

    def press(self, force_n: float) -> None:
        """Press with `force_n` and stay there until released."""
        now_n = self.push.last_n
        self._order([])
        self._stays = True
        self._begin(Contact(Course.of(stroke(now_n, force_n))))

    def release(self) -> None:
        """Let go, and then go on with the phases if the hand works."""
        self._order([])

    def play(self, contacts: Iterable[Contact]) -> None:
        """Let go, play these once, and then go on with the phases if the hand works."""
        self._order(contacts)

    def step(self, held: bool, dt_s: float) -> Push:
        """The push `dt_s` later; `held` says whether the board holds the balloon now."""
        self._held_s = self._held_s + dt_s if held else 0.0
        self._since_s += dt_s
        if self._plays and not self._ready and self._since_s < self._contact.course.lasts_s:
            self._let_go()
        elif self._since_s >= self._contact.lasts_s:
            self._go_on()
        self._value = self._contact.course.at(self._since_s)
        self.push = self._pusher(self._value)
        return self.push

    @property
    def _ready(self) -> bool:
        return self.works and self._held_s > READY_S

    def _go_on(self) -> None:
        if self._plays:
            self._plays = False
            self._next_turn()
        if self._orders:
            self._begin(self._orders.popleft())
        elif self._ready and not self._stays and not self.finished:
            self._plays = True
            self._begin(self._turns[self._turn][1])

    def _next_turn(self) -> None:
        """Another setpoint takes its time: whoever commands the board has to follow."""
        before_kpa = self.setpoint_kpa
        self._turn += 1
        if self._again and self.finished:
            self._turn = 0
        if self.setpoint_kpa != before_kpa:
            self._held_s = -UNCOMMANDED_S

    def _order(self, contacts: Iterable[Contact]) -> None:
        self._orders = deque(contacts)
        self._stays = False
        self._let_go()

    def _let_go(self) -> None:
        self._plays = False
        self._contact = self._contact._replace(course=Course.of(stroke(self._value, 0.0)), pause_s=0.0)
        self._since_s = 0.0

    def _begin(self, contact: Contact) -> None:
        self._contact, self._since_s = contact, 0.0
        self._pusher = contact.pusher()
        self._value = contact.course.at(0.0)
        self.push = self._pusher(self._value)


def _or_demo(phases: Sequence[Phase] | None) -> Sequence[Phase]:
    if phases is not None:
        return phases
    from sim.scenario import load

    return load("demo").phases
