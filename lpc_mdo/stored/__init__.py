"""What stored files must hold: one model a format, by which every command reads them, whole, before it writes anything.

A key that a format does not know is passed over: newer versions may add some, and nothing reads them. Every key that it
does know must be there and hold what it says.
"""
