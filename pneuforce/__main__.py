"""Entry point of `python -m pneuforce`."""

from pneuforce.instrument.cli import main

if __name__ == "__main__":
    main()
