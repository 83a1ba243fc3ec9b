"""The command line: it starts fast, translates, and decides nothing."""
