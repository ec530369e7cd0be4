"""YAML without what ROS or a reader takes otherwise: keys twice, numbers of base 60, aliases."""

from typing import Any

import yaml

from stickslip_ros.errors import RecordingError, quoted

NUMBERS = ('tag:yaml.org,2002:int', 'tag:yaml.org,2002:float')


def read_yaml(text: str, origin: str, mend: str) -> object:
    """
    Read a document of YAML.

    Parameters
    ----------
    text : str
        The document.
    origin : str
        Its name, for messages.
    mend : str
        What to do if it is not YAML.

    Raises
    ------
    RecordingError
        If it is not YAML, has a key twice, a number such as ``1:30`` or an alias; names the line.

    """
    try:
        loader = _Loader(text)
        loader.origin = origin
        return loader.get_single_data()
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        problem = f'is not YAML ({" ".join(str(error).split())})'
        raise RecordingError(origin, problem, mend) from None


class _Loader(yaml.SafeLoader):
    """A loader that refuses; ``origin`` is the name of what it reads."""

    origin = ''

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            alias = self.peek_event()  # type: ignore[no-untyped-call]
            self.refuse(alias, f'has the alias *{alias.anchor}', 'write out what it stands for')
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        first: dict[str, Any] = {}
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            same = first.setdefault(key.value, key)
            if same is not key:
                problem = f'{quoted(key.value)} stands in line {same.start_mark.line + 1} too'
                self.refuse(key, problem, 'keep one of the two')
        return super().construct_mapping(node, deep)

    def construct_number(self, node: Any) -> Any:
        number = super().yaml_constructors[node.tag](self, node)
        if ':' in node.value:
            problem = f'YAML reads {node.value} as {number}, in base 60'
            self.refuse(node, problem, f"write {number}, or '{node.value}' for a text")
        return number

    def refuse(self, node: Any, problem: str, mend: str) -> None:
        raise RecordingError(f'{self.origin}: line {node.start_mark.line + 1}', problem, mend)


for tag in NUMBERS:
    _Loader.add_constructor(tag, _Loader.construct_number)
