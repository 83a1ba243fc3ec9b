"""`maya queue`, `maya job`, `maya history`: what waits, what is under way, what was."""
