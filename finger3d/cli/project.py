"""validate, new, info, completion: the commands about finger3d itself."""

from __future__ import annotations

import tempfile
from dataclasses import asdict
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from finger3d.cli.common import Json, app, check_folder, complain, print_columns, print_json, print_rows, reporting
from finger3d.errors import Finger3dError, MissingError


@app.command
def validate(
    studies: Annotated[list[str] | None, Parameter(negative=())] = None,
    /,
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    out: Annotated[Path | None, Parameter(help="Folder for the results instead of validation/.")] = None,
    json_: Json = False,
) -> int:
    """Run studies of validation/: does the code reproduce closed forms, other codes, and the paper?

    Without names all studies run whose results were made by other sources than those that are there now; but those
    that time the machine (cost_of_accuracy, scaling, beside_calculix) run in full only by name.

    Example: finger3d validate press_line --quick

    Parameters
    ----------
    studies
        Names of studies.
    quick
        Small meshes and few steps; the committed results are left alone.
    """
    from finger3d import study

    known = study.studies()
    selected = study.chosen(studies or [], known, quick)
    home = next(iter(known.values())).path.parent
    if quick and out is not None and out.resolve() == home:
        raise Finger3dError(f"--out {out}: quick results would overwrite the full ones there; name another folder")
    folder = out or (Path(tempfile.mkdtemp(prefix="finger3d-validate-")) if quick else home)
    check_folder(folder)
    report, aside = reporting(json_)
    try:
        with aside, report:
            found = study.validate(selected, quick, folder, report, resume=not studies and not quick, known=known)
    except KeyboardInterrupt:
        complain(f"interrupted; {report.steps_done} of {len(selected)} studies are kept in {folder}")
        return 130
    if json_:
        rows = {
            name: [{**asdict(row), "error": row.error, "passed": row.passed} for row in rows]
            for name, rows in found.items()
        }
        print_json({"results": folder, "studies": rows})
    else:
        print_columns("study what kind reference wanted got error tolerance verdict".split(), study.table(found))
        print(f"results: {folder}")
    failed = [name for name, rows in found.items() if not all(row.passed for row in rows)]
    if not failed:
        return 0
    complain(f"validate: outside the tolerance: {', '.join(failed)} (see the rows marked FAIL)")
    return MissingError.exit_code


@app.command
def new(file: Path = Path("scene.toml"), /) -> int:
    """Write a commented scene to start from: the paper's Fig. 9 finger.

    Example: finger3d new my_scene.toml

    Parameters
    ----------
    file
        Where to write; a file that is there already is left alone.
    """
    text = resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text.replace("scene.toml", str(file)))
    except FileExistsError:
        raise Finger3dError(f"{file}: there already; give another name") from None
    except OSError as error:
        raise Finger3dError(f"{file}: cannot be written: {error.strerror}") from None
    print(f"{file} written; next: finger3d press {file} --out out")
    return 0


@app.command
def info(*, json_: Json = False) -> int:
    """Print versions, machine and folders: what a bug report needs.

    Example: finger3d info --json
    """
    import platform

    from finger3d.design.cache import folder
    from finger3d.fem import pardiso
    from finger3d.versions import cores, memory_bytes, versions

    memory = memory_bytes()
    if json_:
        machine = {
            "platform": platform.platform(),
            "cores": cores(),
            "memory_bytes": memory[0] if memory else None,
            "mesh_cache": folder(),
            "pardiso": pardiso.available(),
        }
        print_json({"versions": versions(), "machine": machine})
        return 0
    print_rows("versions", versions().items())
    print_rows(
        "machine",
        [
            ("platform", platform.platform()),
            ("cores", cores()),
            ("memory", f"{memory[0] / 1e9:.1f} GB" if memory else "unknown"),
            ("mesh cache", folder()),
            ("PARDISO", "available" if pardiso.available() else "not available; SuperLU is used, which is slower"),
        ],
    )
    return 0


@app.command
def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a script that lets a shell complete commands and options.

    For bash, add the line of the example to ~/.bashrc. For zsh, write the script to a file _finger3d in a folder of
    $fpath; for fish, to ~/.config/fish/completions/finger3d.fish.

    Example: source <(finger3d completion bash)

    Parameters
    ----------
    shell
        The shell.
    """
    print(app.generate_completion(shell=shell), end="")
    return 0
