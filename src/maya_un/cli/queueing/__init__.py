"""`maya queue`, `maya job`, `maya history`: waiting, running and past jobs."""
