"""The program `twin`: `python -m twinrig run scenarios/trot.toml`."""

import sys

from twinrig import _native


def main() -> None:
    """Run the program with the arguments of the command line, and exit with its code."""
    sys.exit(_native.main(sys.argv[1:]))


if __name__ == "__main__":
    main()
