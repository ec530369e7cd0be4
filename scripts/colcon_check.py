# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Build the package as a ROS workspace does and start the installed node once: `make colcon`.

Run it with a Python that has colcon and the ROS 2 wheels. `ros2 run` is not among the wheels, so
the executable is looked up here by the rule that `ros2 run` has: the first file of that name in
lib/<package> of a prefix that the ament index knows.

"""

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import rclpy

PACKAGE, EXECUTABLE, NODE = 'stickslip_ros', 'drive', 'stickslip_drive'
ROOT = Path(__file__).resolve().parents[1]
WORKSPACE = ROOT / '.colcon'
COLCON = Path(sys.prefix) / 'bin' / 'colcon'
START_LIMIT_S = 60.0  # a cold import of numba, and discovery
STOP_LIMIT_S = 60.0
DOMAIN = str(100 + os.getpid() % 100)  # apart from what else runs on this machine


def colcon(verb: str, *options: str) -> str:
    """Run a colcon verb on the project in the scratch workspace; return what it printed."""
    command = [str(COLCON), '--log-base', 'log', verb, '--base-paths', str(ROOT), *options]
    done = subprocess.run(command, cwd=WORKSPACE, check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout


def sourced(setup: Path) -> dict[str, str]:
    """Give the environment of a shell that has sourced a colcon workspace."""
    script = f'. {shlex.quote(str(setup))} && env -0'
    done = subprocess.run(['bash', '-c', script], check=True, stdout=subprocess.PIPE, text=True)
    return dict(line.split('=', 1) for line in done.stdout.split('\0') if line)


def installed_executable(environment: dict[str, str]) -> Path:
    """Find the node where `ros2 run` would find it."""
    for prefix in map(Path, environment['AMENT_PREFIX_PATH'].split(os.pathsep)):
        marker = prefix / 'share/ament_index/resource_index/packages' / PACKAGE
        executable = prefix / 'lib' / PACKAGE / EXECUTABLE
        if marker.is_file() and os.access(executable, os.X_OK):
            return executable
    sys.exit(f'lib/{PACKAGE}/{EXECUTABLE} is not installed; look at [install] in setup.cfg')


def wait_until(condition: Callable[[], bool], limit_s: float) -> bool:
    """Ask until a condition holds; say whether it did before the limit."""
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.1)
    return True


def appears_and_ends(executable: Path, environment: dict[str, str]) -> None:
    """Start the node, see it in the ROS graph, end it with SIGINT and expect exit code 0."""
    observer = rclpy.create_node('colcon_check')
    process = subprocess.Popen([executable], env=environment)
    try:
        wait_until(
            lambda: process.poll() is not None or NODE in observer.get_node_names(),
            START_LIMIT_S,
        )
        if NODE not in observer.get_node_names():
            sys.exit(f'{executable} did not show as {NODE}; exit code {process.poll()}')
        process.send_signal(signal.SIGINT)
        code = process.wait(STOP_LIMIT_S)
    finally:
        process.kill()
        observer.destroy_node()
    if code != 0:
        sys.exit(f'{executable} ended with {code} on SIGINT; it should end with 0')


def check(*build_options: str) -> None:
    """Build with these options into an empty workspace and try the result."""
    shutil.rmtree(WORKSPACE, ignore_errors=True)
    WORKSPACE.mkdir()
    listed = colcon('list')
    if '(ros.ament_python)' not in listed:
        sys.exit(f'colcon does not see an ament_python package but: {listed or "nothing"}')
    colcon('build', *build_options)
    environment = sourced(WORKSPACE / 'install' / 'setup.bash')
    executable = installed_executable(environment)
    appears_and_ends(executable, environment)
    print(f'colcon {shlex.join(("build", *build_options))}: {executable.relative_to(ROOT)} runs')


def main() -> None:
    """Check the plain build and the one that developers use."""
    # A background job of a shell ignores SIGINT and its children inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ |= {'ROS_DOMAIN_ID': DOMAIN, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    rclpy.init()
    check()
    check('--symlink-install')
    rclpy.shutdown()


if __name__ == '__main__':
    main()
