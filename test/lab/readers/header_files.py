# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One measurement with the headers of instruments, and what the user must say of each."""

from collections.abc import Iterable
from typing import Any

COUNT = 40
TIMES_S = [round(1e-4 * row, 6) for row in range(COUNT)]
VOLTS = [5.0 * (row % 10) for row in range(COUNT)]
MICRONS = [round(0.01 * row + 8e-4 * volts, 6) for row, volts in enumerate(VOLTS)]
SCOPE = {'voltage_v': 'CH1 (100 V)', 'position_m': 'CH2 (um)'}
ASIS: dict[str, str] = {}


def of(head: str, rows: Iterable[Iterable[object]], sign: str = ',') -> str:
    return '\n'.join([*head.split('\n'), *(sign.join(map(str, row)) for row in rows), ''])


def columns(*given: object) -> Iterable[tuple[Any, ...]]:
    """Yield rows of lists and of constants, as many as the shortest list has."""
    lists = (each if isinstance(each, list) else [each] * COUNT for each in given)
    return zip(*lists, strict=False)


def labview(says: str, multi: bool = False) -> str:
    blank = '\t' if multi else ''
    return (
        f'LabVIEW Measurement\t\nWriter_Version\t2\nX_Columns\t{says}\n***End_of_Header***\t\n\n'
        f'Channels\t2\t\nSamples\t{COUNT}\t{blank}{COUNT}\nTime\t11:42:07\t{blank}11:42:07\n'
        f'Y_Unit_Label\tVolts\t{blank}um\nX_Dimension\tTime\t{blank}Time\n'
        f'X0\t0.5\t{blank}0.5\nDelta_X\t1e-4\t{blank}1e-4\n***End_of_Header***\t\t\n'
    )


LATE_S = [round(each + 5e-5, 6) for each in TIMES_S]
CENTIVOLTS = [each / 100.0 for each in VOLTS]
TEKTRONIX = of(
    'Model,DPO3014\nHorizontal Units,s\nSample Interval,1e-04\nRecord Length,40\n'
    'Probe Attenuation,1,1\nVertical Units,V,V\nVertical Scale,1,0.5\n,\nLabel,piezo,cell\n'
    'TIME,CH1,CH2',
    columns(TIMES_S, CENTIVOLTS, MICRONS),
)
File = tuple[str, dict[str, str], float]


def file(
    head: str,
    rows: Iterable[Iterable[object]],
    said: dict[str, str] = ASIS,
    first_s: float = 0.0,
    sign: str = ',',
) -> File:
    return of(head, rows, sign), said, first_s


FILES = {
    'Tektronix': (TEKTRONIX, SCOPE, 0.0),
    'LabVIEW with a clock': file(
        f'{labview("One")}X_Value\tVoltage\tPosition\tComment',
        columns(TIMES_S, VOLTS, MICRONS),
        sign='\t',
    ),
    'Rigol DS': file(
        'X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.000000e-03,1.000000e-04',
        columns(list(range(COUNT)), CENTIVOLTS, MICRONS, '', ''),
        said=SCOPE,
        first_s=-1e-3,
    ),
    'Keysight': file(
        'x-axis,1,2\nsecond,Volt,Volt',
        columns(TIMES_S, CENTIVOLTS, MICRONS),
        said={'voltage_v': '1 (100 V)', 'position_m': '2 (um)'},
    ),
    'PI': file(
        '# REM E-712 \n# DIM = 2 \n# SAMPLE_TIME = 0.000100 \n# NDATA = 40 \n# \n'
        '# NAME0 = Current Position of axis  1 \n# NAME1 = Control Voltage 1 \n# \n'
        '# END_HEADER ',
        columns(MICRONS, VOLTS),
        said={
            'position_m': 'Current Position of axis  1 (um)',
            'voltage_v': 'Control Voltage 1 (V)',
        },
        sign='\t',
    ),
    'LabVIEW without times': file(
        f'{labview("No")}X_Value\tVoltage\tPosition\tComment',
        columns('', VOLTS, MICRONS),
        first_s=0.5,
        sign='\t',
    ),
    'LabVIEW without a column of times': file(
        f'{labview("No")}X_Value\tVoltage\tPosition\tComment',
        columns(VOLTS, MICRONS),
        first_s=0.5,
        sign='\t',
    ),
    'LabVIEW with two clocks': file(
        f'{labview("Multi", multi=True)}X_Value\tVoltage\tX_Value\tPosition\tComment',
        columns(TIMES_S, VOLTS, LATE_S, MICRONS),
        sign='\t',
    ),
    'Rigol MSO': file(
        'CH1V,CH2V,t0 = -3.000000e-03, tInc = 1.000000e-04,',
        columns(CENTIVOLTS, MICRONS, '', ''),
        said={'voltage_v': 'CH1V (100 V)', 'position_m': 'CH2V (um)'},
        first_s=-3e-3,
    ),
    'Graphtec': file(
        'Vendor,GRAPHTEC Corporation\nSampling interval,100us\nCH,Signal name,Input,Range\n'
        'CH1,"Piezo",DC,100V\nData\nNumber,Date&Time,us,CH1,CH2\nNO.,Time,us,V,V',
        columns(
            list(range(1, COUNT + 1)),
            '2021/05/04 09:00:00',
            [100 * row % 1000 for row in range(COUNT)],
            [f'+ {each:8.4f}' for each in VOLTS],
            [f'+ {each:8.4f}' for each in MICRONS],
        ),
        said={'voltage_v': 'CH1 (V)', 'position_m': 'CH2 (um)'},
    ),
    'logger': file(
        '\ufeffTimestamp,2021-05-04 09:00:00,Timestamp,2021-05-04 09:00:00\n'
        'Interval,0.0001,Interval,0.0001\nChannel name,"Piezo",Channel name,"Position"\n'
        'Unit,"V",Unit,"um"',
        columns(TIMES_S, VOLTS, TIMES_S, MICRONS),
    ),
    'logger with numbers of rows': file(
        'Channel name,Piezo,Position\nUnit,V,um\nInterval,1e-4',
        columns(list(range(1, COUNT + 1)), VOLTS, MICRONS),
    ),
    'two clocks': file(
        'Time (s),Position (um),Time (s),Voltage (V)', columns(LATE_S, MICRONS, TIMES_S, VOLTS)
    ),
    'two clocks in two units': file(
        'Time (s),Voltage (V),Time (ms),Position (um)',
        columns(TIMES_S, VOLTS, [round(1e3 * each, 6) for each in TIMES_S], MICRONS),
    ),
    'Siglent': file(
        'Sample Interval,Analog:0.0001\nVertical Units,CH1:V,CH2:V\nHorizontal Units,s\n'
        'Horizontal Scale,0.004\nSource,CH1,CH2\nSecond,Volt,Volt',
        columns(TIMES_S, CENTIVOLTS, MICRONS),
        said=SCOPE,
    ),
    'Yokogawa': file(
        '"Header Size",16\n"TraceName","CH1","CH2"\n"BlockSize",40\n"VUnit","V","V"\n'
        '"HResolution",1.0E-04\n"HOffset",-3.0E-03\n"HUnit","s"\n',
        columns('', CENTIVOLTS, MICRONS),
        said=SCOPE,
        first_s=-3e-3,
    ),
    'Rohde & Schwarz': file(
        'in s,C1 in V,C2 in V',
        columns(TIMES_S, CENTIVOLTS, MICRONS),
        said={'voltage_v': 'C1 (100 V)', 'position_m': 'C2 (um)'},
    ),
    'LeCroy': file(
        'LECROY,1,Waveform\nSegments,1,SegmentSize,40\nSegment,TrigTime,TimeSinceSegment1\n'
        '#1,14-Nov-2012 11:38:43,0\nTime,CH1,CH2',
        columns(TIMES_S, CENTIVOLTS, MICRONS),
        said=SCOPE,
    ),
    'units alone': file(
        'second,Volt,Volt',
        columns(TIMES_S, CENTIVOLTS, MICRONS),
        said={'voltage_v': '#2 (100 V)', 'position_m': '#3 (um)'},
    ),
    'coarse times': file(
        'Time(s),CH1(V),CH2(V)',
        columns([f'{e + 1e-9:.3f}' for e in TIMES_S], CENTIVOLTS, MICRONS),
        said=SCOPE,
        first_s=5e-4,  # a tick, 1 ms, is the last time that was reached
    ),
    'PlotJuggler': file(
        '__time,/rig/voltage/data,/rig/position/data',
        (
            row
            for time_s, volts, microns in columns(TIMES_S, VOLTS, MICRONS)
            for row in ((time_s, volts, ''), (f'{time_s + 2e-5:.6f}', '', microns))
        ),
        said={'voltage_v': '/rig/voltage/data (V)', 'position_m': '/rig/position/data (um)'},
    ),
    'nanoseconds since 1970': file(
        'time (ns),voltage (V),position (um)',
        columns([1620118800123456789 + 100_000 * row for row in range(COUNT)], VOLTS, MICRONS),
    ),
    'rostopic echo -p': file(
        '%time,field.header.seq,field.u,field.x',
        columns([1620118800123456789 + 100_000 * row for row in range(COUNT)], 7, VOLTS, MICRONS),
        said={'voltage_v': 'field.u (V)', 'position_m': 'field.x (um)'},
    ),
}
"""File, what the user must say, and the time of its first voltage."""
