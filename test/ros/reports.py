# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a test sees of a drive: the parts of its diagnostics, its ends of topics."""

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from stickslip_ros.testing import stamp_ns

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def values_of(part: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in part.values}


def endpoint_of(stand: Any, name: str, *, published: bool) -> Any:
    """Give what the operator's side of the network knows of the drive's end of a topic."""
    node = stand.operator.node
    get = node.get_publishers_info_by_topic if published else node.get_subscriptions_info_by_topic
    found: list[Any] = []

    def look() -> bool:
        found[:] = [each for each in get(name) if each.node_name == 'stickslip_drive']
        return bool(found)

    stand.operator.spin_until(look, f'{name} of the drive')
    [endpoint] = found
    return endpoint


class Reports:
    """The diagnostics from now on, by the last word of the names of their parts."""

    def __init__(self, stand: Any) -> None:
        self._stand, self._operator = stand, stand.operator
        self.heard = stand.operator.listen('diagnostics')

    def parts(self, name: str, since_ns: int = 0) -> list[DiagnosticStatus]:
        """Give a part of each report since a time, by the clock of the drive."""
        late = [each for each in self.heard if stamp_ns(each) >= since_ns]
        return [part for each in late for part in each.status if part.name.endswith(f': {name}')]

    def await_part(
        self, name: str, fits: Callable[[DiagnosticStatus], Any] = lambda _: True
    ) -> DiagnosticStatus:
        """Wait for a part that fits; give the newest."""
        self._operator.spin_until(lambda: any(map(fits, self.parts(name))), f'part {name}')
        return [*filter(fits, self.parts(name))][-1]

    def next(self, name: str) -> DiagnosticStatus:
        """Wait for a part that is made from now on."""
        now_ns = self._stand.drive.get_clock().now().nanoseconds
        self._operator.spin_until(lambda: self.parts(name, now_ns), f'the next part {name}')
        return self.parts(name, now_ns)[-1]
