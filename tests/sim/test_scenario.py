import itertools
import os

import pytest

from pneuforce.sim.scenario import ScenarioError, library, load

NOT_64_BITS = "at most 64 bits"
DOC = 'doc = "mine"\n'
FAULT = "[[fault]]\nat_s = 1.0\n"
CONTACT = '\n[[phase]]\nsetpoint_kpa = 8.0\n[[phase.contact]]\nkind = "tap"\nforce_n = 1.0\n'


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


def forces(contact):
    return [contact.trajectory.at(n * 0.002) for n in range(round(contact.duration_s / 0.002))]


def peaks(phase):
    return [max(forces(contact)) for contact in phase.contacts]


@pytest.mark.parametrize("name", library())
def test_every_scenario_of_the_library_loads_and_has_a_description_of_one_line(name):
    scenario = load(name)
    assert scenario.doc == library()[name]
    assert "\n" not in scenario.doc
    assert all(phase.contacts for phase in scenario.phases)


def test_the_library_has_the_campaign_of_the_paper():
    phases = load("campaign").phases
    assert [phase.setpoint_kpa for phase in phases] == pytest.approx([4.95 + 0.25 * n for n in range(27)])
    assert all(peaks(phase) == pytest.approx([0.2 + 0.3 * n for n in range(12)]) for phase in phases)


def test_only_scenarios_that_require_a_rise_time_or_frequency_exceed_10_n_per_second():
    fast = set()
    for name in library():
        contacts = [c for phase in load(name).phases for c in phase.contacts if c.tissue is None]
        if any(abs(b - a) > 10.01 * 0.002 for c in set(contacts) for a, b in itertools.pairwise(forces(c))):
            fast.add(name)
    assert fast == {"taps", "tremor", "sweep"}


def test_a_phase_of_several_setpoints_repeats_its_contacts_at_each(tmp_path):
    text = CONTACT.replace("8.0", "{ from = 6.0, to = 7.0, step = 0.5 }\nrepeat = 2")
    phases = load(written(tmp_path, DOC + text)).phases
    assert [(phase.setpoint_kpa, len(phase.contacts)) for phase in phases] == [(6.0, 2), (6.5, 2), (7.0, 2)]


def test_a_scenario_sets_plant_circuit_sensor_and_faults(tmp_path):
    scenario = load(
        written(
            tmp_path,
            DOC + 'seed = 7\n[plant]\nkind = "membrane"\nsides = 2\n[pneumatics]\nleak_kpa_per_s = 0.01\n'
            '[sensor]\nzero_offset_kpa = -0.2\n[[fault]]\nat_s = 30\nname = "leak"\nkpa_per_s = 0.02\n'
            + CONTACT,
        )
    )
    assert (scenario.seed, scenario.plant.kind, scenario.plant.sides) == (7, "membrane", 2)
    assert scenario.pneumatics.leak_kpa_per_s == 0.01
    assert scenario.sensor.zero_offset_kpa == -0.2
    [fault] = scenario.fault
    assert (fault.at_s, fault.name, fault.model_extra) == (30, "leak", {"kpa_per_s": 0.02})


@pytest.mark.parametrize(("text", "value"), [('"stick"', "stick"), ("0.25", 0.25), ("1", 1)])
def test_a_scenario_sets_the_contact_of_the_membrane(tmp_path, text, value):
    plant = f'[plant]\nkind = "membrane"\nmaterial = "gent"\ncontact = {text}\n'
    scenario = load(written(tmp_path, DOC + plant + CONTACT))
    assert (scenario.plant.material, scenario.plant.contact) == ("gent", value)


def test_a_recorded_force_is_read_from_the_folder_of_the_scenario(tmp_path):
    (tmp_path / "palpation.csv").write_text("t_s,force_n\n0,0\n1,2.5\n2,0\n")
    text = CONTACT.replace('"tap"\nforce_n = 1.0', '"profile"\nfile = "palpation.csv"')
    assert peaks(load(written(tmp_path, DOC + text)).phases[0]) == pytest.approx([2.5])


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("doc = ", "not TOML"),
        (DOC, "phase: is missing"),
        (CONTACT, "doc: is missing"),
        (DOC + 'speed = 2' + CONTACT, "speed: unknown key; known here: doc, seed, plant"),
        (DOC + 'seed = -1' + CONTACT, "seed = -1: input should be greater than or equal to 0"),
        (DOC + '[plant]\nkind = "steel"' + CONTACT, "plant, kind = 'steel': input should be 'published' or"),
        (DOC + '[plant]\nsides = 3' + CONTACT, "plant, sides = 3: input should be 1 or 2"),
        (DOC + '[plant]\ncontact = "glue"' + CONTACT, "plant, contact = 'glue': slide, stick or a number"),
        (DOC + '[plant]\ncontact = 1.01' + CONTACT, "plant, contact = 1.01: slide, stick or a number"),
        (DOC + '[plant]\ncontact = nan' + CONTACT, "plant, contact = nan: slide, stick or a number"),
        (DOC + '[plant]\ncontact = true' + CONTACT, "plant, contact = True: slide, stick or a number"),
        (DOC + '[pneumatics]\nleek = 2' + CONTACT, "pneumatics: leek: unknown key; known here: "),
        (DOC + '[pneumatics]\ntube_time_constant_s = "slow"' + CONTACT, "_s = 'slow': a number"),
        (DOC + '[pneumatics]\ntube_time_constant_s = nan' + CONTACT, "tube_time_constant_s = nan: a number"),
        (DOC + '[pneumatics]\ntube_time_constant_s = -1' + CONTACT, "tube_time_constant_s is -1, "),
        (DOC + f"[pneumatics]\ntube_time_constant_s = 1{400 * '0'}" + CONTACT, NOT_64_BITS),
        (DOC + f"[sensor]\nbow_kpa = 1{5000 * '0'}" + CONTACT, "a number with thousands of digits"),
        (DOC + f"seed = 0x{5000 * 'f'}" + CONTACT, NOT_64_BITS),
        (DOC + CONTACT.replace("8.0", f"[8, -1{300 * '0'}]"), NOT_64_BITS),
        (DOC + "[sensor]\nbow_kpa = 1e308" + CONTACT, "allows 1.25 kPa"),
        ("doc = " + 100_000 * "[", "not TOML: brackets"),
        ("doc = " + 300 * "[" + 300 * "]" + CONTACT, "doc = [[[[[[[["),
        (DOC + '[[fault]]\nname = "leak"' + CONTACT, "fault 1, at_s: is missing"),
        (DOC + FAULT + 'name = "gremlin"' + CONTACT,
            "fault 1: there is no fault 'gremlin': pneuforce sim fault --list"),
        (DOC + FAULT + 'name = "leak"\nkpa_per_s = -1' + CONTACT, "kpa_per_s of leak must be a number from "),
        (DOC + FAULT + 'name = "leak"\nlitres = 1' + CONTACT, "leak takes kpa_per_s, not 'litres'"),
        (DOC + CONTACT.replace("8.0", "13"), "phase 1, setpoint_kpa = 13: "),
        (DOC + CONTACT.replace("1.0", "21"), "less than or equal to 20; allowed: 0 to 20"),
        (DOC + CONTACT + "hurry = 1", "contact 1, tap, hurry: unknown key; known"),
        (DOC + CONTACT.replace("tap", "pat"), "phase 1, contact 1, kind = 'pat': unknown value"),
        (DOC + CONTACT.replace('"tap"\nforce_n = 1.0', '"profile"\nfile = "no.csv"'), "no.csv: no such file"),
    ],
)  # fmt: skip
def test_an_invalid_file_is_rejected_with_file_key_and_range(tmp_path, text, fact):
    path = written(tmp_path, text)
    with pytest.raises(ScenarioError) as error:
        load(path)
    assert all(line.startswith(f"{path}: ") for line in str(error.value).splitlines())
    assert fact in str(error.value)


@pytest.mark.parametrize("special", ["/dev/zero", "/dev/full", "./pipe"])
def test_special_files_are_read_neither_as_a_scenario_nor_as_a_recorded_force(tmp_path, monkeypatch, special):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    with pytest.raises(ScenarioError, match=r"^[a-z/]+: cannot be read: not a regular file$"):
        load(special)
    profile = CONTACT.replace('"tap"\nforce_n = 1.0', f'"profile"\nfile = "{special}"')
    with pytest.raises(ScenarioError, match=r"profile, file = .*: cannot be read: not a regular file"):
        load(written(tmp_path, DOC + profile))


def test_an_unknown_scenario_is_rejected_with_the_known_names():
    with pytest.raises(ScenarioError, match=r"'palpate'.*campaign, .*demo"):
        load("palpate")
    with pytest.raises(ScenarioError, match=r"mine\.toml: no such file"):
        load("mine.toml")
    with pytest.raises(ScenarioError, match="cannot be read"):
        load("./")
