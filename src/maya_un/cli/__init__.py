"""The command line: a fast-starting interface to the service, with translated messages."""
