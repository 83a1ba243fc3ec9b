"""Commissioning: the first connection to a real controller, step by step, with a person who watches the machine.

`steps` declares the procedure, `procedure` carries it out, `guarded` moves axes within bounds, and `judgement` names
the mistakes in the wiring from readings and answers, without any input or output.
"""
