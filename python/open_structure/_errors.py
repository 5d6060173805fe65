"""What this package raises: ``Error`` and its kinds, each also of the kind that Python itself would raise."""


class Error(Exception):
    """Anything that this package raises of its own."""

    __module__ = "open_structure"


class FormatError(Error, ValueError):
    """A file is not what the specification says; the message names file, table, row and column where it can."""

    __module__ = "open_structure"


class OptionError(Error, ValueError):
    """An argument cannot be used."""

    __module__ = "open_structure"


class StepError(Error, RuntimeError):
    """A step cannot be done with this sequence."""

    __module__ = "open_structure"


class NotFoundError(Error, FileNotFoundError):
    """Nothing of that name is there."""

    __module__ = "open_structure"


class ExistsError(Error, FileExistsError):
    """Something of that name is there already."""

    __module__ = "open_structure"


class AccessError(Error, OSError):
    """The operating system refused."""

    __module__ = "open_structure"


class InternalError(Error, RuntimeError):
    """A mistake of this package, not of its user."""

    __module__ = "open_structure"
