"""Floor 2: what Maya can do with a part. A skill is one file; what is previewed is what runs.

Import from the modules: `robot.robot` (the floor itself), `robot.planning` (all of it but the doing), `robot.protocol`
(what others need of it), `robot.primitives` (the skills as data), `robot.plan` (what a skill comes to).
"""
