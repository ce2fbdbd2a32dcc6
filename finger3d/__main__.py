"""``python -m finger3d``: the same as the command ``finger3d``."""

import sys

from finger3d.cli import main

if __name__ == "__main__":
    sys.exit(main())
