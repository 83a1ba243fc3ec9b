"""Find faults and name remedies: it reads and asks, and never moves or changes anything."""
