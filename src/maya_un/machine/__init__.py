"""Maya's mechanics on the motors of the virtual controller: the physical truth, and the record of it."""
