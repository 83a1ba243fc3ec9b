"""The process layer: jobs in order.

Import from the modules: `process.job` (the file), `process.tasks` (what it comes to), `process.preview`,
`process.process` (the queue and its parts), `process.report` (what happened),
`process.journal` (what keeps it), `process.lease` (who drives). Names in jobs are `process.names`' affair: parts and
places, cells of pallets (`process.pallet`, `process.cells`), and what has been taught (`process.taught`, kept by
`process.book`).
"""
