# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A seeded share of ``make fuzz``, and commands that have hung before."""

import sys
from collections import Counter
from pathlib import Path

import pytest
from fuzz_case import NUMBERS, SETTINGS, run_case
from fuzz_files import try_cache
from fuzz_stands import CHOICES, CONFIG, LAW_SPANS, SPANS, STANDS
from processes import run_process

from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.parameters import load_yaml, specs

SEEDS = (1, pytest.param(2, marks=pytest.mark.slow))
CASES = 50
GROUPS = ('actuator', 'amplifier', 'friction_law', 'interferometer', 'load_cell', 'runner')
NOT_DRAWN = {
    'amplifier.frequency_max',  # only refuses
    'amplifier.voltage_initial',  # follows from the range
    'amplifier.voltage_max',  # the stand 'bipolar'
    'amplifier.voltage_min',
    'friction_law.bristle_stiffness',  # 0 is that of the sticking contacts
}
DAMAGED = 60
"""Damaged files of each reader."""
LIMITED = 'ulimit -v 6000000; ulimit -t 120; exec "$0" "$@"'
COMMANDS_MIN = 30
"""Commands of each kind that the share holds, at least."""


def test_every_stage_profile_law_and_command_has_its_stand():
    drawn = SPANS.keys() | CHOICES.keys() | LAW_SPANS.keys()
    declared = {name for name in specs() if name.partition('.')[0] in GROUPS}
    assert declared - drawn == NOT_DRAWN
    assert set(CHOICES['contact.law']) == set(specs()['contact.law'].choices)
    assert set(CHOICES['contact.profile']) == set(specs()['contact.profile'].choices)
    assert {*NUMBERS, *SETTINGS, 'joint', 'trajectory'} == COMMANDS.keys()


@pytest.mark.parametrize('seed', SEEDS)
def test_random_real_valued_commands_end_stay_finite_and_repeat_on_every_stand(seed):
    commands: Counter[str] = Counter()
    problems = {}
    for stand in STANDS:
        outcome = run_case(stand, seed)
        commands += outcome.commands
        if outcome.problems:
            problems[stand] = outcome.problems
    assert not problems
    assert min(commands[name] for name in (*NUMBERS, *SETTINGS)) >= COMMANDS_MIN


def test_whatever_happens_to_a_file_of_the_kernel_cache_is_told():
    assert all(map(try_cache, range(CASES)))


def test_damaged_files_are_read_or_refused_in_a_line_by_each_reader():
    words = [sys.executable, Path(__file__).with_name('fuzz_files.py'), DAMAGED]
    done = run_process(['bash', '-c', LIMITED, *words])
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith('of each of 13 readers, 0 failed\n')


def test_a_fall_that_settles_within_rounding_of_its_aim_ends():
    stand, frequency_hz = load_yaml(CONFIG / 'realistic.yaml'), 1153.3955451232346
    run = simulate(
        stand, voltage_v=113.76725643485543, frequency_hz=frequency_hz, steps=50, record=False
    )
    assert run.result.steps == 50


def test_a_voltage_that_meets_a_command_too_steep_for_the_clock_to_tell_ends():
    assert run_case('actuator.capacitance', 1).problems == []
