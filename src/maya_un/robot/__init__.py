"""The robot layer: Maya's primitives. One file declares one primitive, and a preview is the plan that runs.

Import from the modules: `robot.robot` (the interface `Robot` and the layer itself), `robot.plan_builder` (plans),
`robot.primitives` (the primitives as data).
"""
