"""Jobs as users write them: files, pallets, steps, taught poses, and the tasks to which a job expands."""
