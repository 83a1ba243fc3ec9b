"""Scripts that let a shell complete what is typed; they know the commands by heart, so that a TAB starts nothing."""
