"""The controller's motion: profiles, sequences, axes over time. No text, no wire."""
