"""The queue of jobs: its entries, the scheduler, the runner, and every change as a transaction."""
