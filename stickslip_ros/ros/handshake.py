"""Proof that a drive knows who talks to it, without which the first command may be lost."""

from time import monotonic
from typing import Any

from lifecycle_msgs.srv import GetState
from rclpy.node import Node

RETRY_S = 0.2
"""Wall-clock time after which a call without an answer is made again."""


class Handshake:
    """
    A call to a drive, made again until it is answered.

    DDS tells the two ends of a topic of each other one after the other, under load seconds apart.
    What a publisher sends before the drive knows of it is lost, although the publisher already
    counts a subscriber. A node announces what it offers in order, so once a service has answered
    a client of it, the drive knows all that the node has offered before that client.

    Parameters
    ----------
    node : Node
        Its publishers and subscriptions exist already.
    drive : str
        Name of the drive's node, with its namespace if that is not the one of ``node``.

    Attributes
    ----------
    state : str
        What the drive answered: the state of its lifecycle.

    """

    def __init__(self, node: Node, drive: str) -> None:
        self._node = node
        self._client = node.create_client(GetState, f'{drive}/get_state')
        self._asked_s = -RETRY_S
        self._is_answered = False
        self.state = ''

    def knock(self) -> bool:
        """Call, unless that was done just now; tell whether an answer has come."""
        now_s = monotonic()
        is_due = now_s - self._asked_s >= RETRY_S
        if not self._is_answered and is_due and self._client.service_is_ready():
            self._asked_s = now_s
            self._client.call_async(GetState.Request()).add_done_callback(self._note)
        return self._is_answered

    def close(self) -> None:
        """Take the client away."""
        self._node.destroy_client(self._client)

    def _note(self, answer: Any) -> None:
        self._is_answered = True
        self.state = answer.result().current_state.label
