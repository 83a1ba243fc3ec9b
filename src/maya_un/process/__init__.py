"""Floor 3: jobs in order. A job is a file; it is checked whole before its first step and reported step by step.

Import from the modules: `process.job` (the file), `process.tasks` (what it comes to), `process.preview`,
`process.process` (the queue), `process.report` (what happened).
"""
