"""
``make mutate``: put an error into a copy of the package, and demand that the evidence fails.

Each error is a change of one place in the sources. Run are the checks of one family whose names
have certain words: a subset of ``stickslip validate``, which fails if they do. The copy compiles
its own kernels, so this takes minutes. Prints the table of docs/validation.md.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = 'stickslip_ros'
CHILD = """
import json, sys
from stickslip_ros.validation.evidence import EVIDENCE
family, words = sys.argv[1:]
chosen = [c for f in EVIDENCE if f.name == family for c in f.checks if words in c.name]
print(json.dumps([[c.name, c.run().passed] for c in chosen]))
"""


class Mutation(NamedTuple):
    """An error: what it is, where, what stands there, what instead; family and words of checks."""

    what: str
    module: str
    old: str
    new: str
    family: str
    words: str = ''


MUTATIONS = (
    Mutation(
        'G* of Johnson: a quarter', 'contact/mdr.py',
        '(2.0 - poisson) / (4.0 * shear', '(2.0 - poisson) / (1.0 * shear', 'Normal load',
    ),
    Mutation(
        'Eq. 24 without its factor 2', 'contact/mdr.py',
        'return 2.0 * elasticity.normal_pa * profile.pressed_area_at(depth_m)',
        'return elasticity.normal_pa * profile.pressed_area_at(depth_m)', 'Normal load',
    ),
    Mutation(
        'Eq. 16: 1.9412 is 1.9421', 'contact/roughness.py',
        'POHRT_POPOV = 1.9412', 'POHRT_POPOV = 1.9421', 'Roughness',
    ),
    Mutation(
        'Eq. 10 without pi', 'contact/roughness.py',
        'return np.pi * wave', 'return 1.0 * wave', 'Spectra', 'roll-off',
    ),
    Mutation(
        'a closed loop pops one turning point, not two', 'contact/memory.py',
        '_resume(curve, memory, max(depth - 2, 0))', '_resume(curve, memory, max(depth - 1, 0))',
        'Springs one by one', 'sphere',
    ),
    Mutation(
        "Masing's rule without its factor 2", 'contact/memory.py',
        'folded_n = memory.sense * 2.0 * virgin_force(curve, 0.5 * travel_m)',
        'folded_n = memory.sense * virgin_force(curve, travel_m)', 'Springs one by one', 'sphere',
    ),
    Mutation(
        'loss of a branch: a sign', 'contact/memory.py',
        'return 4.0 * virgin_energy(curve, half_m) - 2.0 * half_m * force_n',
        'return 4.0 * virgin_energy(curve, half_m) + 2.0 * half_m * force_n',
        'Springs one by one', 'sphere',
    ),
    Mutation(
        'springs do not feel the preload change', 'contact/springs.py',
        'if after_n != before_n:', 'if after_n > 1e9:', 'Spring bank', 'preload ramps',
    ),
    Mutation(
        'damping ignored', 'drive/build.py',
        'damping_n_s_per_m=parameters.runner.damping,', 'damping_n_s_per_m=0.0,',
        'Drive', 'damped:',
    ),
    Mutation(
        'damping ignored in long steps only', 'drive/long_step.py',
        'gamma = plant.damping_n_s_per_m * plant.per_kg', 'gamma = 0.0 * plant.per_kg',
        'Drive', 'damped:',
    ),
    Mutation(
        'external load: a sign', 'drive/runner.py',
        'return load_n - contact_n - plant.cell_n_per_m * position_m',
        'return -load_n - contact_n - plant.cell_n_per_m * position_m', 'Drive', 'loaded:',
    ),
    Mutation(
        'friction of one upper contact 10 % lower', 'drive/build.py',
        '        contacts += [one] * group.contacts\n',
        '        contacts += [one] * group.contacts\n'
        '    group, few = groups_of(contact, weight_n)[0], 0.9 * contact.friction\n'
        '    contacts[0] = presliding(group.profile, elasticity, few, group.share * preload_n)\n',
        'Drive', 'fixed to',
    ),
    Mutation(
        'a wave backwards starts at its lower end', 'drive/waveform.py',
        'start_v=float(base_v if forwards else base_v + amplitude_v)',
        'start_v=float(base_v if forwards else base_v)', 'Drive', 'free, backwards',
    ),
    Mutation(
        'mean position: weight of the middle 3, not 4', 'drive/long_step.py',
        'mean_m = (state.position_m + 4.0 * middle_m + position_m) * SIXTH',
        'mean_m = (state.position_m + 3.0 * middle_m + position_m) * SIXTH', 'Drive', 'fixed to',
    ),
    Mutation(
        'weight without the lower contacts', 'drive/build.py',
        '(LOWER_CONTACTS, LOWER_SHARE, weight_n)', '(LOWER_CONTACTS, LOWER_SHARE, 0.0)',
        'Drive', 'weight',
    ),
    Mutation(
        'one-sided load cell without its gap', 'drive/runner.py',
        '    pressed_m = max(position_m - plant.walls.gap_m, 0.0)\n'
        '    return plant.walls.cell_n_per_m * pressed_m + stops',
        '    pressed_m = max(position_m, 0.0)\n'
        '    return plant.walls.cell_n_per_m * pressed_m + stops',
        'Drive', 'one-sided',
    ),
    Mutation(
        'feet are equal', 'drive/feet.py',
        'ratio = plant.ratios[k] if', 'ratio = 1.0 if', 'Drive', 'unequal',
    ),
    Mutation(
        'creep: a factor 2', 'drive/piezo.py',
        'return plant.piezo.creep * total_m', 'return 2.0 * plant.piezo.creep * total_m',
        'Drive', 'creep',
    ),
    Mutation(
        'resonance: a sign in its damping', 'drive/piezo.py',
        'lag_m = 2.0 * plant.piezo.damping_ratio', 'lag_m = -2.0 * plant.piezo.damping_ratio',
        'Drive', 'resonance',
    ),
)  # fmt: skip


def main() -> int:
    """Try all mutations, or those whose names have a word; 1 if one is not caught."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('words', nargs='?', default='', help='in the names of the mutations')
    chosen = [each for each in MUTATIONS if parser.parse_args().words in each.what]
    print('| error | module | checks of | failed |\n| --- | --- | --- | --- |', flush=True)
    missed = 0
    for each in chosen:
        verdicts = verdicts_on(each)
        failed = [name for name, passed in verdicts if not passed]
        missed += not failed
        checked = f'{each.family}{f", {each.words!r}" if each.words else ""}'
        told = f'{len(failed)} of {len(verdicts)}' if failed else '**none**'
        print(f'| {each.what} | `{each.module}` | {checked} | {told} |', flush=True)
    return 1 if missed else 0


def verdicts_on(mutation: Mutation) -> list[tuple[str, bool]]:
    """Return names of the checks, and whether they pass in spite of a mutation."""
    with mutated(mutation) as tree:
        words = [sys.executable, '-c', CHILD, mutation.family, mutation.words]
        run = subprocess.run(words, cwd=tree, check=True, capture_output=True, text=True)
    verdicts: list[tuple[str, bool]] = json.loads(run.stdout.splitlines()[-1])
    if not verdicts:
        raise SystemExit(f'no check of {mutation.family} has {mutation.words!r} in its name')
    return verdicts


@contextmanager
def mutated(mutation: Mutation) -> Iterator[Path]:
    """Make a tree with a copy of the package that has an error."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        shutil.copytree(
            ROOT / PACKAGE, tree / PACKAGE, ignore=shutil.ignore_patterns('__pycache__')
        )
        module = tree / PACKAGE / mutation.module
        text = module.read_text(encoding='utf-8')
        if text.count(mutation.old) != 1:
            raise SystemExit(f'{mutation.module} has not once {mutation.old!r}')
        module.write_text(text.replace(mutation.old, mutation.new), encoding='utf-8')
        yield tree


if __name__ == '__main__':
    sys.exit(main())
