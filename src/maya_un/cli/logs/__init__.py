"""`maya logs`: events from the journal and lines from the log, even if `maya up` does not run."""
