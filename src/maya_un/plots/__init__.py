"""Pictures of the machine and of its motion, drawn by matplotlib.

The only package that imports matplotlib at the top of its modules: whoever draws imports it late. Nothing here keeps
a state of its own; a function takes plain values and returns a `Figure`, `maya_un.plots.style.save` writes it.
"""
