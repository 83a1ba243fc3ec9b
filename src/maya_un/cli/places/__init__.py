"""`maya teach`, `maya poses`, `maya pallets` and `maya zones`: places that people name."""
