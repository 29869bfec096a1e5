"""`python -m instrument`: the command line."""

from instrument.cli import main

if __name__ == "__main__":
    main()
