"""Breadth-first search over all sequences of events, until no new state appears."""

from __future__ import annotations

import logging
from array import array
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from pneuforce.instrument.core import state as state_module
from tests.rules.rules import RULES, History, history_after
from tests.rules.searches import Search
from tests.rules.state_key import key_of, world_of
from tests.rules.world import DELAY_S, World

#: Name of the condition that is checked at the end, on the graph of all states.
NO_DEAD_END = "each_state_leads_back_to_a_held_balloon"
PROGRESS = 1000  #: number of states between two reports of progress

Event = tuple[str, str]
State = tuple[Hashable, History]


class Finding(NamedTuple):
    """A rule that does not hold, and the shortest sequence of events that shows it."""

    rule: str
    events: tuple[Event, ...]


class Result(NamedTuple):
    """Result of a search. The depth is the largest number of events that leads to a new state."""

    states: int
    changes: int
    depth: int
    finding: Finding | None


def explore(
    search: Search,
    rule: str = "",
    report: Callable[[int, int], None] = lambda states, waiting: None,
) -> Result:
    """Return the result of a search. It ends at the first rule that does not hold.

    With `rule`, only the rule with this name is checked. `report` receives the number of states that were
    found, and of states that are not yet examined.
    """
    with _abstract_time():
        return _Exploration(search, rule, report).run()


@contextmanager
def _abstract_time() -> Iterator[None]:
    delay_s, level = state_module.MAX_VENT_DELAY_S, logging.root.manager.disable
    state_module.MAX_VENT_DELAY_S = DELAY_S
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        state_module.MAX_VENT_DELAY_S = delay_s
        logging.disable(level)


class _Exploration:
    def __init__(self, search: Search, rule: str, report: Callable[[int, int], None]) -> None:
        self.events = search.events()
        self.rules = [checked for checked in RULES if rule in ("", checked.__name__)]
        self.report = report
        self.numbers: dict[State, int] = {}
        self.reached_by: list[tuple[int, int]] = []  # number of the state before, and of the event
        self.next_states: list[array[int]] = []
        self.held: list[int] = []
        self.changes = 0
        self.waiting: deque[tuple[State, int]] = deque()

    def run(self) -> Result:
        start = World()
        start.apply("wait", "")
        self._number_of((key_of(start), History()), (-1, -1), 0)
        depth = 0
        while self.waiting:
            state, depth = self.waiting.popleft()
            finding = self._examine(state, depth)
            if finding:
                return self._result(depth, finding)
        dead_ends = self._dead_ends()
        return self._result(depth, Finding(NO_DEAD_END, self._path_to(dead_ends[0])) if dead_ends else None)

    def _result(self, depth: int, finding: Finding | None) -> Result:
        return Result(len(self.numbers), self.changes, depth, finding)

    def _examine(self, state: State, depth: int) -> Finding | None:
        """Apply each event to one state. Return the first finding, or None."""
        number, next_states = self.numbers[state], array("l")
        for index, event in enumerate(self.events):
            world, history = world_of(state[0]), state[1]
            for change in world.apply(*event):
                self.changes += 1
                for rule in self.rules:
                    if not rule(change, history):
                        return Finding(rule.__name__, (*self._path_to(number), event))
                history = history_after(history, change)
            next_states.append(self._number_of((key_of(world), history), (number, index), depth + 1))
        self.next_states.append(next_states)
        if len(self.next_states) % PROGRESS == 0:
            self.report(len(self.numbers), len(self.waiting))
        return None

    def _number_of(self, state: State, reached_by: tuple[int, int], depth: int) -> int:
        number = self.numbers.setdefault(state, len(self.numbers))
        if number == len(self.reached_by):
            self.reached_by.append(reached_by)
            self.waiting.append((state, depth))
            if _is_held(state[0]):
                self.held.append(number)
        return number

    def _path_to(self, number: int) -> tuple[Event, ...]:
        events: list[Event] = []
        while (before := self.reached_by[number])[0] >= 0:
            number = before[0]
            events.append(self.events[before[1]])
        return tuple(reversed(events))

    def _dead_ends(self) -> list[int]:
        """Return the states from which no sequence of events leads to a held balloon."""
        before: list[list[int]] = [[] for _ in self.next_states]
        for number, next_states in enumerate(self.next_states):
            for following in set(next_states):
                before[following].append(number)
        alive, waiting = set(self.held), list(self.held)
        while waiting:
            new = [number for number in before[waiting.pop()] if number not in alive]
            alive.update(new)
            waiting += new
        return [number for number in range(len(self.next_states)) if number not in alive]


def _is_held(key: Any) -> bool:
    seen = world_of(key).seen()
    return seen.commands_hold and seen.is_filled and not seen.faults
