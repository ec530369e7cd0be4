# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is installed, and where; the one place of the project's metadata beside package.xml."""

import ast
import re
import sys
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'stickslip_ros'
SHARE = f'share/{NAME}'
# Of the source. It is on no public host yet; scripts/release.py writes the address of one.
HOME = 'https://stickslip-ros.invalid'
ROS_PACKAGES = (
    'std-msgs',
    'geometry-msgs',
    'sensor-msgs',
    'std-srvs',
    'diagnostic-msgs',
    'rosgraph-msgs',
    'lifecycle-msgs',
)


def ros_wheels(distribution):
    """Name the wheels of one ROS 2 distribution, for machines that have no ROS 2."""
    rclpy = f'ros-{distribution}-rclpy[fastrtps]'
    return [rclpy, *(f'ros-{distribution}-{package}' for package in ROS_PACKAGES)]


def version():
    """Read the version out of the package, without the imports that it needs."""
    lines = Path(NAME, '__init__.py').read_text(encoding='utf-8').splitlines()
    [line] = [line for line in lines if line.startswith('__version__ = ')]
    return ast.literal_eval(line.partition(' = ')[2])


def description():
    """Return README.md with addresses that hold away from the source, those of this version."""
    # Beside the source: colcon's --symlink-install runs a link to this file elsewhere.
    text = Path(__file__).resolve().with_name('README.md').read_text(encoding='utf-8')
    text = re.sub(r'(!\[[^]]*\]\()(?!http)', rf'\1{HOME}/raw/v{version()}/', text)
    return re.sub(r'(?<=\]\()(?!http|#)', f'{HOME}/blob/v{version()}/', text)


def files(folder, pattern):
    """List the files of a folder as setuptools wants them."""
    return sorted(str(path) for path in Path(folder).glob(pattern))


data_files = [
    ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
    (SHARE, ['package.xml']),
    (f'{SHARE}/config', files('config', '*.*')),
    (f'{SHARE}/config/stages', files('config/stages', '*.yaml')),
    (f'{SHARE}/launch', files('launch', '*.launch.py')),
]
# `ros2 run` looks in lib/stickslip_ros. colcon puts the console scripts there by setup.cfg; pip
# puts them in bin, so that a wheel brings launchers which lead from the one to the other.
if 'bdist_wheel' in sys.argv:
    data_files.append((f'lib/{NAME}', files('scripts/ros2run', '*')))

setup(
    name=NAME,
    version=version(),
    description='A virtual stick-slip microdrive for ROS 2, from the mechanics of rough contact',
    long_description=description(),
    long_description_content_type='text/markdown',
    url=HOME,
    project_urls={
        'Documentation': f'{HOME}/blob/v{version()}/docs/index.rst',
        'Changes': f'{HOME}/blob/v{version()}/CHANGELOG.rst',
        'Issues': f'{HOME}/issues',
    },
    license='Apache-2.0',
    author='The stickslip_ros maintainers',
    maintainer='The stickslip_ros maintainers',
    maintainer_email='noreply@stickslip-ros.invalid',
    keywords=['ROS', 'simulation', 'stick-slip', 'contact mechanics', 'friction'],
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Education',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        *(f'Programming Language :: Python :: 3.{minor}' for minor in range(10, 15)),
        'Topic :: Scientific/Engineering :: Physics',
        'Typing :: Typed',
    ],
    package_dir={'': '.'},  # said aloud, an editable install is one line in a .pth file
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        NAME: ['py.typed', '*.pyi'],
        f'{NAME}.lab.panel': ['page/*'],
        f'{NAME}.lab.figures': ['*.css', '*.mplstyle'],
        f'{NAME}.lab.validation': ['*.csv'],
    },
    data_files=data_files,
    python_requires='>=3.10',
    # ROS itself is not here: it comes with the distribution, or with one of the extras.
    install_requires=[
        # The oldest that were tried: CONTRIBUTING.md. The node takes no more than these.
        'numpy>=1.24',
        'numba>=0.58',
        'PyYAML',
        'mcap>=1.5',  # brings lz4 and zstandard
    ],
    extras_require={
        'jazzy': ros_wheels('jazzy'),
        'kilted': ros_wheels('kilted'),
        # What the tests build control_msgs on, which an installed ROS has.
        'jazzy-test': ['ros-jazzy-trajectory-msgs'],
        'kilted-test': ['ros-kilted-trajectory-msgs'],
        'lab': ['matplotlib', 'pandas', 'rich', 'rosbags>=0.11.9', 'scipy'],
        'completion': ['argcomplete'],
        'control': ['control'],
        'dask': ['distributed'],
        'design': ['cma'],
        # Of the examples that open doors to other programs, and of their clients.
        'doors': ['PyMeasure', 'PyVISA-py', 'caproto', 'gymnasium', 'ophyd'],
        'docs': [
            'SALib',
            'control',
            'furo',
            'myst-nb',
            'sphinx',
            'sphinx-copybutton',
            'sphinx-mathjax-offline',
        ],
        # And slippy, which asks for numpy below 1.21: `make foreign` adds it to its last two.
        'evidence': ['ContactMechanics', 'SurfaceTopography', 'tamaas', 'pyfftw', 'tinydb'],
        'formats': ['h5py', 'npTDMS', 'openpyxl'],
        'panel': ['tornado>=6.2'],
        'parquet': ['pyarrow'],
        # What tests of a user's controller need beside ROS.
        'testing': ['pytest'],
        'units': ['pint'],
        'test': [
            'pytest',
            'pytest-timeout',
            'pytest-xdist',
            'argcomplete',
            'axe-playwright-python',
            'cma',
            'control',
            'emcee',
            'hypothesis',
            'mcap-ros2-support',
            'distributed',
            'h5py',
            'npTDMS',
            'openpyxl',
            'playwright',
            'pyarrow',
            'pint',
            'tornado',
            'urdf-parser-py',
            'xarray',
        ],
        'lint': [
            'ruff',
            'mypy',
            'import-linter',
            'types-PyYAML',
            'pandas-stubs',
            'catkin_pkg',
            'pre-commit',
        ],
    },
    entry_points={
        'console_scripts': [
            'stickslip = stickslip_ros.lab.cli.start:stickslip',
            'drive = stickslip_ros.ros.start:drive',
            'twin = stickslip_ros.lab.twin.start:twin',
        ],
    },
    zip_safe=False,  # numba keeps its compiled kernels beside the source
)
