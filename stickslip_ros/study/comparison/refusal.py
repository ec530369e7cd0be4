"""Why two things cannot be compared."""

from stickslip_ros.errors import StickSlipError


class Incomparable(StickSlipError):
    """
    Two things, each in order, do not fit together.

    Parameters
    ----------
    what : object
        What was to be compared.
    problem : str
        Why that cannot be.
    mend : str
        What the user can do about it.

    """

    def __init__(self, what: object, problem: str, mend: str) -> None:
        super().__init__(f'{what} {problem}; {mend}')
