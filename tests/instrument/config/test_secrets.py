"""Tests that the operator's token is in no message, whatever is wrong with the configuration."""

import json

import pytest

from pneuforce.errors import ConfigurationError, ConfigurationFileError
from pneuforce.instrument.cli.config_check import check_config
from pneuforce.instrument.cli.exit_codes import ExitCode
from pneuforce.instrument.cli.failure import failure_values
from pneuforce.instrument.config import load, parse
from pneuforce.instrument.service.stream_header import stream_header

SECRET = "hunter2"
WRONG_TOKENS = [
    '[web]\ntoken = "hunter2"',  # too short
    '[web]\ntoken = "hunter2 hunter2\\n"',
    '[web]\ntoken = "hunter2 hunter2"\nport = 0',
    '[web]\ntoken = ["hunter2"]',
    '[web]\ntoken = {value = "hunter2"}',
    '[web.token]\nhunter = "hunter2"',
    'web = "hunter2"',
    'web = ["hunter2"]',
    '[[web]]\ntoken = "hunter2 hunter2"',
    '[web]\ntokens = "hunter2 hunter2"',
    '[web]\nhost = "0.0.0.0"\ntoken = "hunter2 hunter2"',
    '[page]\ntoken = "hunter2"',
    'token = "hunter2"',
    "[web]\ntoken = hunter2",
    '[web]\ntoken = "hunter2',
    '[web]\ntoken = "hunter2"\ntoken = "hunter2"',
    '[web]\n"hunter2 hunter2"',
]


@pytest.mark.parametrize("text", WRONG_TOKENS)
def test_no_message_about_a_configuration_contains_the_token(text, tmp_path, capsys):
    path = tmp_path / "instrument.toml"
    path.write_text(text)
    with pytest.raises(ConfigurationError) as caught:
        load(path)
    with pytest.raises(ConfigurationFileError) as checked:
        check_config([path], as_json=True)
    failure = failure_values(checked.value)
    assert failure["exit_code"] == ExitCode.CONFIGURATION
    printed = [str(caught.value), repr(caught.value), json.dumps(failure), capsys.readouterr().out]
    assert not [line for line in printed if SECRET in line]


def test_a_token_that_is_a_number_is_not_printed():
    with pytest.raises(ConfigurationError, match=r"web\.token") as caught:
        parse({"web": {"token": 271828182845}}, "test")
    assert "271828" not in str(caught.value)


def test_a_configuration_contains_its_token_only_masked():
    configuration = parse({"web": {"token": "hunter2 hunter2"}}, "test")
    shown = (repr(configuration), str(configuration), configuration.model_dump_json(), configuration.warning)
    assert not [text for text in shown if SECRET in text]


def test_the_header_for_web_pages_and_recordings_masks_the_token():
    configuration = parse({"web": {"token": "hunter2 hunter2"}}, "test")
    assert SECRET not in json.dumps(stream_header(configuration, True, ()))
