from registers.can.patience import REFUSED_S, Patience


def test_patience_ends_after_a_second_of_refusals_and_only_once():
    patience = Patience()
    ends_s = [step / 10 for step in range(40) if patience.refused(step / 10)]
    assert ends_s == [REFUSED_S]
    assert patience.ended


def test_a_frame_taken_gives_new_patience():
    patience = Patience()
    patience.refused(0.0)
    assert not patience.taken()
    assert not patience.refused(2.0)
    assert not patience.ended
    assert patience.refused(3.0)
    assert patience.taken()
    assert not patience.ended
    assert not patience.taken()
