"""The past: events from the journal and lines from the log, whether `maya up` runs or not."""
