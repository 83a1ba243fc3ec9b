"""Completion scripts for shells; they contain all commands, so that completing a command starts no program."""
