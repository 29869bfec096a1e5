import itertools

import pytest

from pneuforce.sim.contacts.kinds import CONTACT_TABLES
from pneuforce.sim.scenario import ScenarioError, contacts_of

DT_S = 0.002
SPRING = {"law": "linear", "stiffness_n_per_mm": 1}
MINIMAL_KEYS = {
    "press": {"force_n": 2.0},
    "hold": {"force_n": 2.0},
    "tap": {"force_n": 2.0},
    "fast": {"force_n": [2.0, 1.5, 2.5]},
    "tremor": {"force_n": 2.0},
    "sine": {"force_n": 2.0, "amplitude_n": 0.5, "frequency_hz": 1.0},
    "chirp": {"force_n": 2.0, "amplitude_n": 0.5, "from_hz": 0.5, "to_hz": 3.0},
    "ramp": {"force_n": 2.0},
}


def forces_of(table):
    """Return the forces [N] of one contact, including the pause."""
    [contact] = contacts_of(table)
    return [contact.trajectory.at(n * DT_S) for n in range(round(contact.duration_s / DT_S) + 2)]


def forces(kind, **keys):
    return forces_of({"kind": kind, **MINIMAL_KEYS[kind], **keys})


def test_every_kind_except_the_profile_is_tested_here():
    assert CONTACT_TABLES.keys() - MINIMAL_KEYS.keys() == {"profile"}


@pytest.mark.parametrize("kind", MINIMAL_KEYS)
def test_a_contact_starts_and_ends_at_zero_and_never_pulls_or_jumps(kind):
    forces_n = forces(kind)
    assert forces_n[0] == 0
    assert forces_n[-1] == 0
    assert min(forces_n) >= 0
    steepest = max(abs(b - a) for a, b in itertools.pairwise(forces_n)) / DT_S
    assert steepest <= 10.01


@pytest.mark.parametrize("kind", MINIMAL_KEYS)
def test_a_contact_reaches_its_force_and_is_followed_by_its_pause(kind):
    forces_n = forces(kind, pause_s=2.0)
    assert max(forces_n) >= 2.0 - 1e-6
    assert all(force_n == 0 for force_n in forces_n[-990:])


def test_press_hold_and_tap_differ_in_the_duration_of_their_plateau():
    plateaus_s = [sum(force_n == 2.0 for force_n in forces(kind)) * DT_S for kind in ("tap", "press", "hold")]
    assert plateaus_s == pytest.approx([0.05, 1.5, 10.0], abs=0.02)


def test_the_force_between_fast_contacts_falls_to_the_fraction_eased():
    forces_n = forces("fast", eased=0.2)
    troughs = [
        b for a, b, c in zip(forces_n, forces_n[1:], forces_n[2:], strict=False) if a > b <= c and b > 0
    ]
    assert troughs == pytest.approx([0.4, 0.3], abs=0.01)


@pytest.mark.parametrize("hz", [8.0, 10.0, 12.0])
def test_a_tremor_oscillates_at_its_frequency_around_its_force(hz):
    forces_n = forces("tremor", frequency_hz=hz, amplitude_n=0.2, lasts_s=10.0)
    periods = sum(a < 2.0 <= b for a, b in itertools.pairwise(forces_n))
    assert periods == pytest.approx(10 * hz, abs=1.5)
    assert max(forces_n) == pytest.approx(2.2, abs=0.01)


def test_a_ramp_rises_at_its_rate():
    forces_n = forces("ramp", rate_n_per_s=0.5)
    assert forces_n[500] == pytest.approx(0.5)
    assert forces_n[1500] == pytest.approx(1.5)


@pytest.mark.parametrize(("angle_deg", "share"), [(0, 1.0), (60, 0.5)])
def test_only_the_axial_part_of_an_oblique_force_presses(angle_deg, share):
    [contact] = contacts_of({"kind": "press", "force_n": 2.0, "angle_deg": angle_deg})
    push = contact.pusher()(2.0)
    assert push.force_n(lambda force_n: 0.0) == pytest.approx(2.0 * share)
    assert push.force_n(lambda force_n: 0.0) / push.cosine == pytest.approx(2.0)


def test_a_list_or_a_range_gives_one_contact_for_each_value():
    for force_n in ([1.0, 1.5, 2.0], {"from": 1.0, "to": 2.0, "step": 0.5}):
        contacts = contacts_of({"kind": "tap", "force_n": force_n})
        assert [max(c.trajectory.at(n * DT_S) for n in range(500)) for c in contacts] == [1.0, 1.5, 2.0]


@pytest.mark.parametrize(
    ("table", "fact"),
    [
        ({}, "the table: a table with the key kind is expected"),
        ({"kind": "kick"}, "kind = 'kick': unknown value; allowed: 'press', 'hold'"),
        ({"kind": "tap", "force_n": 25}, "tap, force_n = 25: input should be less than or equal to 20"),
        ({"kind": "tap", "force_n": [1, -1]}, "tap, force_n = -1: input should be greater"),
        ({"kind": "tap", "force_n": "2"}, "tap, force_n = '2': input should be a valid number"),
        ({"kind": "tap", "force_n": True}, "tap, force_n = True: input should be a valid number"),
        ({"kind": "tap", "force_n": float("nan")}, "tap, force_n = nan: input should be a finite number"),
        ({"kind": "tap", "force_n": []}, "tap, force_n = []"),
        ({"kind": "tap", "force_n": {"from": 1, "to": 2}}, "{from = …, to = …, step = …} is expected"),
        ({"kind": "tap", "force_n": {"from": 1, "to": 2, "step": 0.3}}, "the number of steps"),
        ({"kind": "tap", "force_n": {"from": 0, "to": 9, "step": 1e-9}}, "the number of steps"),
        ({"kind": "tap", "force_n": {"from": 2, "to": 1, "step": 0.5}}, "the number of steps"),
        ({"kind": "tap", "force_n": 1, "hurry": 1}, "tap, hurry: unknown key; known here: "),
        ({"kind": "tap"}, "tap: either force_n or travel_mm"),
        ({"kind": "tap", "force_n": 1, "travel_mm": 1}, "tap: either force_n or travel_mm"),
        ({"kind": "tap", "force_n": 1, "tissue": SPRING}, "tissue requires travel_mm"),
        ({"kind": "tap", "travel_mm": 1, "angle_deg": 5}, "angle_deg requires force_n"),
        ({"kind": "tap", "travel_mm": 1, "tissue": {"law": "jelly"}}, "law = 'jelly': unknown value"),
        ({"kind": "tap", "travel_mm": 1, "tissue": {"law": "hertz"}}, "hertz, modulus_kpa: is missing"),
        ({"kind": "tap", "force_n": 1, "rise_s": 0}, "allowed: 0.01 to 3600"),
        ({"kind": "tremor", "force_n": 1, "frequency_hz": 5}, "allowed: 8 to 12"),
        ({"kind": "tremor", "force_n": 0.05}, "amplitude_n = 0.1"),
        ({"kind": "profile", "file": "x.csv"}, "in a scenario file only"),
    ],
)  # fmt: skip
def test_an_invalid_table_is_rejected_with_key_and_range(table, fact):
    with pytest.raises(ScenarioError) as error:
        contacts_of(table)
    assert fact in str(error.value)
    assert "\n" not in str(error.value)
