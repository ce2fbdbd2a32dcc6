"""Entry point of ``python -m finger3d`` and of the console script ``finger3d``."""

import sys

from finger3d._interruption import interruption_ends_process, termination_interrupts


def main() -> int:
    """Run the command line and return its exit code."""
    try:
        with termination_interrupts():
            from finger3d.cli import main as run

            code = run()
        interruption_ends_process()
        return code
    except KeyboardInterrupt:
        print("finger3d: interrupted; what was finished is kept", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
