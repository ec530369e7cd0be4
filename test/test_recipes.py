# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recipes of CONTRIBUTING.md: each is followed in a copy of the package, in the files it names."""

import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import run_process

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = 'stickslip_ros'
PROBE = 'instrument/sensors/eddy_probe.py'
"""A new file; it is the capacitive probe under another name."""
DRAG = """
    drag: float = quantity(
        0.0, 'N s^2/m^2', 'drag', bounds=(0.0, 1e6), typical=4.0, from_zero=True,
        opposes=True, cause='a sail', assumed=0.2, resumable=True
    )
"""
STROKE = """\
    Topic('stroke', POINT_STAMPED, STREAM, 'displacement of the feet, m',
          pace='trace.period', overridable=STREAMED),
"""
PACKED_STROKE = """\
        if readings.time_ns % self._period_ns == 0:
            stroke_m = readings.truth[TRUTH.index('foot')]
            packed = pack_stamped(time_origin_ns + readings.time_ns, '', (stroke_m, 0.0, 0.0))
            yield Packed('stroke', readings.time_ns, packed)
"""
EDDY_PROBE = '''\
@dataclass(frozen=True)
class EddyProbeParameters(Checked):
    """The eddy probe."""

    enabled: bool = switch(False, 'install it')
    noise_density: float = quantity(0.0, 'm/sqrt(Hz)', 'white noise', bounds=(0.0, 1e-3))
    resolution: float = quantity(0.0, 'm', 'quantisation', bounds=(0.0, 1e-3))
    bandwidth: float = quantity(0.0, 'Hz', 'low-pass', bounds=(0.0, 1e7))


'''
EDDY_ROW = """\
    Sensor(EddyProbeParameters, 'position', 'eddy_position', 'm', 'stage',
           'eddy probe', 'position by eddy currents', 1.0),
"""
FIRM = """\
    if law.number == FIRM:
        steady_m *= 2.0
"""
RECIPES = {
    'parameter': [
        ('parameters/physics_groups.py', '\n\n@dataclass(frozen=True)\nclass AmplifierP', DRAG)
    ],
    'sensor': [
        ('parameters/sensors.py', 'SENSORS: tuple[', EDDY_PROBE),
        ('parameters/sensors.py', ')\n# fmt: on\n', EDDY_ROW),
        (PROBE, '', ''),
    ],
    'friction law': [
        ('parameters/physics_groups.py', ')\n"""The contact model and', ", 'firm'"),
        ('contact/laws.py', ' = range(len(LAWS))', ', FIRM'),
        ('contact/laws.py', '    if law.number != DAHL and law.static', FIRM),
    ],
    'topic that is published': [
        ('interface/topics.py', '    Topic(TRACE,', STROKE),
        ('interface/feed.py', '        if output.status != self.status:', PACKED_STROKE),
    ],
}
"""By recipe: a file, a text that stands in it once, and what is added in front of that."""
PROGRAM = """
import json, sys
import numpy as np
from stickslip_ros import Parameters, load_yaml, open_run, run_drive, simulate
from stickslip_ros.instrument.checkpoint import changed_stand
from stickslip_ros.lab.fitting.assumed import ASSUMED_SHARES, OPPOSING
from stickslip_ros.lab.fitting.free import Free, choose_free
from stickslip_ros.lab.fitting.missing import _TRIED
from stickslip_ros.lab.twin.health import _change_text

stand = load_yaml(sys.argv[1])
simulate(stand, amplitude_m=60e-9, frequency_hz=1050.0, steps=22, record=sys.argv[2])
_, [free], _ = choose_free(Parameters(), [Free('runner.drag')])
found = {'drag': stand.runner.drag, 'start': free.start, 'scales': 'runner.drag' in OPPOSING}
found['tried'], found['assumed'] = 'runner.drag' in _TRIED, ASSUMED_SHARES['runner.drag']
found['cause'] = _change_text('runner.drag', 5.0, 0.1, 3.0, 0.1)
found['resumed'] = changed_stand(stand, {'runner.drag': 5.0}).runner.drag
recorded = open_run(sys.argv[2])
stroke = recorded.recording.series('/stroke')
found['stroke'] = float(stroke.value[0])
for name in ('foot_m', 'eddy_position_m', 'position_m'):
    each = recorded.series[name]
    found[name] = float(np.interp(stroke.time_s[0], each.time_s, each.value))
for law, friction in ('firm', 0.3), ('dahl', 0.6):
    changes = {'contact.law': law, 'contact.friction': friction, 'load_cell.contact': 'absent'}
    run = run_drive(Parameters().updated(changes), amplitude_m=60e-9, frequency_hz=1e3, steps=4)
    found[law] = run.step_length_m
print(json.dumps(found))
"""


@pytest.mark.parametrize('what', RECIPES)
def test_a_recipe_names_the_files_that_change(what: str):
    text = (ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8')
    [(recipe, _)] = re.findall(rf'(?ms)^(- \*\*Add a {what}:\*\*.*?)(?=^- \*\*)()', text)
    named = re.findall(rf'`(?:{PACKAGE}/)?([\w/]+(?:\.py)?)`', recipe)
    for file, _, _ in RECIPES[what]:
        assert any(file == each or file.startswith(f'{each}/') for each in named), file


@pytest.fixture(scope='module')
def run_changed(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Give a function that runs Python with a copy of the package to which all was added."""
    folder = tmp_path_factory.mktemp('recipes')
    package = folder / PACKAGE
    shutil.copytree(ROOT / PACKAGE, package, ignore=shutil.ignore_patterns('__pycache__'))
    probe = (package / PROBE).with_name('capacitive_probe.py').read_text(encoding='utf-8')
    (package / PROBE).write_text(probe.replace('CapacitiveProbe', 'EddyProbe'), encoding='utf-8')
    for name, behind, added in (row for rows in RECIPES.values() for row in rows if row[2]):
        text = (package / name).read_text(encoding='utf-8')
        assert text.count(behind) == 1, (name, behind)
        (package / name).write_text(text.replace(behind, added + behind), encoding='utf-8')

    def run(*words: object) -> str:
        environment = {**os.environ, 'PYTHONPATH': str(folder)}
        return run_process(
            [sys.executable, *words], env=environment, cwd=folder, check=True
        ).stdout

    return run


@pytest.mark.slow
def test_what_the_recipes_add_works_end_to_end(run_changed, tmp_path: Path):
    stand, file = tmp_path / 'stand.yaml', tmp_path / 'run.mcap'
    values = 'runner: {drag: 3.0}, eddy_probe: {enabled: true}'
    stand.write_text(f'/**: {{ros__parameters: {{{values}}}}}')
    found = json.loads(run_changed('-c', PROGRAM, stand, file))
    assert (found['drag'], found['start'], found['scales']) == (3.0, 4.0, True)
    assert (found['tried'], found['assumed'], found['resumed']) == (True, 0.2, 5.0)
    assert found['cause'].endswith('was 3 +- 0.1 at the start: a sail')
    assert found['stroke'] == pytest.approx(found['foot_m'], rel=1e-6)
    assert found['stroke'] != 0.0
    assert found['eddy_position_m'] == pytest.approx(found['position_m'], abs=1e-9)
    assert found['eddy_position_m'] != found['position_m']
    assert found['firm'] == pytest.approx(found['dahl'], rel=1e-9)
    assert found['firm'] > 1e-9
    listed = run_changed('-m', PACKAGE, 'parameters')
    assert '# drag [N s^2/m^2]; 0 to 1e+06 (assumed)\n      drag: 0.0\n' in listed
    assert '| epm | firm (' in listed
    page = run_changed('-m', PACKAGE, 'interface')
    assert 'displacement of the feet, m' in page
    assert 'eddy_probe.enabled' in page
