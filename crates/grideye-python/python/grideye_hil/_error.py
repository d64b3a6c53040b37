"""What is wrong with an input, where, and what to do about it."""

from __future__ import annotations

from typing import Optional


class InputError(ValueError):
    """A scene, recording, profile, script or argument that cannot be used.

    ``str(error)`` is what the command line prints.

    Attributes:
        file: the file to blame, as it was named; None where no file is.
        line: the line in it, from 1; None where the whole file is meant.
        hint: what to do about it; None where there is nothing to say.
    """

    def __init__(
        self,
        problem: str,
        hint: Optional[str] = None,
        file: Optional[str] = None,
        line: Optional[int] = None,
    ) -> None:
        super().__init__(problem if hint is None else f"{problem}\nhint: {hint}")
        self.file = file
        self.line = line
        self.hint = hint
