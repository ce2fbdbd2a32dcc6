"""How results show themselves in a notebook: a title, a table, and remarks that unfold."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_CELL = ' style="text-align: left; vertical-align: top"'  # notebooks set cells flush right


def card(
    title: str,
    said: str,
    rows: Iterable[Sequence[str]] = (),
    notes: Sequence[str] = (),
    folded: Sequence[str] = (),
    head: Sequence[str] = (),
) -> str:
    """HTML of a result; all text is escaped.

    Parameters
    ----------
    title, said : in bold, and what stands beside it
    rows : cells of each row
    notes, folded : lines below, and lines that unfold
    head : names of the columns
    """
    names = f"<thead><tr>{''.join(f'<th{_CELL}>{escape(name)}</th>' for name in head)}</tr></thead>" if head else ""
    body = "".join(f"<tr>{''.join(f'<td{_CELL}>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    table = f'<table style="margin: 0.4em 0">{names}<tbody>{body}</tbody></table>' if body else ""
    count = f"{len(folded)} remark{'s' if len(folded) > 1 else ''}"
    remarks = f"<details><summary>{count}</summary>{_listed(folded)}</details>" if folded else ""
    return f"<div><b>{escape(title)}</b>: {escape(said)}{table}{_listed(notes)}{remarks}</div>"


def _listed(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""
