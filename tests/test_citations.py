"""Citations: no file of the project points to a page that is not in it, and every section cited exists."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REFERENCES = ROOT / "validation" / "REFERENCES.md"
# generated from the studies, whose sources are checked here
GENERATED = ("validation/figures/",)
PRIVATE = re.compile(r"\b(?:references|design|contract|geometry|house|models)\.md\b|\b[Ii]ssues? #?\d")
CITED = re.compile(r"REFERENCES\.md, (\d+(?:\.\d+)?(?:(?:, | and | to )\d+(?:\.\d+)?)*)")


def texts() -> dict[str, str]:
    """Text of every file of the project, by its path."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    found = {}
    for name in filter(None, listed):
        path = ROOT / name
        if path.is_file() and path != Path(__file__).resolve() and not name.startswith(GENERATED):
            try:
                found[name] = path.read_text(encoding="utf-8")
            except UnicodeDecodeError:  # a picture, an STL file
                continue
    return found


def test_no_file_cites_a_page_that_is_not_in_the_project() -> None:
    assert not {name: match[0] for name, text in texts().items() if (match := PRIVATE.search(text))}


def test_every_section_of_the_references_that_is_cited_exists() -> None:
    sections = set(re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", REFERENCES.read_text(encoding="utf-8"), flags=re.MULTILINE))
    cited = {
        (name, section)
        for name, text in texts().items()
        # a citation may be broken across the lines of a docstring or a comment
        for group in CITED.findall(re.sub(r"\s*\n[ #]*", " ", text))
        for section in re.findall(r"\d+(?:\.\d+)?", group)
    }
    assert len(cited) > 50
    assert not {(name, section) for name, section in cited if section not in sections}


def test_every_section_of_the_references_has_its_anchor_and_names_its_users() -> None:
    text = REFERENCES.read_text(encoding="utf-8")
    numbers = re.findall(r"^### (\d+\.\d+) ", text, flags=re.MULTILINE)
    assert len(numbers) == len(set(numbers))
    for section in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        number = section.split(" ")[0]
        assert f'<a id="s{number}"></a>' in section
        users = re.findall(r"Used\s+by:\s+([\w\s,./:*-]+?)\.(?:\s|$)", section)
        assert users, number
        for name in re.findall(r"[\w./]+", " ".join(users)):
            if name != "and":
                path = ROOT / name if name.startswith("tests/") else ROOT / "validation" / f"{name}.py"
                assert path.is_file(), f"{number}: {name}"
