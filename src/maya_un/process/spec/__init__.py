"""Jobs as people write them: files, pallets, steps, taught poses, and the tasks that a job expands to."""
