"""What is wrong and what to do about it: looks, asks, and never moves or changes anything."""
