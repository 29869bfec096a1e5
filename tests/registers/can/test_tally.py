from registers.can.tally import PERIOD_S, Tally


def counts(unsent=0, errors=0):
    return {"frames not sent": unsent, "error frames": errors}


def test_a_bus_without_trouble_is_silent():
    tally = Tally()
    assert [tally.line(counts(), now_s) for now_s in range(200)] == 200 * [""]


def test_the_first_trouble_is_told_at_once_and_what_follows_once_a_minute():
    tally = Tally()
    told = [(now_s, tally.line(counts(unsent=3 * (now_s + 1)), now_s)) for now_s in range(150)]
    assert [(now_s, line) for now_s, line in told if line] == [
        (0, "frames not sent 3"),
        (round(PERIOD_S), "frames not sent 180"),
        (round(2 * PERIOD_S), "frames not sent 180"),
    ]


def test_a_line_names_what_has_come_and_nothing_else():
    tally = Tally()
    tally.line(counts(unsent=5), 0.0)
    assert tally.line(counts(unsent=5, errors=2), 1.0) == ""
    assert tally.line(counts(unsent=5, errors=2), 61.0) == "error frames 2"
    assert tally.line(counts(unsent=6, errors=4), 200.0) == "frames not sent 1, error frames 2"
