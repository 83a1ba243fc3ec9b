"""Maya's mechanics on the motors of the virtual controller: what is physically true, and the record of it."""
