"""The messages of the service: types only, which import nothing but other plain values."""
