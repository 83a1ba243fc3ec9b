"""The only place that connects the layers and chooses between real and virtual.

`controller` opens the controller layer alone, `stack` opens all layers, and `staff` provides their worker processes.
"""
