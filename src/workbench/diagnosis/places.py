"""Where the nodes of a syntax tree stand in the text."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field


@dataclass
class Places:
    """Where nodes stand in the text."""

    data: bytes
    starts: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.starts = [0]
        for line in self.data.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def start(self, node: ast.expr) -> int:
        """The node's first byte."""
        return self.starts[node.lineno - 1] + node.col_offset

    def end(self, node: ast.expr) -> int:
        """The byte behind the node."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self.starts[node.end_lineno - 1] + node.end_col_offset

    def text(self, start: int, end: int) -> str:
        """What stands there."""
        return self.data[start:end].decode()

    def operator(self, node: ast.BinOp) -> tuple[int, int]:
        """Start and end of the operator between the operands, comments and brackets passed over."""
        place, stop = self.end(node.left), self.start(node.right)
        while place < stop:
            char = self.data[place : place + 1]
            if char == b"#":
                place = self.data.index(b"\n", place)
            elif char in b"+-*/@%":
                size = 2 if self.data[place : place + 2] in (b"**", b"//") else 1
                return place, place + size
            place += 1
        raise ValueError("no operator")
