"""``python -m finger3d``, and the console command: as little as can stand between Ctrl-C and its one line."""

import gc
import sys


def main() -> int:
    """Load the command line and run it."""
    try:
        from finger3d._lazy import loading

        with loading():
            from finger3d.cli import main as run

        return run()
    except KeyboardInterrupt:
        print("finger3d: interrupted; nothing was written", file=sys.stderr)
        return 130
    finally:
        gc.freeze()  # the process ends: nobody need look for what could be freed, which would take 0.1 s


if __name__ == "__main__":
    sys.exit(main())
