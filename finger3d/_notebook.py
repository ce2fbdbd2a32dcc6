"""HTML representation of a result in a notebook: a title, a table and remarks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_CELL = ' style="text-align: left; vertical-align: top"'  # Jupyter aligns cells to the right


def card(
    title: str,
    status: str,
    rows: Iterable[Sequence[str]] = (),
    notes: Sequence[str] = (),
    folded: Sequence[str] = (),
    head: Sequence[str] = (),
) -> str:
    """Return the HTML of a result. All text is escaped.

    Parameters
    ----------
    title : title, in bold
    status : one line that follows the title
    rows : cells of each row of the table
    notes : lines below the table
    folded : further lines, which are collapsed
    head : names of the columns
    """
    names = f"<thead><tr>{''.join(f'<th{_CELL}>{escape(name)}</th>' for name in head)}</tr></thead>" if head else ""
    body = "".join(f"<tr>{''.join(f'<td{_CELL}>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    table = f'<table style="margin: 0.4em 0">{names}<tbody>{body}</tbody></table>' if body else ""
    count = f"{len(folded)} remark{'s' if len(folded) > 1 else ''}"
    remarks = f"<details><summary>{count}</summary>{_list(folded)}</details>" if folded else ""
    return f"<div><b>{escape(title)}</b>: {escape(status)}{table}{_list(notes)}{remarks}</div>"


def _list(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""
