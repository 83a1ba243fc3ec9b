"""`maya teach`, `maya poses`, `maya pallets` and `maya zones`: taught places and zones."""
