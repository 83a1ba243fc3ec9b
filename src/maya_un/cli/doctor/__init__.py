"""`maya doctor`: find faults and show remedies; it only reads, and does not move the robot."""
