"""What the command line offers, one file a command: arguments in, calls, words out; everything heavy is imported inside."""

import time

STARTED = time.monotonic()  # of the process, near enough: nothing heavy has been loaded yet
