"""Entry point of ``python -m finger3d`` and of the console script ``finger3d``."""

import sys


def main() -> int:
    """Run the command line and return its exit code."""
    try:
        from finger3d.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("finger3d: interrupted; nothing was written", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
