"""Steps of remote processes of supervisors: their commands, their results, and their journal."""
