"""A receiver of progress that keeps what it is told."""

from __future__ import annotations

from finger3d.progress import Progress


class Log(Progress):
    """The stages and messages of a job, in order."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def stage(self, text: str) -> None:
        self.lines.append(text)

    def say(self, text: str) -> None:
        self.lines.append(text)

    def remark(self, text: str) -> None:
        self.lines.append(text)
