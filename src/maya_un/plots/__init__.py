"""Pictures of the machine and of its motion, drawn by matplotlib.

Only this package imports matplotlib at the top of its modules, so callers import it late. It has no state; a function
takes plain values and returns a `Figure`, `maya_un.plots.style.save` writes it.
"""
