"""Recordings: messages to bytes and back, MCAP files out and in, quantities over time."""

from stickslip_ros.recording.channels import Channel, Qos
from stickslip_ros.recording.file_form import FileForm
from stickslip_ros.recording.messages import ArrayMessage, Message, StampedMessage
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.schemas import SCHEMAS, TYPE_HASHES
from stickslip_ros.recording.series import Series
from stickslip_ros.recording.tally import ChannelSummary

__all__ = [
    'SCHEMAS',
    'TYPE_HASHES',
    'ArrayMessage',
    'Channel',
    'ChannelSummary',
    'FileForm',
    'Message',
    'Qos',
    'Recorder',
    'Recording',
    'Series',
    'StampedMessage',
]
