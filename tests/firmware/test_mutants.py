"""Tests of the mutation test of the firmware."""

from tests.firmware.mutants import ON_C, Tree


def test_the_contract_tests_can_be_collected_in_the_copy(tmp_path):
    done = Tree(tmp_path / "copy").run(*ON_C, "--collect-only")
    assert done.returncode == 0, done.stdout
    assert "test_board_limits.py" in done.stdout
