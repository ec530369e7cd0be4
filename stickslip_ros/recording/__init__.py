"""Recordings: messages to bytes and back, MCAP files out and in, quantities over time."""

from stickslip_ros.recording.channels import Channel, Qos
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.messages import ArrayMessage, JointMessage, Message, StampedMessage
from stickslip_ros.recording.reader import ChannelSummary, Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.schemas import SCHEMAS, TYPE_HASHES
from stickslip_ros.recording.series import Series

__all__ = [
    'SCHEMAS',
    'TYPE_HASHES',
    'ArrayMessage',
    'Channel',
    'ChannelSummary',
    'FileForm',
    'JointMessage',
    'Message',
    'Qos',
    'Recorder',
    'Recording',
    'Series',
    'StampedMessage',
]
