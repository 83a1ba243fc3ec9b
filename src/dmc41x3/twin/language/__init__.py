"""Numbers, expressions, arguments and arrays of the DMC language; nothing of what a command does."""
