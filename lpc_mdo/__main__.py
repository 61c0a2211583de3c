"""`python -m lpc_mdo`, the same as `lpc-mdo`."""

from lpc_mdo.cli import main

if __name__ == "__main__":
    main()
