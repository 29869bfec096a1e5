"""`python -m pneuforce`: the command line."""

from pneuforce.instrument.cli import main

if __name__ == "__main__":
    main()
