"""
Build the wheel, install it into a fresh environment and use it there: `make wheel`.

The wheel is built from the source distribution, which shows that MANIFEST.in leaves nothing out,
and lands in dist/. What it requires comes from the lock that is named; nothing is taken from the
folder of the project.

"""

import os
import re
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DIST = ROOT / 'dist'
SHIPPED = (
    'stickslip_ros/py.typed',
    'stickslip_ros/lab/runs/page.css',
    'stickslip_ros/lab/panel/page/panel.js',
    'stickslip_ros/lab/validation/foreign.csv',
    'stickslip_ros/lab/validation/references.csv',
    'share/stickslip_ros/package.xml',
    'share/stickslip_ros/config/test_stand.yaml',
    'share/stickslip_ros/launch/drive.launch.py',
    'share/ament_index/resource_index/packages/stickslip_ros',
    'lib/stickslip_ros/drive',
)
USES = (
    'bin/stickslip contact --normal-force 0.7',
    'bin/stickslip simulate --voltage 100 --steps 20 -o run.mcap',
    'bin/stickslip info run.mcap',
    'bin/drive --help',
    'lib/stickslip_ros/drive --help',
)
FOREIGN = ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'PYTHONPATH')
"""What the ROS wheels of this environment set; the other environment sets its own."""


def main() -> None:
    """Build, install, use."""
    lock = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(prefix='stickslip_wheel_') as name:
        folder = Path(name)
        wheel = built(folder)
        environment = folder / 'venv'
        install(wheel, lock, environment)
        use(environment, folder)
    print(f'{wheel.relative_to(ROOT)}: installs and runs')


def built(folder: Path) -> Path:
    """Build the wheel from the source distribution; refuse one that lacks a file."""
    command = [sys.executable, 'setup.py', '--quiet', 'sdist', '--dist-dir', str(folder)]
    subprocess.run(command, cwd=ROOT, check=True)
    [source] = folder.glob('*.tar.gz')
    options = ('--no-deps', '--no-build-isolation', '--wheel-dir', DIST)
    pip(Path(sys.executable), 'wheel', *options, source)
    [wheel] = DIST.glob(f'{source.name.removesuffix(".tar.gz")}-*.whl')
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    lacking = [file for file in SHIPPED if not any(name.endswith(file) for name in names)]
    if lacking:
        sys.exit(f'{wheel.name} lacks {", ".join(lacking)}; look at setup.py and MANIFEST.in')
    return wheel


def install(wheel: Path, lock: Path, environment: Path) -> None:
    """Install a wheel and what it requires, in the versions of a lock."""
    subprocess.run([sys.executable, '-m', 'venv', environment], check=True)
    python = environment / 'bin' / 'python'
    tools = re.findall(r'^(?:pip|setuptools|wheel)==\S+', lock.read_text(), re.MULTILINE)
    pip(python, 'install', *tools)
    # One of the wheels' requirements comes as source; it is not to be built with newer tools.
    pip(python, 'install', '--no-build-isolation', '-c', lock, f'{wheel}[{lock.stem}]')


def use(environment: Path, folder: Path) -> None:
    """Run what a user runs first, away from the project; end with what failed."""
    for words in USES:
        program, *options = words.split()
        start_s = time.monotonic()
        done = subprocess.run(
            [environment / program, *options],
            cwd=folder,
            env=surroundings(),
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0 or not done.stdout:
            sys.exit(f'{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}')
        print(f'{words}: {time.monotonic() - start_s:.1f} s', flush=True)


def pip(python: Path, *words: object) -> None:
    """Run pip of an environment."""
    command = [str(python), '-m', 'pip', '--disable-pip-version-check', '--quiet']
    subprocess.run([*command, *map(str, words)], env=surroundings(), check=True)


def surroundings() -> dict[str, str]:
    """Return the variables of this process that suit another environment."""
    return {name: value for name, value in os.environ.items() if name not in FOREIGN}


if __name__ == '__main__':
    main()
