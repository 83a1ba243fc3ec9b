"""The process layer: jobs in order.

`process.process` is the queue as the layers above see it. `process.spec` reads jobs and expands them to tasks.
`process.outlook` previews tasks; `process.computation` has a worker do so, if there is one. `process.queue` holds and
runs jobs in the order of `process.queue_order`. `process.journal` stores them. `process.lease` decides who controls the
robot.
"""
