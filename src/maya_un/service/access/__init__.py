"""Access control: roles, the table of operations, callers, users and their tokens, the gate before the service."""
