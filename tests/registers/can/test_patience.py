from registers.can.patience import REFUSED_S, Patience


def test_patience_ends_after_a_second_of_refusals_and_is_told_once():
    patience = Patience()
    told_s = [step / 10 for step in range(40) if patience.refused(step / 10)]
    assert told_s == [REFUSED_S]
    assert patience.has_ended(4.0)


def test_a_frame_taken_gives_new_patience():
    patience = Patience()
    patience.refused(0.0)
    assert not patience.taken()
    assert not patience.refused(2.0)
    assert not patience.has_ended(2.9)
    assert patience.refused(3.0)
    assert patience.taken()
    assert not patience.has_ended(3.0)


def test_a_controller_that_refuses_nothing_is_never_lost():
    assert not Patience().has_ended(1e9)
