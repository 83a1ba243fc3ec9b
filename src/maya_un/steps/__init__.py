"""Steps of processes that supervisors drive: their commands, results, and the record of those done."""
