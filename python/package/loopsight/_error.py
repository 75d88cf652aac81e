"""The exception of the package."""

from __future__ import annotations


class Error(Exception):
    """What went wrong: what was expected, what was found, and where.

    Attributes
    ----------
    message : str
        What was expected and what was found.
    help : str or None
        The nearest right thing, where one is known.
    file : str or None
        The file, or the name under which a text was handed over.
    line, column : int or None
        Where the mistake is, counted from 1: characters in TOML, fields in CSV.
    excerpt : str or None
        The line with the mistake.
    exit_status : int
        What the command would end with: 2 where the request is wrong, 1 where the work failed.
    """

    def __init__(
        self,
        message: str,
        *,
        help: str | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        excerpt: str | None = None,
        exit_status: int = 2,
        shown: str | None = None,
    ) -> None:
        super().__init__(shown or message)
        self.message = message
        self.help = help
        self.file = file
        self.line = line
        self.column = column
        self.excerpt = excerpt
        self.exit_status = exit_status
