"""The history of jobs, written down before it is announced: rows, the journal's protocol, and its SQLite file."""
