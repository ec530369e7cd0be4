# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How Sphinx builds these pages: `make docs`; rosdoc2 reads the same file."""

import json
import os
import re
from importlib.util import find_spec
from pathlib import Path

from pygments.lexers.special import TextLexer

import stickslip_ros
from stickslip_ros.lab.cli.main import VERBS, build_parser
from stickslip_ros.parameters.tree import Parameters, specs
from stickslip_ros.parameters.yaml_form import format_value

WITH_NOTEBOOKS = find_spec('myst_nb') is not None

project = 'stickslip_ros'
author = 'The stickslip_ros maintainers'
project_copyright = f'{author}; Apache-2.0'
version = release = stickslip_ros.__version__

extensions = [
    'myst_nb' if WITH_NOTEBOOKS else 'myst_parser',
    'sphinx.ext.autodoc',
    'sphinx.ext.mathjax',
    'sphinx.ext.napoleon',
    'sphinx.ext.viewcode',
]
if find_spec('sphinx-mathjax-offline'):
    extensions.append('sphinx-mathjax-offline')
if find_spec('sphinx_copybutton'):
    extensions.append('sphinx_copybutton')
    copybutton_exclude = '.linenos, .gp, .go'
source_suffix = {'.md': 'myst-nb' if WITH_NOTEBOOKS else 'markdown', '.rst': 'restructuredtext'}
root_doc = 'index'
html_theme = 'furo' if find_spec('furo') else 'sphinx_rtd_theme'
html_static_path = ['static']
html_css_files = ['wide.css']
html_search_scorer = str(Path(__file__).parent / 'static' / 'scorer.js')
html_show_search_summary = False  # which a browser does not fetch from file://
html_title = f'stickslip_ros {release}'

myst_enable_extensions = ['attrs_inline', 'dollarmath']
myst_heading_anchors = 3
nb_execution_mode = 'force'
nb_execution_in_temp = True
nb_execution_timeout = -1 if os.environ.get('STUDIES') == 'full' else 120
os.environ['STUDIES_FOLDER'] = str(Path(__file__).parent / 'studies')  # they run elsewhere
EXAMPLE = str(Path(__file__).parent / 'examples' / 'scan_controller')
IMPORTED = [EXAMPLE, os.environ['STUDIES_FOLDER'], os.environ.get('PYTHONPATH', '')]
os.environ['PYTHONPATH'] = os.pathsep.join(IMPORTED)

autodoc_member_order = 'bysource'
autodoc_typehints = 'description'
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

FOUND_FIRST = {
    'start/first_steps': ('install', 'demo', 'pip'),
    'start/scientist': ('notebook', 'Jupyter', 'citation'),
    'start/control_engineer': ('backlash', 'closed loop', 'PID', 'frequency response'),
    'start/ros_developer': ('ROS', 'topic', 'workspace'),
    'start/teacher': ('lesson', 'exercise'),
    'howto/bring_your_data': ('MATLAB', 'units', 'CSV', 'Excel', 'HDF5', 'LabVIEW'),
    'howto/fit': ('fit', 'encoder'),
    'howto/several_drives': ('namespace', 'two drives'),
    'howto/which_stage': ('SmarAct', 'attocube', 'stage'),
    'howto/questions': ('Windows', 'macOS', 'humble', 'distributions', 'latency', 'step size'),
    'howto/test_a_controller': ('pytest', 'lockstep'),
    'howto/ros2_control': ('MoveIt', 'trajectory'),
    'howto/when_something_is_odd': ('late', 'slow'),
    'explanation/fit': ('uncertainty', 'error bars'),
    'explanation/physics': ('friction', 'friction coefficient', 'roughness'),
    'howto/best_wave': ('waveform', 'optimise'),
    'howto/data_sheet': ('data sheet',),
    'howto/gym': ('reinforcement learning',),
    'howto/twin': ('digital twin',),
    'explanation/sensors': ('noise', 'interferometer'),
    'explanation/stand': ('hysteresis', 'resonance'),
    'reference/parameters': ('seed', 'preload'),
    'reference/terms': ('glossary', 'thrust'),
    'reference/python': ('pandas', 'DataFrame'),
    'reference/recordings': ('bag', 'MCAP'),
}
"""Words whose page the search of the site shows first: main entries of its index."""

rosdoc2_settings = {
    'allow_other_extensions': True,
    'override_theme': False,
    'support_markdown': False,
}


def add_help_of_verbs(_app, page, source):
    """Append to the page of the verbs what each of them says of itself."""
    if page != 'reference/verbs':
        return
    verbs = next(iter(build_parser()._subparsers._group_actions)).choices  # noqa: SLF001
    parts = [f'## {verb}\n\n```text\n{verbs[verb].format_help()}```\n' for verb in VERBS]
    source[0] += '\n' + '\n'.join(parts)


def add_parameters(_app, page, source):
    """Append to the page of the parameters a table of each group; each parameter is an anchor."""
    if page != 'reference/parameters':
        return
    defaults, group = Parameters().flat(), None
    for name, spec in specs().items():
        if (of := name.rpartition('.')[0]) != group:
            group = of
            source[0] += f'\n## {group or "node"}\n\n| parameter | default | bounds | meaning |\n'
            source[0] += '|---|---|---|---|\n'
        default = f'`{format_value(defaults[name])}` {spec.unit}'.rstrip()
        bounds = ', '.join(f'`{each}`' for each in spec.choices or ())
        if spec.minimum is not None:
            bounds = f'{spec.minimum:g} to {spec.maximum:g}'
        told = f'{spec.text.replace("|", "&#124;")} ({spec.source})'
        anchor = re.sub('[._]', '-', name)  # as docutils would make of it
        source[0] += f'| `{name}`{{#{anchor}}} | {default} | {bounds} | {told} |\n'


def add_words(_app, page, source):
    """Enter the words of a page into the index of the site, below its title."""
    entries = ', '.join(f'! {word}' for word in FOUND_FIRST.get(page, ()))
    if entries:
        title = re.search(r'^# .*\n', source[0], re.MULTILINE)[0]
        source[0] = source[0].replace(title, f'{title}\n```{{index}} {entries}\n```\n', 1)


def check_words(app, failure):
    """Fail the build where a word is no main entry of its page alone, which outranks all else."""
    if failure or app.builder.name != 'html':
        return
    text = (Path(app.outdir) / 'searchindex.js').read_text(encoding='utf-8')
    index = json.loads(text.removeprefix('Search.setIndex(').removesuffix(')'))
    for page, words in FOUND_FIRST.items():
        for word in words:
            entries = index['indexentries'].get(word.lower(), [])
            found = {index['docnames'][number] for number, _, is_main in entries if is_main}
            if found != {page}:
                hint = 'name it once in FOUND_FIRST, and write all pages: sphinx -a'
                raise ValueError(f'the search finds {word} first in {found}, not {page}; {hint}')


def setup(app):
    """Register what is built with the pages."""
    app.add_lexer('csv', TextLexer)
    app.connect('source-read', add_help_of_verbs)
    app.connect('source-read', add_parameters)
    app.connect('source-read', add_words)
    app.connect('build-finished', check_words)
    in_the_code = ['reference/verbs', 'reference/parameters']
    app.connect('env-get-outdated', lambda *_: in_the_code)
