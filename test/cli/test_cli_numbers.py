"""Numbers as the project writes them are understood, also negative ones."""

import json

import pytest

from stickslip_ros.cli.main import main


def test_a_negative_frequency_in_e_notation_goes_backwards(capsys: pytest.CaptureFixture[str]):
    words = ['simulate', '--amplitude', '160e-9', '--frequency', '-1e3', '--steps', '5', '--json']
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)['force_mean_n'] < 0.0


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['simulate', '--amplitude', '-1e-7'], 'amplitude -1e-07 m is below the minimum 0 m'),
        (['contact', '--normal-force', '-1e-3'], 'normal force -0.001 N is not above 0 N'),
        (['contact', '--normal-force', 'inf'], 'normal force inf N is not finite'),
        (['contact', '--normal-force', '1e9'], 'beyond the radius of the sphere'),
    ],
)
def test_a_number_out_of_range_is_refused_in_the_unit_in_which_it_was_given(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
):
    assert main(words) == 2
    assert said in capsys.readouterr().err


def test_the_node_takes_further_words_only_behind_ros_args(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit):
        main(['drive', '--frobnicate'])
    assert 'unrecognized arguments: --frobnicate' in capsys.readouterr().err
