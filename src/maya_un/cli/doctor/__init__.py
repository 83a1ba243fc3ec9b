"""`maya doctor`: find faults and show remedies; it only reads, and moves and changes nothing."""
