"""What the whole stack goes by: constants of the machine, words of its events."""
