"""
Draw the last two cycles of a run as a film: an SVG that any browser plays.

``python docs/examples/film.py runs/run_7.mcap film.svg`` takes a recording; without words it
simulates eight cycles and writes ``runs/film.svg``.

"""

import sys
from pathlib import Path

from stickslip_ros import Parameters, draw_stand, open_run, simulate


def main(recording=None, film='runs/film.svg', end_s=None):
    """Write a film of a recording, or of a simulated run, up to a time, s; return its path."""
    if recording is None:
        run = simulate(Parameters(), amplitude_m=160e-9, steps=8)
    else:
        run = open_run(recording)
    path = Path(film)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(draw_stand(run, end_s), encoding='utf-8')
    return path


if __name__ == '__main__':
    print(main(*sys.argv[1:3]))
