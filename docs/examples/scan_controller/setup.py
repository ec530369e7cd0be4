"""What is installed; `colcon test` runs what is in test/, and needs the extra `test` for it."""

from setuptools import setup

setup(
    name='scan_controller',
    version='0.1.0',
    packages=['scan_controller'],
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/scan_controller']),
        ('share/scan_controller', ['package.xml']),
    ],
    install_requires=['setuptools', 'numpy'],
    extras_require={'test': ['pytest']},
    entry_points={'console_scripts': ['scan_controller = scan_controller.node:main']},
)
