import itertools

import pytest

from sim.contacts.kinds import KINDS
from sim.scenario import ScenarioError, contacts_of

DT_S = 0.002
SPRING = {"law": "linear", "stiffness_n_per_mm": 1}
LEAST = {
    "press": {"force_n": 2.0},
    "hold": {"force_n": 2.0},
    "tap": {"force_n": 2.0},
    "fast": {"force_n": [2.0, 1.5, 2.5]},
    "tremor": {"force_n": 2.0},
    "sine": {"force_n": 2.0, "amplitude_n": 0.5, "frequency_hz": 1.0},
    "chirp": {"force_n": 2.0, "amplitude_n": 0.5, "from_hz": 0.5, "to_hz": 3.0},
    "ramp": {"force_n": 2.0},
}


def course(table):
    """Forces [N] of one contact, pause included."""
    [contact] = contacts_of(table)
    return [contact.course.at(n * DT_S) for n in range(round(contact.lasts_s / DT_S) + 2)]


def values(kind, **keys):
    return course({"kind": kind, **LEAST[kind], **keys})


def test_every_kind_that_needs_no_file_is_tried_here():
    assert KINDS.keys() - LEAST.keys() == {"profile"}


@pytest.mark.parametrize("kind", LEAST)
def test_a_contact_begins_and_ends_without_force_never_pulls_and_never_jumps(kind):
    forces_n = values(kind)
    assert forces_n[0] == 0
    assert forces_n[-1] == 0
    assert min(forces_n) >= 0
    steepest = max(abs(b - a) for a, b in itertools.pairwise(forces_n)) / DT_S
    assert steepest <= 10.01


@pytest.mark.parametrize("kind", LEAST)
def test_a_contact_reaches_the_force_that_is_stated_and_is_followed_by_its_pause(kind):
    forces_n = values(kind, pause_s=2.0)
    assert max(forces_n) >= 2.0 - 1e-6
    assert all(force_n == 0 for force_n in forces_n[-990:])


def test_a_press_a_hold_and_a_tap_differ_in_how_long_they_stay():
    stays = [sum(force_n == 2.0 for force_n in values(kind)) * DT_S for kind in ("tap", "press", "hold")]
    assert stays == pytest.approx([0.05, 1.5, 10.0], abs=0.02)


def test_fast_contacts_overlap_the_force_between_them_is_what_eased_says():
    forces_n = values("fast", eased=0.2)
    troughs = [
        b for a, b, c in zip(forces_n, forces_n[1:], forces_n[2:], strict=False) if a > b <= c and b > 0
    ]
    assert troughs == pytest.approx([0.4, 0.3], abs=0.01)


@pytest.mark.parametrize("hz", [8.0, 10.0, 12.0])
def test_a_tremor_trembles_at_its_frequency_around_its_force(hz):
    forces_n = values("tremor", frequency_hz=hz, amplitude_n=0.2, lasts_s=10.0)
    turns = sum(a < 2.0 <= b for a, b in itertools.pairwise(forces_n))
    assert turns == pytest.approx(10 * hz, abs=1.5)
    assert max(forces_n) == pytest.approx(2.2, abs=0.01)


def test_a_ramp_rises_at_its_rate():
    forces_n = values("ramp", rate_n_per_s=0.5)
    assert forces_n[500] == pytest.approx(0.5)
    assert forces_n[1500] == pytest.approx(1.5)


@pytest.mark.parametrize(("angle_deg", "share"), [(0, 1.0), (60, 0.5)])
def test_of_an_oblique_force_the_part_along_the_axis_presses(angle_deg, share):
    [contact] = contacts_of({"kind": "press", "force_n": 2.0, "angle_deg": angle_deg})
    push = contact.pusher()(2.0)
    assert push.force_n(lambda force_n: 0.0) == pytest.approx(2.0 * share)
    assert push.force_n(lambda force_n: 0.0) / push.cosine == pytest.approx(2.0)


def test_a_list_or_a_span_makes_a_contact_of_each_value():
    for force_n in ([1.0, 1.5, 2.0], {"from": 1.0, "to": 2.0, "step": 0.5}):
        contacts = contacts_of({"kind": "tap", "force_n": force_n})
        assert [max(c.course.at(n * DT_S) for n in range(500)) for c in contacts] == [1.0, 1.5, 2.0]


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({}, "the table: a table with the key kind is expected"),
        ({"kind": "kick"}, "the table, kind = 'kick': allowed: 'press', 'hold'"),
        ({"kind": "tap", "force_n": 25}, "tap, force_n = 25: input should be less than or equal to 20"),
        ({"kind": "tap", "force_n": [1, -1]}, "tap, force_n = -1: input should be greater"),
        ({"kind": "tap", "force_n": "2"}, "tap, force_n = '2': input should be a valid number"),
        ({"kind": "tap", "force_n": True}, "tap, force_n = True: input should be a valid number"),
        ({"kind": "tap", "force_n": float("nan")}, "tap, force_n = nan: input should be a finite number"),
        ({"kind": "tap", "force_n": []}, "tap, force_n = []"),
        ({"kind": "tap", "force_n": {"from": 1, "to": 2}}, "{from = …, to = …, step = …} is expected"),
        ({"kind": "tap", "force_n": {"from": 1, "to": 2, "step": 0.3}}, "no whole number of steps"),
        ({"kind": "tap", "force_n": {"from": 0, "to": 9, "step": 1e-9}}, "no whole number of steps"),
        ({"kind": "tap", "force_n": {"from": 2, "to": 1, "step": 0.5}}, "no whole number of steps"),
        ({"kind": "tap", "force_n": 1, "hurry": 1}, "tap, hurry: unknown key; known here: "),
        ({"kind": "tap"}, "tap: either force_n or travel_mm is expected"),
        ({"kind": "tap", "force_n": 1, "travel_mm": 1}, "tap: either force_n or travel_mm is expected"),
        ({"kind": "tap", "force_n": 1, "tissue": SPRING}, "tissue goes with travel_mm"),
        ({"kind": "tap", "travel_mm": 1, "angle_deg": 5}, "angle_deg goes with force_n"),
        ({"kind": "tap", "travel_mm": 1, "tissue": {"law": "jelly"}}, "law = 'jelly': allowed: 'hertz'"),
        ({"kind": "tap", "travel_mm": 1, "tissue": {"law": "hertz"}}, "hertz, modulus_kpa: is missing"),
        ({"kind": "tap", "force_n": 1, "rise_s": 0}, "allowed: 0.01 to 3600"),
        ({"kind": "tremor", "force_n": 1, "frequency_hz": 5}, "allowed: 8 to 12"),
        ({"kind": "tremor", "force_n": 0.05}, "amplitude_n = 0.1 would pull"),
        ({"kind": "profile", "file": "x.csv"}, "a recorded course belongs into a scenario file"),
    ],
)  # fmt: skip
def test_a_bad_table_is_refused_in_a_sentence_with_key_and_span(table, sentence):
    with pytest.raises(ScenarioError) as refused:
        contacts_of(table)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)
