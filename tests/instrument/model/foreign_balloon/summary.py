"""Summary of the table of pressed balloons: `python -m tests.instrument.model.foreign_balloon.summary`.

The first part compares the table with a thin membrane. The second part prints the share of sticking that
belongs to each friction coefficient: 0 if the rise is that without friction, 1 if the rise is that with
friction 1.
"""

import csv
from collections import defaultdict
from pathlib import Path

PRESSED = Path(__file__).parent / "pressed_balloons.csv"
FREE = Path(__file__).parent / "free_radii.csv"
#: Rise of a thin membrane of the law `mooney-rivlin`, pressed from one side:
#: {(baseline in kPa, friction): {force in N: rise in kPa}}.
MEMBRANE_RISES_KPA = {
    (8.0, 0.0): {0.5: 0.422, 1.0: 0.980, 2.0: 2.213},
    (11.0, 0.0): {0.5: 0.387, 1.0: 0.832, 2.0: 1.740, 3.0: 2.570},
    (8.0, 1.0): {1.0: 0.81},
    (11.0, 1.0): {2.0: 1.43},
}
SHARE_FORCES_N = (1.0, 2.0, 3.0)


def table(path):
    """Return the rows of a table, with numbers instead of texts."""

    def number(text):
        try:
            return float(text)
        except ValueError:
            return text

    with path.open(encoding="utf-8", newline="") as file:
        return [{name: number(text) for name, text in row.items()} for row in csv.DictReader(file)]


def rises_kpa(rows):
    """Return the rise in kPa over (law, baseline, sides, gas exponent, friction) and force in N."""
    found = defaultdict(dict)
    for row in rows:
        key = row["law"], row["baseline_kpa"], row["sides"], row["gas_exponent"], row["friction"]
        found[key][row["force_n"]] = row["final_kpa"] - row["baseline_kpa"]
    return found


def sticking_share(rises, key, force_n):
    """Return the position of a rise between those without friction (0) and with friction 1 (1)."""
    free, stuck = (rises[(*key[:-1], friction)][force_n] for friction in (0.0, 1.0))
    return (free - rises[key][force_n]) / (free - stuck)


def main():
    """Print both parts."""
    rises = rises_kpa(table(PRESSED))
    for (baseline_kpa, friction), membrane in MEMBRANE_RISES_KPA.items():
        for force_n, membrane_kpa in membrane.items():
            rise_kpa = rises["mooney-rivlin", baseline_kpa, 1.0, 1.0, friction][force_n]
            change = f"{100 * (rise_kpa / membrane_kpa - 1):+.1f} %"
            print(f"{baseline_kpa:g} kPa, friction {friction:g}, {force_n:g} N: {rise_kpa:.4f} kPa,", end=" ")
            print(f"membrane {membrane_kpa:.3f} kPa, {change}")
    print(f"share of sticking at {SHARE_FORCES_N} N")
    for key in sorted(rises):
        law, baseline_kpa, sides, exponent, friction = key
        if 0 < friction < 1 and exponent == 1:
            shares = [f"{sticking_share(rises, key, force_n):.2f}" for force_n in SHARE_FORCES_N]
            print(f"{law}, {baseline_kpa:g} kPa, {sides:g} side(s), friction {friction:g}:", *shares)


if __name__ == "__main__":
    main()
