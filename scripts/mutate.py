# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``make mutate``: put an error into a copy of the package, and report who sees it.

Each error is a change of one place in the sources. All of ``stickslip validate`` runs on the copy;
where it passes, the tests of TESTS run until one fails. Nothing is chosen beforehand, and an error
that nobody sees stays in the list. The copy compiles its own kernels, so this takes minutes for
each. Prints a table; docs/evidence/validation.md has its counts.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'stickslip_ros'
TESTS = (
    'test/lab/experiments/test_friction_loops.py',
    'test/drive',
    'test/contact',
    'test/instrument',
    'test/lab/comparison',
)
COPIED = ('stickslip_ros', 'test', 'config', 'docs', 'scripts', 'pyproject.toml')
HEAD = (
    '| error | module | `stickslip validate`: the first family that fails '
    '| tests: the first that fails |'
)
PYTEST = ('-m', 'pytest', '-x', '-q', '-n', '0', '-p', 'no:cacheprovider', '-o', 'timeout=0')
CHILD = """
from stickslip_ros.lab.validation.references import read_references
from stickslip_ros.lab.validation.self_test import CheckedAnswer, answer

compared = [row for row in read_references() if row.is_compared]
wrong = (row.family for row in compared if not CheckedAnswer(row, answer(row)).passed)
print(next(wrong, ''))
"""


class Mutation(NamedTuple):
    """An error: what it is, where, what stands there, what instead."""

    what: str
    module: str
    old: str
    new: str


MUTATIONS = (
    Mutation(
        'G* of Johnson: a quarter', 'contact/mdr.py',
        '(2.0 - poisson) / (4.0 * shear',
        '(2.0 - poisson) / (1.0 * shear',
    ),
    Mutation(
        'Eq. 24 without its factor 2', 'contact/mdr.py',
        'return 2.0 * elasticity.normal_pa * profile.pressed_area_at(depth_m)',
        'return elasticity.normal_pa * profile.pressed_area_at(depth_m)',
    ),
    Mutation(
        'Eq. 16: 1.9412 is 1.9421', 'contact/roughness.py',
        'POHRT_POPOV = 1.9412',
        'POHRT_POPOV = 1.9421',
    ),
    Mutation(
        'Eq. 10 without pi', 'contact/roughness.py',
        'return np.pi * wave',
        'return 1.0 * wave',
    ),
    Mutation(
        'a closed loop pops one turning point, not two', 'contact/memory.py',
        'resume_branch(curve, memory, max(depth - 2, 0))',
        'resume_branch(curve, memory, max(depth - 1, 0))',
    ),
    Mutation(
        "Masing's rule without its factor 2", 'contact/memory.py',
        'folded_n = memory.sense * 2.0 * virgin_force(curve, 0.5 * travel_m)',
        'folded_n = memory.sense * virgin_force(curve, travel_m)',
    ),
    Mutation(
        'loss of a branch: a sign', 'contact/memory.py',
        'return 4.0 * virgin_energy(curve, half_m) - 2.0 * half_m * force_n',
        'return 4.0 * virgin_energy(curve, half_m) + 2.0 * half_m * force_n',
    ),
    Mutation(
        'springs do not feel the preload change', 'contact/springs.py',
        'if after_n != before_n:',
        'if after_n > 1e9:',
    ),
    Mutation(
        'slip does not renew an aged contact', 'contact/ageing.py',
        'share = slip_m / ageing.distance_m',
        'share = 0.0 * slip_m',
    ),
    Mutation(
        'friction falls with velocity: a sign', 'contact/ageing.py',
        'ratio = 1.0 + ageing.rate_share',
        'ratio = 1.0 - ageing.rate_share',
    ),
    Mutation(
        'damping ignored', 'drive/build.py',
        'damping_n_s_per_m=parameters.runner.damping,',
        'damping_n_s_per_m=0.0,',
    ),
    Mutation(
        'damping ignored in long steps only', 'drive/long_step.py',
        'lanes.gamma[i] = plant.damping_n_s_per_m * plant.per_kg',
        'lanes.gamma[i] = 0.0 * plant.per_kg',
    ),
    Mutation(
        'external load: a sign', 'drive/long_step.py',
        'others_n = lanes.load_n[i] - lanes.contact_n[i]',
        'others_n = -lanes.load_n[i] - lanes.contact_n[i]',
    ),
    Mutation(
        'friction of one upper contact 10 % lower', 'drive/layout.py',
        '        contacts += [solved] * group.contacts\n',
        '        contacts += [solved] * group.contacts\n'
        '    contacts[0] = replace(contacts[0], friction=0.9 * contacts[0].friction)\n',
    ),
    Mutation(
        'a wave backwards starts at its lower end', 'drive/waveform.py',
        'start_v=float(base_v if forwards else base_v + amplitude_v)',
        'start_v=float(base_v if forwards else base_v)',
    ),
    Mutation(
        'mean position: weight of the middle 3, not 4', 'drive/runner.py',
        'mean_m = (state.position_m + 4.0 * middle_m + position_m) * SIXTH',
        'mean_m = (state.position_m + 3.0 * middle_m + position_m) * SIXTH',
    ),
    Mutation(
        'weight without the lower contacts', 'drive/layout.py',
        'each.weight * weight_n',
        'each.weight * 0.0',
    ),
    Mutation(
        'one-sided load cell without its gap', 'drive/runner.py',
        '    pressed_m = max(position_m - plant.walls.gap_m, 0.0)\n'
        '    return plant.walls.cell_n_per_m * pressed_m + stops',
        '    pressed_m = max(position_m, 0.0)\n'
        '    return plant.walls.cell_n_per_m * pressed_m + stops',
    ),
    Mutation(
        'feet are equal', 'drive/feet.py',
        'return plant.ratios[k] if',
        'return 1.0 if',
    ),
    Mutation(
        'creep: a factor 2', 'drive/piezo.py',
        'return plant.piezo.creep * total_m',
        'return 2.0 * plant.piezo.creep * total_m',
    ),
    Mutation(
        'resonance: a sign in its damping', 'drive/piezo.py',
        'lag_m = 2.0 * piezo.damping_ratio',
        'lag_m = -2.0 * piezo.damping_ratio',
    ),
    Mutation(
        'creep without its elements slower than 10 ms', 'drive/piezo.py',
        'for k in range(DECADES):\n'
        '        memory.crept_m[k]',
        'for k in range(1):\n'
        '        memory.crept_m[k]',
    ),
    Mutation(
        'look-ahead closes one loop only, and pops one turning point', 'contact/memory.py',
        'while depth > 0 and direction * (u_m - turns[depth, U]) >= loop_length(turns, depth):\n'
        '        depth = max(depth - 2, 0)',
        'if depth > 0 and direction * (u_m - turns[depth, U]) >= loop_length(turns, depth):\n'
        '        depth = max(depth - 1, 0)',
    ),
    Mutation(
        'springs are divided with one foot uncounted', 'drive/division.py',
        'count += 1.0 if is_equal else 0.0',
        'count += 1.0 if is_equal and other > 1 else 0.0',
    ),
    Mutation(
        'springs that slip under less friction lose half of their energy', 'drive/division.py',
        'lost_j = memory.lost_j + (before_j',
        'lost_j = memory.lost_j + 0.5 * (before_j',
    ),
    Mutation(
        'an added mass brings twice its kinetic energy', 'instrument/stand.py',
        '+= 0.5 * added_kg * speed**2',
        '+= added_kg * speed**2',
    ),
    Mutation(
        'damping twice in short steps only', 'drive/runner.py',
        '(plant.damping_n_s_per_m + stride.others',
        '(2.0 * plant.damping_n_s_per_m + stride.others',
    ),
    Mutation(
        'energy of the end stops twice', 'drive/runner.py',
        'return 0.5 * force_n * force_n / plant.walls.stop_n_per_m',
        'return force_n * force_n / plant.walls.stop_n_per_m',
    ),
    Mutation(
        'current limit over six capacitances', 'drive/build.py',
        'setting.current_max / parameters.actuator.capacitance',
        'setting.current_max / (6.0 * parameters.actuator.capacitance)',
    ),
    Mutation(
        'a window that moves loses a tenth more than it should', 'drive/travel.py',
        'memory.lost_j - memory.base_j + curve.energy_max_j',
        'memory.lost_j - memory.base_j + 1.1 * curve.energy_max_j',
    ),
    Mutation(
        'the line of the runner moves half as far as the runner', 'contact/travel.py',
        'round(window_m / track.spacing_m)',
        'round(0.5 * window_m / track.spacing_m)',
    ),
    Mutation(
        'the line of the runner is up to 10 % too high in its short waves', 'contact/travel.py',
        'amplitude_m = 2.0 * np.sqrt(np.add.reduceat(power_m2, edges[:-1]))',
        'amplitude_m = 2.0 * np.sqrt(np.add.reduceat(power_m2, edges[:-1]))\n'
        '    amplitude_m *= np.linspace(1.0, 1.1, len(amplitude_m))',
    ),
    Mutation(
        'runs are laid over each other by the mean of their difference',
        'lab/comparison/in_time.py',
        'float(np.median(of_a - of_b))',
        'float(np.mean(of_a - of_b))',
    ),
    Mutation(
        'what a long step misses in its middle does not swing on', 'drive/long_step.py',
        'missed = 4.0 * lanes.decay[i] * lanes.missed_middle[i] + missed',
        'missed = 4.0 * lanes.missed_middle[i] + missed',
    ),
    Mutation(
        'feet take no recoil from the recoil', 'drive/stacks.py',
        'return (own - share * pull / plant.driven) / (1.0 - share)',
        'return own - share * pull / plant.driven',
    ),
    Mutation(
        'energy of stacks with that of their centre of mass', 'drive/stacks.py',
        'return 0.5 * (doubled_j - momentum * momentum * plant.frame.per_kg)',
        'return 0.5 * doubled_j',
    ),
    Mutation(
        'the contacts do not push the frame', 'drive/frame.py',
        'force_n = state.contact_n + stride.lag_n - holding',
        'force_n = 0.0 * state.contact_n + stride.lag_n - holding',
    ),
    Mutation(
        'feet push the frame forwards', 'drive/frame.py',
        'return state.centre_m - plant.frame.feet_share',
        'return state.centre_m + plant.frame.feet_share',
    ),
    Mutation(
        'the mass of an attached load cell is left out', 'drive/build.py',
        'plant.mass_kg += plant.button.mass_kg',
        'plant.mass_kg += 0.0',
    ),
    Mutation(
        'an impact turns no velocity round', 'drive/button.py',
        '(1.0 + button.restitution) * (speed',
        '1.0 * (speed',
    ),
    Mutation(
        'a load bends a stack half as far', 'drive/stacks.py',
        'bent_m, grows_m = foot.before_n / piezo',
        'bent_m, grows_m = 0.5 * foot.before_n / piezo',
    ),
    Mutation(
        'feet do not feel their frame', 'drive/stacks.py',
        'inert_m = stride.recoil / (',
        'inert_m = 0.0 / (',
    ),
    Mutation(
        'feet: radius ignored', 'drive/layout.py',
        'replace(contact, radius=radius_m, young_sphere=young_pa)',
        'replace(contact, young_sphere=young_pa)',
    ),
    Mutation(
        'feet: radius of the next group', 'drive/layout.py',
        'profile_of(own, ',
        'profile_of(each_contact[(i + 1) % len(each_contact)], ',
    ),
    Mutation(
        'feet: groups of another radius or load are one kind', 'drive/layout.py',
        'key=lambda each: each._replace(feet=0))\n',
        'key=lambda each: (each.gain, each.delay_s))\n'
        '    alike = ((own[0], own) for own in [list(each) for _, each in alike])\n',
    ),
    Mutation(
        'feet: a foot against the others goes with them', 'drive/layout.py',
        'FeetMotion(each.gain,',
        'FeetMotion(abs(each.gain),',
    ),
    Mutation(
        'feet: guides count as driven', 'drive/layout.py',
        'for each in kinds if each.gain)',
        'for each in kinds)',
    ),
    Mutation(
        'feet: tolerance of the gains twice', 'drive/layout.py',
        'return 1.0 + tolerance * deviations',
        'return 1.0 + 2.0 * tolerance * deviations',
    ),
    Mutation(
        'feet: gains with a tolerance forget their group', 'drive/layout.py',
        'return gains * gain_ratios(',
        'return gain_ratios(',
    ),
    Mutation(
        "feet: counted once in the frame's mean", 'drive/feet.py',
        'value * plant.counts[k] / plant.driven',
        'value / plant.driven',
    ),
    Mutation(
        'feet: a late foot is where the first is', 'drive/feet.py',
        'state.late[plant.lates[k] - 1].foot_m if plant.lates[k]',
        'state.foot_m if plant.lates[k]',
    ),
    Mutation(
        'feet: stacks of all delays move as the first', 'drive/feet.py',
        '    if plant.lates[k]:\n',
        '    if plant.lates[k] > 9:\n',
    ),
    Mutation(
        'feet: every delay is the shortest', 'drive/delay.py',
        'longest_s - plant.delays_s[j]',
        'longest_s - plant.delays_s[0]',
    ),
    Mutation(
        'feet: delays start with a voltage of an own amplifier, 1 % high', 'drive/delay.py',
        'return clamp(plant, start_v + rate_v_per_s',
        'return clamp(plant, start_v + 1.01 * rate_v_per_s',
    ),
    Mutation(
        'feet: the history turns after two corners', 'drive/delay.py',
        'history.newest = newest = (newest + 1) % CORNERS',
        'history.newest = newest = (newest + 1) % 2',
    ),
    Mutation(
        'feet: a group of two has the springs of one foot', 'drive/build.py',
        'plant.counts[k] = sum(groups[i].contacts for i in own)',
        'plant.counts[k] = len(own)',
    ),
    Mutation(
        'feet: all have the friction of the contact', 'drive/layout.py',
        'friction = each.friction or contact.friction',
        'friction = contact.friction',
    ),
    Mutation(
        'feet: all have the modulus of the contact', 'drive/layout.py',
        'replace(contact, radius=radius_m, young_sphere=young_pa)',
        'replace(contact, radius=radius_m)',
    ),
    Mutation(
        'loss: damping ratio of the loss factor, not half of it', 'drive/build.py',
        'return float(loss_factor * math.sqrt(',
        'return float(2.0 * loss_factor * math.sqrt(',
    ),
    Mutation(
        'loss: without the stiffness of the load cell', 'drive/build.py',
        "held_n_per_m = contact_n_per_m + plant['cell_n_per_m']",
        'held_n_per_m = contact_n_per_m',
    ),
    Mutation(
        'loss: of the tangent alone in long steps', 'drive/long_step.py',
        'lost = lanes.loss_s[i] * missed_n * lanes.per_kg[i]',
        'lost = 0.0 * missed_n * lanes.per_kg[i]',
    ),
    Mutation(
        'loss: of the tangent alone at the end of short steps', 'drive/loss.py',
        'rate_n = 6.0 * missed_n - 16.0 * middle_n',
        'rate_n = 0.0',
    ),
    Mutation(
        'loss: the frame does not feel it', 'drive/frame.py',
        'missed_n += stride.lag_n - stride.start_lag_n',
        'missed_n += 0.0 * stride.lag_n',
    ),
    Mutation(
        'loss: stacks do not feel it', 'drive/loss.py',
        'foot.load_n += lag_n',
        'foot.load_n += 0.0 * lag_n',
    ),
    Mutation(
        'loss: not in the work of the feet', 'drive/loss.py',
        'sums.feet_work_j -= impulse * foot_speed',
        'sums.feet_work_j -= 0.0 * foot_speed',
    ),
    Mutation(
        'loops: the rig is rigid', 'lab/experiments/friction_loop.py',
        'rig_n_per_m=loop.rig_n_per_m)',
        'rig_n_per_m=0.0)',
    ),
    Mutation(
        'loops: a closed one begins in its middle', 'lab/experiments/friction_loop.py',
        'for _ in range(1 + loop.is_closed):',
        'for _ in range(1):',
    ),
)  # fmt: skip


def main() -> int:
    """Try all mutations, or those whose names have a word; 1 if nobody sees one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('words', nargs='?', default='', help='in module or name of an error')
    parser.add_argument('--validate-only', action='store_true', help='run no tests')
    asked = parser.parse_args()
    tests = () if asked.validate_only else TESTS
    chosen = [each for each in MUTATIONS if asked.words in f'{each.module} {each.what}']
    with copied() as tree:
        seen = verdict(tree, tests)
    if any(seen):
        raise SystemExit(f'without any error, these fail: {seen}')
    print(f'{HEAD}\n| --- | --- | --- | --- |', flush=True)
    count: Counter[str] = Counter()
    for each in chosen:
        with copied(each) as tree:
            checks, test = verdict(tree, tests)
        count['validate' if checks else 'only the tests' if test else 'nobody'] += 1
        shown = (checks or '**none**', f'`{test}`' if test else '' if checks else '**none**')
        print(f'| {each.what} | `{each.module}` | {" | ".join(shown)} |', flush=True)
    print(f'\nof {len(chosen)}: ' + ', '.join(f'{who} {n}' for who, n in count.items()))
    return 1 if count['nobody'] else 0


def verdict(tree: Path, tests: tuple[str, ...]) -> tuple[str, str]:
    """Return the first family that fails in a tree; if none does, the first test that fails."""
    answer = run_in(tree, '-c', CHILD)
    if answer.returncode:
        return f'ends with an error: {answer.stderr.splitlines()[-1]}', ''
    if family := answer.stdout.strip():
        return family, ''
    ran = run_in(tree, *PYTEST, *tests) if tests else answer
    if not ran.returncode:
        return '', ''
    told = [line for line in ran.stdout.splitlines() if line.startswith(('FAILED', 'ERROR'))]
    return '', told[0].split()[1] if told else f'pytest ends with {ran.returncode}'


def run_in(tree: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a tree, on the package there."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=tree,
        env={**os.environ, 'PYTHONPATH': str(tree)},
        check=False,
        capture_output=True,
        text=True,
    )


@contextmanager
def copied(mutation: Mutation | None = None) -> Iterator[Path]:
    """Make a copy of package and tests, with an error if one is given."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / 'tree'
        tree.mkdir()
        for name in COPIED:
            if (ROOT / name).is_dir():
                left_out = shutil.ignore_patterns('__pycache__', 'images')
                shutil.copytree(ROOT / name, tree / name, ignore=left_out)
            else:
                shutil.copy(ROOT / name, tree / name)
        if mutation:
            module = tree / PACKAGE / mutation.module
            module.write_text(mutated(mutation), encoding='utf-8')
        yield tree


def mutated(mutation: Mutation) -> str:
    """Return the text of a module with an error."""
    text = (ROOT / PACKAGE / mutation.module).read_text(encoding='utf-8')
    if text.count(mutation.old) != 1:
        raise SystemExit(f'{mutation.module} has not once {mutation.old!r}')
    return text.replace(mutation.old, mutation.new)


if __name__ == '__main__':
    sys.exit(main())
